//! Pseudo-random numbers. Needs only `core`: `firmware/boards/portable` includes this file.

/// Pseudo-random numbers that never change: xorshift64*, in integers only.
#[derive(Clone, Debug)]
pub struct Fixed(u64);

impl Fixed {
    /// A separate sequence for every seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    /// The next 32 bits.
    pub fn bits(&mut self) -> u32 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 32) as u32
    }

    /// Uniform in `low`…`high`; exact in f64.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * f64::from(self.bits()) / f64::from(u32::MAX)
    }
}

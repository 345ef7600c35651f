//! The random number generator (RM0090, 24).

use stm32f4xx_hal::pac::RNG;
use stm32f4xx_hal::rcc::{Enable, Rcc};
use trueaxis_firmware::link::BootNonce;

/// Number of status polls until a word is ready: 40 periods of its 48 MHz, at 168 MHz.
const TRIES: u32 = 10_000;

/// The random number generator.
pub struct Random(RNG);

impl Random {
    /// The clock of the generator must run at 48 MHz.
    pub fn new(generator: RNG, rcc: &mut Rcc) -> Self {
        RNG::enable(rcc);
        generator.cr().modify(|_, w| w.rngen().set_bit());
        Self(generator)
    }

    /// A random word; `None` if the generator detects a fault of itself or of its clock.
    fn word(&mut self) -> Option<u32> {
        for _ in 0..TRIES {
            let status = self.0.sr().read();
            if status.seis().bit_is_set() || status.ceis().bit_is_set() {
                return None;
            }
            if status.drdy().bit_is_set() {
                return Some(self.0.dr().read().rndata().bits());
            }
        }
        None
    }
}

impl BootNonce for Random {
    fn boot_nonce(&mut self) -> Option<u64> {
        // The manual requires the first word to be discarded.
        self.word()?;
        Some(u64::from(self.word()?) << 32 | u64::from(self.word()?))
    }
}

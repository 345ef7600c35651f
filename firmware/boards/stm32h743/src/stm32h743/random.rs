//! The random number generator (RM0433, 34).

use embassy_stm32::Peri;
use embassy_stm32::pac;
use embassy_stm32::peripherals::RNG;
use trueaxis_firmware::link::BootNonce;

/// Number of status polls until a word is ready: about 200 periods of its 48 MHz, at 400 MHz.
const TRIES: u32 = 10_000;

/// The random number generator. The driver of the HAL would wait for ever if it were broken.
pub struct Random(Peri<'static, RNG>);

impl Random {
    /// The generator runs on the internal clock of 48 MHz, which `embassy_stm32::init` starts.
    pub fn new(generator: Peri<'static, RNG>) -> Self {
        pac::RCC.ahb2enr().modify(|w| w.set_rngen(true));
        // The clock runs once this has been read.
        let _ = pac::RCC.ahb2enr().read();
        pac::RNG.cr().modify(|w| w.set_rngen(true));
        Self(generator)
    }

    /// A random word; `None` if the generator detects a fault of itself or of its clock.
    fn word(&mut self) -> Option<u32> {
        for _ in 0..TRIES {
            let status = pac::RNG.sr().read();
            if status.seis() || status.ceis() {
                return None;
            }
            if status.drdy() {
                // Zero indicates a seed fault that occurred during the read.
                return Some(pac::RNG.dr().read()).filter(|&word| word != 0);
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

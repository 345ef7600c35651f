//! The table slots in the second bank of the internal flash.
//!
//! While it erases a sector (up to 4 s) or programs, every access to this bank waits. The program is in
//! the other one, and the samples are read in the mirror.

use cortex_m::peripheral::{CPUID, SCB};
use embassy_stm32::flash::{Blocking, Error, Flash};
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};

use crate::bare;

/// First address of the flash.
const START: usize = 0x0800_0000;

/// The flash: addresses of the driver count from its start.
pub struct SecondBank {
    flash: Flash<'static, Blocking>,
    /// For the data cache, which keeps what was there before.
    scb: SCB,
}

/// Why the flash did not do what it was asked.
#[derive(Clone, Copy, Debug)]
pub enum FlashError {
    /// The controller of the flash.
    Controller(Error),
    /// A word whose error-correcting code does not hold: the power went while it was programmed.
    Unreadable,
    /// A place that does not exist.
    Place,
}

impl embedded_storage::nor_flash::NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Controller(Error::Unaligned) => NorFlashErrorKind::NotAligned,
            Self::Controller(Error::Size) | Self::Place => NorFlashErrorKind::OutOfBounds,
            Self::Controller(_) | Self::Unreadable => NorFlashErrorKind::Other,
        }
    }
}

impl SecondBank {
    /// Takes the flash and what knows the caches, which it enables.
    #[must_use]
    pub fn new(flash: Flash<'static, Blocking>, mut scb: SCB, cpuid: &mut CPUID) -> Self {
        scb.enable_icache();
        scb.enable_dcache(cpuid);
        Self { flash, scb }
    }

    /// Nothing of what was there is kept in the cache.
    fn forget(&mut self, offset: u32, length: usize) {
        // Flash is never written through the cache: there is nothing to clean.
        self.scb
            .clean_invalidate_dcache_by_address(START + offset as usize, length);
    }
}

impl ErrorType for SecondBank {
    type Error = FlashError;
}

impl ReadNorFlash for SecondBank {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        let end = (offset as usize).checked_add(bytes.len());
        if end.is_none_or(|end| end > self.capacity()) {
            return Err(FlashError::Place);
        }
        if bare::read(START + offset as usize, bytes) {
            Ok(())
        } else {
            Err(FlashError::Unreadable)
        }
    }

    fn capacity(&self) -> usize {
        embassy_stm32::flash::FLASH_SIZE
    }
}

impl NorFlash for SecondBank {
    const WRITE_SIZE: usize = embassy_stm32::flash::WRITE_SIZE;
    const ERASE_SIZE: usize = embassy_stm32::flash::MAX_ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        let result = self.flash.blocking_erase(from, to);
        self.forget(from, to.saturating_sub(from) as usize);
        result.map_err(FlashError::Controller)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        let result = self.flash.blocking_write(offset, bytes);
        self.forget(offset, bytes.len());
        result.map_err(FlashError::Controller)
    }
}

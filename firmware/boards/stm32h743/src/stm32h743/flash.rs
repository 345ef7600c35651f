//! The table slots in the second bank of the internal flash.
//!
//! While it erases a sector (up to 4 s) or programs, every access to this bank waits. The program is in the other bank,
//! and the samples are read from the mirror.

use cortex_m::peripheral::{CPUID, SCB};
use embassy_stm32::flash::{Blocking, Error, Flash};
use embassy_stm32::pac::FLASH;
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase,
};

use crate::bare;

/// Longer than the erase of any sector, ms (data sheet: 4 s).
const ERASE: u32 = 6000;

/// First address of the flash.
const START: usize = 0x0800_0000;
/// Length of a bank in bytes.
const BANK: u32 = 1024 * 1024;

/// The flash: addresses of the driver are offsets from its start.
pub struct SecondBank {
    flash: Flash<'static, Blocking>,
    /// For the data cache, which may contain old data.
    scb: SCB,
    /// Reports that the main loop is alive; returns the time, ms.
    alive: fn() -> u32,
}

/// Why an operation of the flash failed.
#[derive(Clone, Copy, Debug)]
pub enum FlashError {
    /// The flash controller reported an error.
    Controller(Error),
    /// A word whose error-correcting code reports an error: power was lost while it was being programmed.
    Unreadable,
    /// A sector was not erased.
    NotErased,
    /// An address that does not exist, or is in the program's bank.
    Place,
}

impl embedded_storage::nor_flash::NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Controller(Error::Unaligned) => NorFlashErrorKind::NotAligned,
            Self::Controller(Error::Size) | Self::Place => NorFlashErrorKind::OutOfBounds,
            Self::Controller(_) | Self::Unreadable | Self::NotErased => NorFlashErrorKind::Other,
        }
    }
}

impl SecondBank {
    /// Takes the flash and the cache control, and enables the caches. While a sector is being erased, the main loop is
    /// in here: it calls `alive` to report that it is alive and to get the time, ms.
    #[must_use]
    pub fn new(
        flash: Flash<'static, Blocking>,
        mut scb: SCB,
        cpuid: &mut CPUID,
        alive: fn() -> u32,
    ) -> Self {
        scb.enable_icache();
        scb.enable_dcache(cpuid);
        Self { flash, scb, alive }
    }

    /// Erases a sector of bank 2 (RM0433, 4.3.10). The driver of the HAL would be silent for so long that the main loop
    /// would count as dead.
    fn erase_sector(&mut self, sector: u8) -> Result<(), FlashError> {
        let bank = FLASH.bank(1);
        bank.ccr().write(|w| {
            w.set_clr_eop(true);
            w.set_clr_wrperr(true);
            w.set_clr_pgserr(true);
            w.set_clr_operr(true);
        });
        if bank.cr().read().lock() {
            for key in [0x4567_0123, 0xCDEF_89AB] {
                bank.keyr().write_value(key);
            }
        }
        bank.cr().modify(|w| {
            w.set_ser(true);
            w.set_snb(sector);
        });
        bank.cr().modify(|w| w.set_start(true));
        let start = (self.alive)();
        let busy = || {
            let status = bank.sr().read();
            status.bsy() || status.qw()
        };
        while busy() {
            // An erase that never ends is left to the watchdog.
            if (self.alive)().wrapping_sub(start) > ERASE {
                while busy() {}
            }
        }
        let status = bank.sr().read();
        bank.cr().modify(|w| w.set_ser(false));
        bank.cr().modify(|w| w.set_lock(true));
        if status.wrperr() || status.pgserr() || status.operr() {
            return Err(FlashError::NotErased);
        }
        Ok(())
    }

    /// Discards old data from the cache.
    fn forget(&mut self, offset: u32, length: usize) {
        // Flash is never written through the cache, so there is nothing to clean.
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
        check_erase(self, from, to).map_err(|_| FlashError::Place)?;
        if from < BANK {
            return Err(FlashError::Place);
        }
        for start in (from..to).step_by(Self::ERASE_SIZE) {
            let result = self.erase_sector(((start - BANK) / Self::ERASE_SIZE as u32) as u8);
            self.forget(start, Self::ERASE_SIZE);
            result?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        let result = self.flash.blocking_write(offset, bytes);
        self.forget(offset, bytes.len());
        result.map_err(FlashError::Controller)
    }
}

//! The table slots in the internal flash.
//!
//! One bank: while it erases a sector (up to 4 s) or programs, every fetch and every read stalls.

use core::ops::Range;

use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use stm32f4xx_hal::flash::{Error, FlashExt, UnlockedFlash};
use stm32f4xx_hal::pac::FLASH;
use trueaxis_firmware::slots::{Mapped, Slot, TableFlash, WhileBusy};

use super::watchdog::while_nothing_runs;
use crate::bare::slots;

/// The internal flash: addresses of the driver are offsets from its start.
pub struct InternalFlash {
    flash: FLASH,
}

impl InternalFlash {
    /// Takes the flash controller.
    pub const fn new(flash: FLASH) -> Self {
        Self { flash }
    }

    /// Errors stay in the register until they are cleared, and would be attributed to the next operation.
    fn clear_errors(&mut self) {
        self.flash.sr().write(|w| {
            w.pgserr().clear_bit_by_one();
            w.pgperr().clear_bit_by_one();
            w.pgaerr().clear_bit_by_one();
            w.wrperr().clear_bit_by_one();
            w.operr().clear_bit_by_one()
        });
    }

    /// The data cache may contain data from before an erase (RM0090, 3.5.2).
    fn reset_cache(&mut self) {
        self.flash.acr().modify(|_, w| w.dcen().clear_bit());
        self.flash.acr().modify(|_, w| w.dcrst().set_bit());
        self.flash.acr().modify(|_, w| w.dcrst().clear_bit());
        self.flash.acr().modify(|_, w| w.dcen().set_bit());
    }
}

impl ErrorType for InternalFlash {
    type Error = Error;
}

impl ReadNorFlash for InternalFlash {
    const READ_SIZE: usize = <UnlockedFlash<'static> as ReadNorFlash>::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        let start = offset as usize;
        let end = start.saturating_add(bytes.len());
        let held = FlashExt::read(&self.flash).get(start..end);
        let held = held.ok_or(Error::ProgrammingAlignment)?;
        for (byte, held) in bytes.iter_mut().zip(held) {
            *byte = *held;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        FlashExt::len(&self.flash)
    }
}

impl NorFlash for InternalFlash {
    const WRITE_SIZE: usize = <UnlockedFlash<'static> as NorFlash>::WRITE_SIZE;
    const ERASE_SIZE: usize = <UnlockedFlash<'static> as NorFlash>::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        self.clear_errors();
        let mut unlocked = self.flash.unlocked();
        let result = while_nothing_runs(|| NorFlash::erase(&mut unlocked, from, to));
        drop(unlocked);
        self.reset_cache();
        result
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        self.clear_errors();
        let result = NorFlash::write(&mut self.flash.unlocked(), offset, bytes);
        self.reset_cache();
        result
    }
}

impl TableFlash for InternalFlash {
    fn range(&self, slot: Slot) -> Range<u32> {
        let start = self.flash.address();
        let [first, end] = slots::addresses(slot).map(|address| (address - start) as u32);
        first..end
    }

    fn in_place(&self, slot: Slot, length: u32) -> Mapped {
        slots::bytes(slot, length as usize)
    }

    fn while_busy(&self) -> WhileBusy {
        WhileBusy::Standstill
    }
}

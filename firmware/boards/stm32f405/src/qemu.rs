//! Drivers for QEMU's `mps2-an386`: a Cortex-M4F with 4 MiB each of program and data memory.
//!
//! QEMU knows neither the flash controller nor the clock tree of the STM32F405, and the flash of
//! this board cannot be written. So the slots are a file of the computer that QEMU runs on, written
//! through semihosting and mirrored in memory: whoever kills QEMU cuts the power.

use core::convert::Infallible;
use core::ops::Range;

use embedded_hal::digital::{ErrorType as PinErrorType, InputPin, OutputPin};
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read,
    check_write,
};
use heapless::spsc::{Consumer, Queue};
use semihosting::fs::File;
use semihosting::io::{Read, Seek, SeekFrom, Write};
use trueaxis_firmware::controller::received;
use trueaxis_firmware::slots::{Slot, TableFlash, WhileBusy};
use trueaxis_firmware::temperature::{SensorError, Thermometer};

use crate::RATE;
use crate::bare::mirror::{LENGTH, Mirror};
use crate::bare::uart;

/// The file with the slots, in QEMU's working directory.
const FILE: &core::ffi::CStr = c"flash.bin";
/// Clock of SysTick, Hz.
pub const CLOCK: u32 = 25_000_000;
/// SysTick ticks per servo period.
pub const RELOAD: u32 = CLOCK / RATE;

/// A NOR flash with the block size of the STM32F405.
pub struct FileFlash {
    file: File,
    mirror: Mirror,
}

/// Why the file flash did not do what it was asked.
#[derive(Clone, Copy, Debug)]
pub enum FileError {
    /// The computer refuses.
    File,
    /// A place that does not exist, or is not aligned.
    Place(NorFlashErrorKind),
    /// A word that is not blank is written.
    NotBlank,
}

impl NorFlashError for FileError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Place(kind) => *kind,
            Self::File | Self::NotBlank => NorFlashErrorKind::Other,
        }
    }
}

impl FileFlash {
    /// Bytes of one write to the file while erasing, so that the power can go between them.
    const PIECE: usize = 4096;
    /// The same while programming: the STM32F405 programs 16 bytes between two looks at its state.
    const ROW: usize = 16;

    /// Opens the file, or makes one with blank slots.
    pub fn open(mirror: Mirror) -> Result<Self, FileError> {
        let mut options = File::options();
        options.read(true).write(true);
        let file = match options.open(FILE) {
            Ok(file) => file,
            Err(_) => {
                options.create(true).truncate(true);
                options.open(FILE).map_err(|_| FileError::File)?
            }
        };
        let mut flash = Self { file, mirror };
        flash.load()?;
        Ok(flash)
    }

    /// Fills the mirror from the file; what the file does not have is blank.
    fn load(&mut self) -> Result<(), FileError> {
        let mut piece = [0; Self::PIECE];
        self.file
            .seek(SeekFrom::Start(0))
            .map_err(|_| FileError::File)?;
        for at in (0..2 * LENGTH).step_by(Self::PIECE) {
            let mut have = 0;
            while have < piece.len() {
                match self.file.read(&mut piece[have..]) {
                    Ok(0) => break,
                    Ok(count) => have += count,
                    Err(_) => return Err(FileError::File),
                }
            }
            piece[have..].fill(0xFF);
            let (slot, offset) = place(at);
            self.mirror.write(slot, offset, &piece);
            if have < piece.len() {
                self.store(at, &piece)?;
            }
        }
        Ok(())
    }

    /// Writes to the file, then to the mirror.
    fn store(&mut self, at: usize, bytes: &[u8]) -> Result<(), FileError> {
        let file = &mut self.file;
        file.seek(SeekFrom::Start(at as u64))
            .map_err(|_| FileError::File)?;
        file.write_all(bytes).map_err(|_| FileError::File)?;
        let (slot, offset) = place(at);
        if self.mirror.write(slot, offset, bytes) {
            Ok(())
        } else {
            Err(FileError::Place(NorFlashErrorKind::OutOfBounds))
        }
    }

    fn held(&self, at: usize, length: usize) -> &[u8] {
        let (slot, offset) = place(at);
        self.mirror.bytes(slot, offset, length)
    }
}

/// Slot and place within it of an address of the driver.
fn place(at: usize) -> (Slot, usize) {
    if at < LENGTH {
        (Slot::A, at)
    } else {
        (Slot::B, at - LENGTH)
    }
}

impl ErrorType for FileFlash {
    type Error = FileError;
}

impl ReadNorFlash for FileFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FileError> {
        check_read(self, offset, bytes.len()).map_err(FileError::Place)?;
        let held = self.held(offset as usize, bytes.len());
        if held.len() != bytes.len() {
            // Of both slots.
            return Err(FileError::Place(NorFlashErrorKind::OutOfBounds));
        }
        bytes.copy_from_slice(held);
        Ok(())
    }

    fn capacity(&self) -> usize {
        2 * LENGTH
    }
}

impl NorFlash for FileFlash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = 128 * 1024;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FileError> {
        check_erase(self, from, to).map_err(FileError::Place)?;
        for at in (from as usize..to as usize).step_by(Self::PIECE) {
            self.store(at, &[0xFF; Self::PIECE])?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FileError> {
        check_write(self, offset, bytes.len()).map_err(FileError::Place)?;
        for (number, row) in bytes.chunks(Self::ROW).enumerate() {
            let at = offset as usize + number * Self::ROW;
            if self.held(at, row.len()).iter().any(|byte| *byte != 0xFF) {
                return Err(FileError::NotBlank);
            }
            self.store(at, row)?;
        }
        Ok(())
    }
}

impl TableFlash for FileFlash {
    fn range(&self, slot: Slot) -> Range<u32> {
        let start = (slot.index() * LENGTH) as u32;
        start..start + LENGTH as u32
    }

    fn in_place(&self, slot: Slot, length: u32) -> &'static [u8] {
        self.mirror.bytes(slot, 0, length as usize)
    }

    /// As on the STM32F405, so that the same is tried here.
    fn while_busy(&self) -> WhileBusy {
        WhileBusy::Standstill
    }
}

/// The serial line: `-serial` of QEMU. Received in an interrupt: a loop that looks at the registers
/// would keep QEMU from its other work.
pub struct Uart {
    bytes: Consumer<'static, u8>,
}

impl Uart {
    /// Enables it; `queue` is between the interrupt and the link.
    pub fn start<const N: usize>(queue: &'static mut Queue<u8, N>) -> Self {
        let (producer, bytes) = queue.split();
        uart::start(producer);
        Self { bytes }
    }
}

impl embedded_io::ErrorType for Uart {
    type Error = Infallible;
}

impl embedded_io::Read for Uart {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        Ok(received(&mut self.bytes, buffer, cortex_m::asm::wfi))
    }
}

impl embedded_io::ReadReady for Uart {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(self.bytes.ready())
    }
}

impl embedded_io::Write for Uart {
    fn write(&mut self, buffer: &[u8]) -> Result<usize, Infallible> {
        let Some(byte) = buffer.first() else {
            return Ok(0);
        };
        while !uart::writable() {}
        uart::send(*byte);
        Ok(1)
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        while !uart::writable() {}
        Ok(())
    }
}

/// A pin that leads nowhere and reads high: of this machine the drives are always off.
pub struct NoPin;

impl PinErrorType for NoPin {
    type Error = Infallible;
}

impl OutputPin for NoPin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl InputPin for NoPin {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(true)
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(false)
    }
}

/// There are no sensors.
pub enum NoSensor {}

impl Thermometer for NoSensor {
    fn celsius(&mut self) -> Result<Option<f32>, SensorError> {
        match *self {}
    }
}

//! The slots in a file on the host of QEMU, written through semihosting.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read,
    check_write,
};
use semihosting::fs::File;
use semihosting::io::{Read, Seek, SeekFrom, Write};

/// The file, in QEMU's working directory.
const FILE: &core::ffi::CStr = c"flash.bin";
/// Length of a slot in bytes.
pub const SLOT: usize = 256 * 1024;

/// Bytes per write to the file while erasing, so that power can be lost in between.
const PIECE: usize = 4096;

/// A NOR flash with blocks of 128 KiB, as in the STM32F405 and STM32H743; a word has `WRITE` bytes.
pub struct FileFlash<const WRITE: usize> {
    file: File,
}

/// Why an operation of the file flash failed.
#[derive(Clone, Copy, Debug)]
pub enum FileError {
    /// The host refused the file operation.
    File,
    /// An address that is out of range or misaligned.
    Place(NorFlashErrorKind),
    /// A write to a word that is not blank.
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

impl<const WRITE: usize> FileFlash<WRITE> {
    /// Bytes per write while programming: a real flash programs a few bytes between two polls of its status.
    const ROW: usize = if WRITE > 16 { WRITE } else { 16 };

    /// Opens or creates the file; missing bytes are blank.
    pub fn open() -> Result<Self, FileError> {
        let mut options = File::options();
        options.read(true).write(true);
        let file = match options.open(FILE) {
            Ok(file) => file,
            Err(_) => {
                options.create(true).truncate(true);
                options.open(FILE).map_err(|_| FileError::File)?
            }
        };
        let mut flash = Self { file };
        let held = flash.file.seek(SeekFrom::End(0));
        let held = held.map_err(|_| FileError::File)? as usize;
        let mut at = held;
        while at < 2 * SLOT {
            let end = (2 * SLOT).min(at + PIECE);
            flash.store(at, &[0xFF; PIECE][..end - at])?;
            at = end;
        }
        Ok(flash)
    }

    fn store(&mut self, at: usize, bytes: &[u8]) -> Result<(), FileError> {
        self.seek(at)?;
        self.file.write_all(bytes).map_err(|_| FileError::File)
    }

    fn seek(&mut self, at: usize) -> Result<(), FileError> {
        let place = self.file.seek(SeekFrom::Start(at as u64));
        place.map(drop).map_err(|_| FileError::File)
    }
}

impl<const WRITE: usize> ErrorType for FileFlash<WRITE> {
    type Error = FileError;
}

impl<const WRITE: usize> ReadNorFlash for FileFlash<WRITE> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FileError> {
        check_read(self, offset, bytes.len()).map_err(FileError::Place)?;
        self.seek(offset as usize)?;
        self.file.read_exact(bytes).map_err(|_| FileError::File)
    }

    fn capacity(&self) -> usize {
        2 * SLOT
    }
}

impl<const WRITE: usize> NorFlash for FileFlash<WRITE> {
    const WRITE_SIZE: usize = WRITE;
    const ERASE_SIZE: usize = 128 * 1024;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FileError> {
        check_erase(self, from, to).map_err(FileError::Place)?;
        for at in (from as usize..to as usize).step_by(PIECE) {
            self.store(at, &[0xFF; PIECE])?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FileError> {
        check_write(self, offset, bytes.len()).map_err(FileError::Place)?;
        for (number, row) in bytes.chunks(Self::ROW).enumerate() {
            let at = offset as usize + number * Self::ROW;
            let mut held = [0; 32];
            let held = held.get_mut(..row.len()).ok_or(FileError::File)?;
            self.read(at as u32, held)?;
            if held.iter().any(|byte| *byte != 0xFF) {
                return Err(FileError::NotBlank);
            }
            self.store(at, row)?;
        }
        Ok(())
    }
}

//! Counts the starts of the emulated board in a file next to the one for its flash, because QEMU has no source of
//! random numbers.

use semihosting::fs::File;
use semihosting::io::{Read, Seek, SeekFrom, Write};
use trueaxis_firmware::link::BootNonce;

/// The file, in QEMU's working directory.
const FILE: &core::ffi::CStr = c"starts.bin";

/// Counts starts.
pub struct Starts;

impl BootNonce for Starts {
    fn boot_nonce(&mut self) -> Option<u64> {
        let mut options = File::options();
        options.read(true).write(true);
        let mut count = [0; 8];
        let mut file = match options.open(FILE) {
            Ok(mut file) => {
                file.read_exact(&mut count).ok()?;
                file
            }
            Err(_) => {
                options.create(true).truncate(true);
                options.open(FILE).ok()?
            }
        };
        let next = u64::from_le_bytes(count).wrapping_add(1);
        file.seek(SeekFrom::Start(0)).ok()?;
        file.write_all(&next.to_le_bytes()).ok()?;
        Some(next)
    }
}

//! The bytes of a blob in memory.

use alloc::vec;
use alloc::vec::Vec;
use core::fmt;
use core::ops::Deref;

use crate::format::ALIGNMENT;

/// The bytes of a blob, aligned to 32 bytes as in flash.
pub struct AlignedBlob {
    bytes: Vec<u8>,
    start: usize,
    length: usize,
}

impl AlignedBlob {
    /// Copies `blob`, which may have any alignment, for example when read from a file.
    #[must_use]
    pub fn from_bytes(blob: &[u8]) -> Self {
        let mut bytes = vec![0; blob.len() + ALIGNMENT];
        // The heap block does not move while `bytes` keeps its length.
        let address = bytes.as_ptr() as usize;
        let start = address.next_multiple_of(ALIGNMENT) - address;
        bytes[start..start + blob.len()].copy_from_slice(blob);
        Self {
            bytes,
            start,
            length: blob.len(),
        }
    }
}

impl Deref for AlignedBlob {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.bytes[self.start..self.start + self.length]
    }
}

impl Clone for AlignedBlob {
    fn clone(&self) -> Self {
        Self::from_bytes(self)
    }
}

impl PartialEq for AlignedBlob {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl fmt::Debug for AlignedBlob {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "AlignedBlob({} bytes)", self.length)
    }
}

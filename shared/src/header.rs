//! The 16 fixed bytes at the start of a blob, and its checksum.

use crate::checksum::Checksum;
use crate::format::{HEADER, LARGEST_BLOB, MAGIC, VERSION};
use crate::load_error::LoadError;
use crate::work;

/// CRC-32 over everything but the CRC field itself: bytes 0…11 and from 16 to the end.
///
/// `blob` has at least [`HEADER`] bytes.
pub(crate) fn checksum(blob: &[u8]) -> u32 {
    work::count(blob.len());
    let mut digest = Checksum::new();
    digest.add(&blob[..12]);
    digest.add(&blob[HEADER..]);
    digest.value()
}

/// Contents of the fixed bytes at the start of a blob.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Header {
    /// Length of the whole blob in bytes, including the header.
    pub length: u32,
    /// CRC-32 over everything but this field; together with the length it identifies a blob.
    pub crc: u32,
}

impl Header {
    /// Reads the header at the start of `bytes` and ignores what follows.
    ///
    /// The magic and the version are checked first, before anything that a later version may change.
    ///
    /// # Errors
    /// [`LoadError::NoHeader`], [`LoadError::BadMagic`], [`LoadError::UnknownVersion`],
    /// [`LoadError::TooLong`].
    pub fn read(bytes: &[u8]) -> Result<Self, LoadError> {
        let Some((header, _)) = bytes.split_first_chunk::<HEADER>() else {
            return Err(LoadError::NoHeader);
        };
        if header[..4] != MAGIC {
            return Err(LoadError::BadMagic);
        }
        let version = u16::from_le_bytes([header[4], header[5]]);
        if version != VERSION {
            return Err(LoadError::UnknownVersion { found: version });
        }
        let length = u32::from_le_bytes([header[8], header[9], header[10], header[11]]);
        if length > LARGEST_BLOB as u32 {
            return Err(LoadError::TooLong { stated: length });
        }
        Ok(Self {
            length,
            crc: u32::from_le_bytes([header[12], header[13], header[14], header[15]]),
        })
    }

    /// Checks header, length and checksum of the blob at the start of `held` bytes that are read in pieces. `read` gets
    /// an offset, a multiple of 32, and fills in the 32 bytes from there, or however many are left. Pieces beyond the
    /// stated length are not read. The description and the samples are not examined.
    ///
    /// The inner error is one of those of [`read`](Self::read), [`LoadError::WrongLength`] or
    /// [`LoadError::BadChecksum`].
    ///
    /// # Errors
    /// The first error returned by `read`.
    pub fn check_pieces<E>(
        held: u32,
        mut read: impl FnMut(u32, &mut [u8]) -> Result<(), E>,
    ) -> Result<Result<Self, LoadError>, E> {
        const PIECE: u32 = 32;
        let mut piece = [0; PIECE as usize];
        let size = |at: u32| (held - at).min(PIECE) as usize;
        read(0, &mut piece[..size(0)])?;
        let header = match Self::read(&piece[..size(0)]) {
            Ok(header) => header,
            Err(error) => return Ok(Err(error)),
        };
        let stated = header.length;
        if (stated as usize) < HEADER || stated > held {
            return Ok(Err(LoadError::WrongLength { stated, held }));
        }
        let mut digest = Checksum::new();
        digest.add(&piece[..12]);
        digest.add(&piece[HEADER..stated.min(PIECE) as usize]);
        for at in (PIECE..stated).step_by(PIECE as usize) {
            read(at, &mut piece[..size(at)])?;
            digest.add(&piece[..(stated - at).min(PIECE) as usize]);
        }
        Ok(if digest.value() == header.crc {
            Ok(header)
        } else {
            Err(LoadError::BadChecksum)
        })
    }
}

/// Whether bytes beyond the stated length are permitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Held {
    /// A file: exactly the stated length.
    Exactly,
    /// A flash slot: at least the stated length.
    AtLeast,
}

/// Length of the notes stated in a header.
pub(crate) fn noted(blob: &[u8]) -> u16 {
    u16::from_le_bytes([blob[6], blob[7]])
}

/// Checks header, length and checksum; returns the blob without the bytes after it.
pub(crate) fn open(bytes: &[u8], held: Held) -> Result<&[u8], LoadError> {
    let header = Header::read(bytes)?;
    let wrong = LoadError::WrongLength {
        stated: header.length,
        held: u32::try_from(bytes.len()).unwrap_or(u32::MAX),
    };
    let length = usize::try_from(header.length).map_err(|_| wrong)?;
    if length < HEADER || (held == Held::Exactly && length != bytes.len()) {
        return Err(wrong);
    }
    let blob = bytes.get(..length).ok_or(wrong)?;
    if header.crc != checksum(blob) {
        return Err(LoadError::BadChecksum);
    }
    Ok(blob)
}

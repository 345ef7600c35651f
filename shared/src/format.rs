//! The constants of the format, which is specified in `docs/src/format.md`.

/// Magic bytes at the start of every blob.
pub const MAGIC: [u8; 4] = *b"TRAX";
/// The format version that this build reads and writes.
pub const VERSION: u16 = 1;
/// Length of the header in bytes.
pub const HEADER: usize = 16;
/// Maximum length of a blob, including the header: 64 MiB.
pub const LARGEST_BLOB: usize = 64 * 1024 * 1024;
/// The samples start at a multiple of this many bytes.
pub const ALIGNMENT: usize = 32;

//! The fixed numbers of the format, which is specified in `docs/src/format.md`.

/// First four bytes of every blob.
pub const MAGIC: [u8; 4] = *b"TRAX";
/// The format version that this build reads and writes.
pub const VERSION: u16 = 1;
/// Bytes of the header.
pub const HEADER: usize = 16;
/// Most bytes of a blob, header included: 64 MiB.
pub const LARGEST_BLOB: usize = 64 * 1024 * 1024;
/// The samples start at a multiple of this many bytes.
pub const ALIGNMENT: usize = 32;

//! Blobs that are part of the program.

/// Bytes that start at a multiple of 32, as blobs do.
#[doc(hidden)]
#[repr(C, align(32))]
pub struct Aligned<B: ?Sized>(pub B);

/// The bytes of a blob (`.trax`) that becomes part of the program, aligned as
/// [`Compensation::load`](crate::Compensation::load) needs them: a `&'static [u8]`.
///
/// The path is relative to the file in which it stands, as for [`include_bytes!`].
///
/// ```
/// use trueaxis::include_blob;
///
/// static BLOB: &[u8] =
///     include_blob!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/huron-13.trax"));
/// assert!(BLOB.as_ptr().addr().is_multiple_of(trueaxis::ALIGNMENT));
/// ```
#[macro_export]
macro_rules! include_blob {
    ($file:expr $(,)?) => {{
        static BLOB: &$crate::Aligned<[u8]> = &$crate::Aligned(*include_bytes!($file));
        &BLOB.0
    }};
}

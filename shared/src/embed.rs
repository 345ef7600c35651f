//! Blobs embedded in the program.

/// Bytes aligned to 32, as blobs require.
#[doc(hidden)]
#[repr(C, align(32))]
pub struct Aligned<B: ?Sized>(pub B);

/// The bytes of a blob (`.trax`) embedded in the program as a `&'static [u8]`, aligned as
/// [`Compensation::load`](crate::Compensation::load) requires.
///
/// The path is relative to the source file that contains the call, as for [`include_bytes!`].
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

//! What a servo holds its compensations by.

use crate::compensation::Compensation;
use crate::room::Room;

/// A hold on a compensation: a reference (`&Compensation`, `&'static mut Compensation`), a `Box` or
/// an `Arc` (feature `encode`, which brings a heap), a compensation itself, or a type of one's own, such as
/// the lease of a pool.
///
/// It must always lead to the same compensation, and to the same contents.
pub trait Handle {
    /// What the compensation has room for.
    type Room: Room;

    /// The compensation.
    fn get(&self) -> &Compensation<'_, Self::Room>;
}

impl<C: Room> Handle for Compensation<'_, C> {
    type Room = C;

    #[inline(always)]
    fn get(&self) -> &Compensation<'_, C> {
        self
    }
}

macro_rules! through {
    ($($pointer:ty)*) => {$(
        impl<H: Handle> Handle for $pointer {
            type Room = H::Room;

            #[inline(always)]
            fn get(&self) -> &Compensation<'_, H::Room> {
                (**self).get()
            }
        }
    )*}
}

through!(&H &mut H);
#[cfg(feature = "encode")]
through!(alloc::boxed::Box<H> alloc::sync::Arc<H>);

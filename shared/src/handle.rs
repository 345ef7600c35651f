//! How a servo holds its compensations.

use crate::compensation::Compensation;
use crate::room::Room;

/// A pointer to a compensation: a reference (`&Compensation`, `&'static mut Compensation`), a `Box` or an `Arc`
/// (feature `encode`, which needs a heap), a compensation itself, or a custom type, such as the lease of a pool.
///
/// It must always return the same compensation, with unchanged contents.
pub trait Handle {
    /// Capacities of the compensation.
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

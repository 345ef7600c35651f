//! What a servo holds tables by.

use crate::code::Code;
use crate::{Room, Tables};
use core::ptr::NonNull;
use trueaxis::{Compensation, Handle};

/// A hold on tables: nobody loads into them until it is dropped.
pub struct Held(NonNull<Tables>);

impl Held {
    /// Takes hold of tables that are loaded and that no servo holds.
    ///
    /// # Safety
    /// Null, or memory for them, which stays as long as this.
    pub(super) unsafe fn new(pointer: *mut Tables) -> Result<Self, Code> {
        // SAFETY: as the caller promises.
        unsafe { super::tables(pointer) }?.hold()?;
        // The pointer as it was given: whoever gets it back may load through it.
        NonNull::new(pointer).map(Self).ok_or(Code::NullPointer)
    }

    /// A second hold on tables that the servo holds, not to be dropped.
    pub(super) fn again(&self) -> core::mem::ManuallyDrop<Self> {
        core::mem::ManuallyDrop::new(Self(self.0))
    }

    /// Where they are.
    pub(super) fn pointer(&self) -> *mut Tables {
        self.0.as_ptr()
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        // SAFETY: as in `get`.
        unsafe { self.0.as_ref() }.release();
    }
}

impl Handle for Held {
    type Room = Room;

    #[inline(always)]
    fn get(&self) -> &Compensation<'_, Room> {
        // SAFETY: whoever made this promised that they stay there, and nobody writes to tables that
        // are held.
        unsafe { self.0.as_ref() }.held()
    }
}

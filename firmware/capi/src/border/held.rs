//! A servo's hold on tables.

use crate::code::Code;
use crate::{Room, Tables};
use core::ptr::NonNull;
use trueaxis::{Compensation, Handle};

/// A hold on tables: they cannot be loaded until it is dropped.
pub struct Held(NonNull<Tables>);

impl Held {
    /// Takes hold of tables that are loaded and that no servo holds.
    ///
    /// # Safety
    /// Null, or memory for tables that outlives this.
    pub(super) unsafe fn new(pointer: *mut Tables) -> Result<Self, Code> {
        // SAFETY: guaranteed by the caller.
        unsafe { super::tables(pointer) }?.hold()?;
        // The original pointer: the caller may load through it once it is returned.
        NonNull::new(pointer).map(Self).ok_or(Code::NullPointer)
    }

    /// A second hold on tables that the servo holds; must not be dropped.
    pub(super) fn again(&self) -> core::mem::ManuallyDrop<Self> {
        core::mem::ManuallyDrop::new(Self(self.0))
    }

    /// Address of the tables.
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
        // SAFETY: the creator guaranteed that they stay there, and held tables are never written.
        unsafe { self.0.as_ref() }.held()
    }
}

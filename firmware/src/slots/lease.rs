//! Bytes of a slot in place, and how long they may be read. The only file of `slots` with `unsafe`.
//!
//! Flash that is read in place changes when it is erased or programmed. So its bytes are either borrowed from the
//! driver, which must be borrowed mutably for such changes ([`TableFlash::read_in_place`]), or leased from [`Slots`],
//! which begins no upload into a slot before all its leases have been returned.
#![allow(unsafe_code)]

use super::{Slot, SlotState, Slots, TableFlash};

/// Memory in which a flash is read, for [`TableFlash::in_place`].
#[derive(Clone, Copy, Debug)]
pub struct Mapped(*const [u8]);

impl Mapped {
    /// Memory in which a flash is read, starting at `start`.
    ///
    /// # Safety
    /// These bytes must be readable for as long as the program runs. They may change only through `erase` and `write`
    /// of the one driver whose [`TableFlash::in_place`] returns this, which take it mutably.
    #[must_use]
    pub const unsafe fn new(start: *const u8, length: usize) -> Self {
        Self(core::ptr::slice_from_raw_parts(start, length))
    }

    /// Memory that never changes.
    #[must_use]
    pub const fn constant(bytes: &'static [u8]) -> Self {
        Self(bytes)
    }

    /// The bytes, for as long as the driver is borrowed.
    pub(super) fn borrowed<F: ?Sized>(self, _driver: &F) -> &[u8] {
        // SAFETY: `new` guarantees bytes that can be read and change only through the driver, mutably; the driver is
        // borrowed for as long as they are. The only caller, `read_in_place`, passes the driver that returned this.
        unsafe { &*self.0 }
    }
}

/// A blob in place, which its slot keeps until the lease is [taken back](Slots::take_back).
///
/// A dropped lease is never returned: its slot accepts no upload before the next start.
#[derive(Debug)]
#[must_use = "its slot takes no upload before it is taken back"]
pub struct Lease(&'static [u8]);

impl Lease {
    /// The blob.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        self.0
    }

    /// The leased bytes, with a lifetime that the caller must manage.
    ///
    /// # Safety
    /// These bytes must not be read once the lease has been given away.
    pub(crate) unsafe fn kept(&self) -> &'static [u8] {
        self.0
    }
}

/// Bytes that never change; nothing waits for their return.
impl From<&'static [u8]> for Lease {
    fn from(bytes: &'static [u8]) -> Self {
        Self(bytes)
    }
}

impl<F: TableFlash> Slots<F> {
    /// The blob of a valid slot, in place. Loading checks it again.
    ///
    /// While it is borrowed nothing is erased or programmed:
    ///
    /// ```compile_fail,E0502
    /// use trueaxis_firmware::slots::{Slot, Slots, TableFlash};
    ///
    /// fn erased_while_borrowed<F: TableFlash>(slots: &mut Slots<F>) {
    ///     let blob = slots.blob(Slot::A);
    ///     let _ = slots.erase_step();
    ///     drop(blob);
    /// }
    /// ```
    #[must_use]
    pub fn blob(&self, slot: Slot) -> Option<&[u8]> {
        match self.state(slot) {
            SlotState::Valid { length, .. } => Some(self.flash.read_in_place(slot, length)),
            _ => None,
        }
    }

    /// The blob of a valid slot, with a lease. Until it is [taken back](Self::take_back), no upload into this slot
    /// begins, and the blob does not change; choices are written after it.
    pub fn lease(&mut self, slot: Slot) -> Option<Lease> {
        let SlotState::Valid { length, .. } = self.state(slot) else {
            return None;
        };
        let count = &mut self.leases[slot.index()];
        *count = count.checked_add(1)?;
        // SAFETY: `Mapped` guarantees bytes that can be read and change only through the driver, which `self` owns and
        // gives away only where it reads a copy. `self` erases and programs bytes of a blob only in an upload into its
        // slot. No upload is in progress, since the slot is valid, and none begins while the slot is leased
        // (`beginning`).
        let bytes = unsafe { &*self.flash.in_place(slot, length).0 };
        Some(Lease(bytes))
    }

    /// Ends a lease; a lease of other slots is ignored.
    pub fn take_back(&mut self, lease: Lease) {
        let start = lease.0.as_ptr();
        for slot in Slot::BOTH {
            let count = &mut self.leases[slot.index()];
            if core::ptr::addr_eq(self.flash.in_place(slot, 1).0, start) && *count > 0 {
                *count -= 1;
                return;
            }
        }
    }

    /// Whether the blob of a slot is leased.
    pub(super) fn is_leased(&self, slot: Slot) -> bool {
        self.leases[slot.index()] > 0
    }
}

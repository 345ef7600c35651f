//! Two buffers for compensations: one that the servo reads, one to load into.
//!
//! A servo that runs in an interrupt needs a compensation that lives for ever; the next one must be
//! loaded without stopping it, so there are two, and what was read before is loaded into again. The main
//! loop reads the one in use too, at the same time as the servo: so the servo cannot own it (then
//! [`Servo::take_retired`] alone would do, without `unsafe`), and without a heap nobody counts who reads
//! it. The rules that make this sound are held by the types that come from one [`DoubleBuffer::split`]:
//!
//! 1. [`Loader`] alone writes, with `&mut self`, and only into a buffer that is not held.
//! 2. The servo of [`BufferedServo`] alone holds buffers, each by a `Held`, which marks its buffer for as
//!    long as there is one.
//! 3. A buffer goes from the loader to the servo only as [`Loaded`], which borrows the loader
//!    mutably: while there is one, nothing is loaded.
//! 4. Everybody else reads through a borrow of `Loader` or `BufferedServo`, which ends before they write.
//!
//! So a buffer is written only while no reference to it exists. The samples lie in flash: a buffer keeps
//! the [`Lease`] of their slot for as long as it keeps the compensation, and [`Loader::vacate`] gives it
//! back.
#![allow(unsafe_code)]

#[cfg(test)]
mod tests;

use core::cell::UnsafeCell;
use core::fmt;
use core::marker::PhantomData;
use core::sync::atomic::{AtomicBool, Ordering};

use crate::slots::Lease;
use trueaxis::{
    Compensation, Correction, Handle, Inputs, LoadError, Refused, Room, Servo, Usual, WeightError,
};

/// Two compensations in static memory, empty at first: all zeros, which take no flash.
pub struct DoubleBuffer<C: Room = Usual> {
    both: [Buffer<C>; 2],
    taken: AtomicBool,
}

/// One of the two.
struct Buffer<C: Room> {
    cell: UnsafeCell<Content<C>>,
    /// By the servo. Written by `Held` only.
    held: AtomicBool,
}

/// A compensation, with the lease of the bytes that it reads.
struct Content<C: Room> {
    compensation: Compensation<'static, C>,
    lease: Option<Lease>,
}

// SAFETY: the cell is written only by the one `Loader`, and only while no reference into it
// exists (the rules at the head of this file); otherwise it is shared for reading, which a
// `Compensation` allows: it is plain data. The mark is atomic.
unsafe impl<C: Room> Sync for Buffer<C> {}

impl<C: Room> Buffer<C> {
    const fn new() -> Self {
        Self {
            cell: UnsafeCell::new(Content {
                compensation: Compensation::empty(),
                lease: None,
            }),
            held: AtomicBool::new(false),
        }
    }

    /// Private: whoever calls it keeps the rules at the head of this file.
    fn read(&self) -> &Compensation<'static, C> {
        // SAFETY: it is called from `Loaded` and `Loader`, whose borrows keep the one writer from
        // writing; and from `Held`, whose mark keeps the writer off. So no `&mut` exists while the
        // reference lives.
        unsafe { &(*self.cell.get()).compensation }
    }
}

/// What the servo holds a buffer by.
struct Held<C: Room>(&'static Buffer<C>);

impl<C: Room> Held<C> {
    /// Marks a buffer that is [`Loaded`], or that nobody can have written yet.
    fn new(buffer: &'static Buffer<C>) -> Self {
        buffer.held.store(true, Ordering::Release);
        Self(buffer)
    }
}

impl<C: Room> Handle for Held<C> {
    type Room = C;

    #[inline(always)]
    fn get(&self) -> &Compensation<'_, C> {
        self.0.read()
    }
}

/// The servo reads it no more: what it has read comes before this.
impl<C: Room> Drop for Held<C> {
    fn drop(&mut self) {
        self.0.held.store(false, Ordering::Release);
    }
}

/// Why no compensation was loaded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NotLoaded {
    /// The servo holds both buffers: a change is under way.
    Busy,
    /// The blob is refused.
    Refused(LoadError),
}

impl fmt::Display for NotLoaded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Busy => f.write_str("the previous change of compensation is not finished"),
            Self::Refused(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for NotLoaded {}

impl<C: Room> Default for DoubleBuffer<C> {
    fn default() -> Self {
        Self::new()
    }
}

impl<C: Room> DoubleBuffer<C> {
    /// Both empty; for a `static`.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            both: [const { Buffer::new() }; 2],
            taken: AtomicBool::new(false),
        }
    }

    /// The two sides, the first time it is called.
    pub fn split(&'static self) -> Option<(Loader<C>, BufferedServo<C>)> {
        if self.taken.swap(true, Ordering::AcqRel) {
            return None;
        }
        let [first, _] = &self.both;
        let servo = BufferedServo {
            buffers: self,
            servo: Servo::new(Held::new(first)),
            changing: false,
        };
        Some((Loader { buffers: self }, servo))
    }

    /// Takes both sides back, which ends the servo; both buffers are empty, and can be split again. Leases
    /// are dropped. False if the sides are of other buffers: those stay split for ever.
    pub fn unite(&'static self, mut loader: Loader<C>, servo: BufferedServo<C>) -> bool {
        let ours = core::ptr::eq(self, loader.buffers) && core::ptr::eq(self, servo.buffers);
        // It holds no buffer any more.
        drop(servo);
        if ours {
            for buffer in &self.both {
                let _ = loader.empty(buffer);
            }
            self.taken.store(false, Ordering::Release);
        }
        ours
    }

    /// The buffer beside this one.
    fn other(&self, buffer: &Buffer<C>) -> &Buffer<C> {
        let [first, second] = &self.both;
        if core::ptr::eq(first, buffer) {
            second
        } else {
            first
        }
    }
}

/// The side that loads: that of the main loop.
pub struct Loader<C: Room> {
    buffers: &'static DoubleBuffer<C>,
}

impl<C: Room> Loader<C> {
    /// Loads a blob into the vacant buffer, which is to be [vacated](Self::vacate) before: a lease that is
    /// still there is dropped. Bytes after the blob are ignored.
    ///
    /// # Errors
    /// [`NotLoaded`]. The lease of a blob that is refused comes back with the next `vacate`.
    pub fn load(&mut self, blob: impl Into<Lease>) -> Result<Loaded<'_, C>, NotLoaded> {
        let buffer = self.vacant().ok_or(NotLoaded::Busy)?;
        let content = self.write(buffer);
        let lease = content.lease.insert(blob.into());
        // SAFETY: the compensation is emptied, or loaded with another lease, before this one leaves the
        // buffer; it is seen only with the lifetimes of borrows.
        let bytes = unsafe { lease.kept() };
        let loaded = content.compensation.load_slot(bytes);
        loaded.map_err(NotLoaded::Refused)?;
        Ok(Loaded {
            buffers: self.buffers,
            buffer,
            loader: PhantomData,
        })
    }

    /// Loads a blob into the vacant buffer, has a look at the compensation in use and at this one, and
    /// empties the buffer.
    ///
    /// # Errors
    /// [`NotLoaded`]
    pub fn try_on<R>(
        &mut self,
        blob: &[u8],
        look: impl FnOnce(&Compensation<'_, C>, &Compensation<'_, C>) -> R,
    ) -> Result<R, NotLoaded> {
        /// Empties a compensation, whatever happens before.
        struct Emptied<'c, C: Room>(&'c mut Compensation<'static, C>);
        impl<C: Room> Drop for Emptied<'_, C> {
            fn drop(&mut self) {
                // No bytes are no blob: refused, and emptied thereby.
                let _ = self.0.load_slot(&[]);
            }
        }
        let buffer = self.vacant().ok_or(NotLoaded::Busy)?;
        let active = self.buffers.other(buffer);
        // SAFETY: the compensation is emptied before this returns or unwinds, so it does not outlive
        // `blob`. Nobody else can read the buffer meanwhile: it is not held, and `self` is borrowed. `look`
        // sees it with a lifetime of its own, and can keep nothing of it.
        let blob: &'static [u8] = unsafe { &*core::ptr::from_ref(blob) };
        let new = Emptied(&mut self.write(buffer).compensation);
        new.0.load_slot(blob).map_err(NotLoaded::Refused)?;
        Ok(look(active.read(), new.0))
    }

    /// Empties the vacant buffer, so that no buffer refers to any slot but the active one, and returns the
    /// lease that was there.
    ///
    /// # Errors
    /// [`NotLoaded::Busy`]: the servo holds both.
    pub fn vacate(&mut self) -> Result<Option<Lease>, NotLoaded> {
        let buffer = self.vacant().ok_or(NotLoaded::Busy)?;
        Ok(self.empty(buffer))
    }

    /// The compensation that the servo uses; during a change the old one or the new one.
    #[must_use]
    pub fn current(&self) -> &Compensation<'_, C> {
        let [first, second] = &self.buffers.both;
        let held = first.held.load(Ordering::Acquire);
        if held { first.read() } else { second.read() }
    }

    /// A buffer that the servo does not hold. Only [`BufferedServo`] makes it hold one, and only one
    /// that is `Loaded`, which cannot exist here: this borrows the loader too. So it stays vacant.
    fn vacant(&self) -> Option<&'static Buffer<C>> {
        let held = |buffer: &&Buffer<C>| buffer.held.load(Ordering::Acquire);
        self.buffers.both.iter().find(|buffer| !held(buffer))
    }

    /// Empties a buffer of these that is [`vacant`](Self::vacant).
    fn empty(&mut self, buffer: &Buffer<C>) -> Option<Lease> {
        let content = self.write(buffer);
        // No bytes are no blob: refused, and emptied thereby.
        let _ = content.compensation.load_slot(&[]);
        content.lease.take()
    }

    /// Write access to a buffer of these that is [`vacant`](Self::vacant).
    fn write<'w>(&'w mut self, buffer: &'w Buffer<C>) -> &'w mut Content<C> {
        // SAFETY: the buffer is not held, so the servo has no reference to it; those of `Loaded` and
        // `current` are borrows of `self`, which is borrowed mutably. There is one `Loader` for
        // these buffers. The acquiring load in `vacant` comes after the servo's last reading, which
        // the releasing store of `Held` follows.
        unsafe { &mut *buffer.cell.get() }
    }
}

/// A compensation that is loaded and can be given to the servo.
pub struct Loaded<'l, C: Room> {
    buffers: &'static DoubleBuffer<C>,
    buffer: &'static Buffer<C>,
    loader: PhantomData<&'l mut ()>,
}

impl<C: Room> Loaded<'_, C> {
    /// What is loaded.
    #[must_use]
    pub fn compensation(&self) -> &Compensation<'_, C> {
        self.buffer.read()
    }

    /// What the servo uses.
    #[must_use]
    pub fn active(&self) -> &Compensation<'_, C> {
        self.buffers.other(self.buffer).read()
    }
}

/// The servo with the buffers it reads: the side of the interrupt.
pub struct BufferedServo<C: Room> {
    buffers: &'static DoubleBuffer<C>,
    servo: Servo<Held<C>>,
    /// Another compensation is being faded in.
    changing: bool,
}

impl<C: Room> BufferedServo<C> {
    /// See [`Servo::update`].
    pub fn update(
        &mut self,
        inputs: &Inputs<C::Axes<f32>>,
        referenced: u16,
        dt: f32,
    ) -> Correction<C::Axes<f32>> {
        let correction = self.servo.update(inputs, referenced, dt);
        if self.changing && !self.servo.is_swapping() {
            // With this the servo holds only `compensation()`, and that is the new one.
            drop(self.servo.take_retired());
            self.changing = false;
        }
        correction
    }

    /// See [`Servo::swap`].
    ///
    /// # Errors
    /// [`Refused`]; nothing changes.
    pub fn swap(&mut self, loaded: Loaded<'_, C>) -> Result<(), Refused> {
        if self.changing || !core::ptr::eq(self.buffers, loaded.buffers) {
            return Err(Refused::Busy);
        }
        // What comes back is held no more.
        match self.servo.swap(Held::new(loaded.buffer)) {
            Ok(_) => {
                self.changing = true;
                Ok(())
            }
            Err(refused) => Err(refused.why),
        }
    }

    /// Starts a new servo with a compensation that may have other axes: disabled, zero, directions
    /// of travel unknown. To be called only while all corrections are zero, or they jump there.
    ///
    /// # Errors
    /// [`Refused::Busy`] while a change is under way.
    pub fn replace(&mut self, loaded: Loaded<'_, C>) -> Result<(), Refused> {
        if self.changing || !core::ptr::eq(self.buffers, loaded.buffers) {
            return Err(Refused::Busy);
        }
        // The old servo goes, and holds its buffer no more.
        self.servo = Servo::new(Held::new(loaded.buffer));
        Ok(())
    }

    /// See [`Servo::enable`] and [`Servo::disable`].
    pub fn enable(&mut self, on: bool) {
        if on {
            self.servo.enable();
        } else {
            self.servo.disable();
        }
    }

    /// See [`Servo::dry_run`].
    pub fn dry_run(&mut self, on: bool) {
        self.servo.dry_run(on);
    }

    /// See [`Servo::set_weight`].
    ///
    /// # Errors
    /// [`WeightError`]; nothing changes.
    pub fn set_weight(&mut self, term: usize, value: f32) -> Result<(), WeightError> {
        self.servo.set_weight(term, value)
    }

    /// See [`Servo::compensation`].
    #[must_use]
    pub fn compensation(&self) -> &Compensation<'_, C> {
        self.servo.compensation()
    }

    /// See [`Servo::is_swapping`].
    #[must_use]
    pub fn is_swapping(&self) -> bool {
        self.changing
    }

    /// See [`Servo::factor`].
    #[must_use]
    pub fn factor(&self) -> f32 {
        self.servo.factor()
    }

    /// See [`Servo::wanted_weights`].
    #[must_use]
    pub fn wanted_weights(&self) -> &trueaxis::Weights {
        self.servo.wanted_weights()
    }
}

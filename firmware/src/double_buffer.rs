//! Two buffers for compensations: one that the servo reads, one to load into.
//!
//! A servo in an interrupt needs a compensation that lives for ever. The next one must be loaded without stopping it,
//! so there are two buffers, which are loaded alternately. The main loop also reads the compensation in use, at the
//! same time as the servo, so the servo cannot own it (otherwise [`Servo::take_retired`] alone would be enough, without
//! `unsafe`), and without a heap there is no reference count. The types returned by one [`DoubleBuffer::split`] enforce
//! the rules that make this sound:
//!
//! 1. Only [`Loader`] writes, with `&mut self`, and only into a buffer that is not held.
//! 2. Only the servo of [`BufferedServo`] holds buffers, each through a `Held`, which marks its buffer for as long as
//!    it exists.
//! 3. A buffer passes from the loader to the servo only as [`Loaded`], which borrows the loader mutably: while it
//!    exists, nothing is loaded.
//! 4. Everything else reads through a borrow of `Loader` or `BufferedServo`, which ends before they write.
//!
//! So a buffer is written only while no reference to it exists. The samples are in flash: a buffer keeps the [`Lease`]
//! of their slot for as long as it keeps the compensation, and [`Loader::vacate`] returns it.
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

/// Two compensations in static memory, initially empty: all zeros, so they take no flash.
pub struct DoubleBuffer<C: Room = Usual> {
    both: [Buffer<C>; 2],
    taken: AtomicBool,
}

/// One of the two buffers.
struct Buffer<C: Room> {
    cell: UnsafeCell<Content<C>>,
    /// Held by the servo. Written by `Held` only.
    held: AtomicBool,
}

/// A compensation, with the lease of the bytes it reads.
struct Content<C: Room> {
    compensation: Compensation<'static, C>,
    lease: Option<Lease>,
}

// SAFETY: the cell is written only by the single `Loader`, and only while no reference into it exists (the rules at the
// head of this file). Otherwise it is shared for reading, which a `Compensation` permits because it is plain data. The
// mark is atomic.
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

    /// Private: callers must follow the rules at the head of this file.
    fn read(&self) -> &Compensation<'static, C> {
        // SAFETY: called by `Loaded` and `Loader`, whose borrows prevent the only writer from writing, and by `Held`,
        // whose mark keeps the writer away. So no `&mut` exists while the reference lives.
        unsafe { &(*self.cell.get()).compensation }
    }
}

/// The servo's handle of a buffer.
struct Held<C: Room>(&'static Buffer<C>);

impl<C: Room> Held<C> {
    /// Marks a buffer that is [`Loaded`], or that cannot have been written yet.
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

/// The servo no longer reads the buffer; all its reads happen before this store.
impl<C: Room> Drop for Held<C> {
    fn drop(&mut self) {
        self.0.held.store(false, Ordering::Release);
    }
}

/// Why no compensation was loaded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NotLoaded {
    /// The servo holds both buffers because a change is in progress.
    Busy,
    /// The blob was refused.
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
    /// Both buffers empty; for a `static`.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            both: [const { Buffer::new() }; 2],
            taken: AtomicBool::new(false),
        }
    }

    /// The two sides, on the first call only.
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

    /// Takes both sides back, which ends the servo. Both buffers are then empty and can be split again; leases are
    /// dropped. Returns false if the sides belong to other buffers, which then stay split for ever.
    pub fn unite(&'static self, mut loader: Loader<C>, servo: BufferedServo<C>) -> bool {
        let ours = core::ptr::eq(self, loader.buffers) && core::ptr::eq(self, servo.buffers);
        // It no longer holds a buffer.
        drop(servo);
        if ours {
            for buffer in &self.both {
                let _ = loader.empty(buffer);
            }
            self.taken.store(false, Ordering::Release);
        }
        ours
    }

    /// The other buffer.
    fn other(&self, buffer: &Buffer<C>) -> &Buffer<C> {
        let [first, second] = &self.both;
        if core::ptr::eq(first, buffer) {
            second
        } else {
            first
        }
    }
}

/// The loading side, for the main loop.
pub struct Loader<C: Room> {
    buffers: &'static DoubleBuffer<C>,
}

impl<C: Room> Loader<C> {
    /// Loads a blob into the vacant buffer. [Vacate](Self::vacate) it first, because a lease that is still there is
    /// dropped. Bytes after the blob are ignored.
    ///
    /// # Errors
    /// [`NotLoaded`]. The next `vacate` returns the lease of a refused blob.
    pub fn load(&mut self, blob: impl Into<Lease>) -> Result<Loaded<'_, C>, NotLoaded> {
        let buffer = self.vacant().ok_or(NotLoaded::Busy)?;
        let content = self.write(buffer);
        let lease = content.lease.insert(blob.into());
        // SAFETY: the compensation is emptied, or loaded with another lease, before this one leaves the buffer; it is
        // visible only with the lifetimes of borrows.
        let bytes = unsafe { lease.kept() };
        let loaded = content.compensation.load_slot(bytes);
        loaded.map_err(NotLoaded::Refused)?;
        Ok(Loaded {
            buffers: self.buffers,
            buffer,
            loader: PhantomData,
        })
    }

    /// Loads a blob into the vacant buffer, calls `look` with the compensation in use and the new one, and empties the
    /// buffer.
    ///
    /// # Errors
    /// [`NotLoaded`]
    pub(crate) fn try_on<R>(
        &mut self,
        blob: &[u8],
        look: impl FnOnce(&Compensation<'_, C>, &Compensation<'_, C>) -> R,
    ) -> Result<R, NotLoaded> {
        /// Empties a compensation on drop, whatever happens before.
        struct Emptied<'c, C: Room>(&'c mut Compensation<'static, C>);
        impl<C: Room> Drop for Emptied<'_, C> {
            fn drop(&mut self) {
                // An empty slice is not a blob, so it is refused and leaves the compensation empty.
                let _ = self.0.load_slot(&[]);
            }
        }
        let buffer = self.vacant().ok_or(NotLoaded::Busy)?;
        let active = self.buffers.other(buffer);
        // SAFETY: the compensation is emptied before this returns or unwinds, so it does not outlive `blob`. Nothing
        // else can read the buffer meanwhile: it is not held, and `self` is borrowed. `look` sees it with its own
        // lifetime and cannot keep any of it.
        let blob: &'static [u8] = unsafe { &*core::ptr::from_ref(blob) };
        let new = Emptied(&mut self.write(buffer).compensation);
        new.0.load_slot(blob).map_err(NotLoaded::Refused)?;
        Ok(look(active.read(), new.0))
    }

    /// Empties the vacant buffer, so that no buffer refers to any slot except the active one, and returns the lease
    /// that was there.
    ///
    /// # Errors
    /// [`NotLoaded::Busy`]: the servo holds both buffers.
    pub fn vacate(&mut self) -> Result<Option<Lease>, NotLoaded> {
        let buffer = self.vacant().ok_or(NotLoaded::Busy)?;
        Ok(self.empty(buffer))
    }

    /// The compensation used by the servo; during a change, the old or the new one.
    #[must_use]
    pub fn current(&self) -> &Compensation<'_, C> {
        let [first, second] = &self.buffers.both;
        let held = first.held.load(Ordering::Acquire);
        if held { first.read() } else { second.read() }
    }

    /// A buffer that the servo does not hold. Only [`BufferedServo`] makes the servo hold a buffer, and only a `Loaded`
    /// one, which cannot exist here because this borrows the loader as well. So it stays vacant.
    fn vacant(&self) -> Option<&'static Buffer<C>> {
        let held = |buffer: &&Buffer<C>| buffer.held.load(Ordering::Acquire);
        self.buffers.both.iter().find(|buffer| !held(buffer))
    }

    /// Empties one of these buffers, which must be [`vacant`](Self::vacant).
    fn empty(&mut self, buffer: &Buffer<C>) -> Option<Lease> {
        let content = self.write(buffer);
        // An empty slice is not a blob, so it is refused and leaves the compensation empty.
        let _ = content.compensation.load_slot(&[]);
        content.lease.take()
    }

    /// Write access to one of these buffers, which must be [`vacant`](Self::vacant).
    fn write<'w>(&'w mut self, buffer: &'w Buffer<C>) -> &'w mut Content<C> {
        // SAFETY: the buffer is not held, so the servo has no reference to it. References from `Loaded` and `current`
        // are borrows of `self`, which is borrowed mutably. These buffers have a single `Loader`. The acquiring load in
        // `vacant` comes after the servo's last read, which precedes the releasing store in `Held`.
        unsafe { &mut *buffer.cell.get() }
    }
}

/// A loaded compensation that can be given to the servo.
pub struct Loaded<'l, C: Room> {
    buffers: &'static DoubleBuffer<C>,
    buffer: &'static Buffer<C>,
    loader: PhantomData<&'l mut ()>,
}

impl<C: Room> Loaded<'_, C> {
    /// The loaded compensation.
    #[must_use]
    pub fn compensation(&self) -> &Compensation<'_, C> {
        self.buffer.read()
    }

    /// The compensation in use.
    #[must_use]
    pub fn active(&self) -> &Compensation<'_, C> {
        self.buffers.other(self.buffer).read()
    }
}

/// The servo with the buffers it reads, for the interrupt.
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
            // After this the servo holds only `compensation()`, which is the new one.
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
        // The returned handle is no longer held.
        match self.servo.swap(Held::new(loaded.buffer)) {
            Ok(_) => {
                self.changing = true;
                Ok(())
            }
            Err(refused) => Err(refused.why),
        }
    }

    /// Starts a new servo with a compensation that may have other axes: disabled, zero, directions of travel unknown.
    /// Call it only while all corrections are zero, because they would jump there.
    ///
    /// # Errors
    /// [`Refused::Busy`] while a change is in progress.
    pub fn replace(&mut self, loaded: Loaded<'_, C>) -> Result<(), Refused> {
        if self.changing || !core::ptr::eq(self.buffers, loaded.buffers) {
            return Err(Refused::Busy);
        }
        // The old servo is dropped and releases its buffer.
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

//! Two places for compensations: one that the servo reads, one to load into. The only file of this
//! crate with `unsafe`.
//!
//! A servo that runs in an interrupt needs a `&'static Compensation`; the next compensation must be
//! loaded without stopping it, so there are two, and what was read before is loaded into again.
//! The rules that make this sound are held by three types that come from one [`Places::split`]:
//!
//! 1. [`Loader`] alone writes, with `&mut self`, and only into a place whose bit in `read` is clear.
//! 2. [`Driven`] alone holds `'static` references; it never gives them away. It sets the bit of
//!    a place before it takes it into its servo, and clears it when the servo no longer holds it.
//! 3. A place goes from the loader to the servo only as [`Loaded`], which borrows the loader
//!    mutably: while there is one, nothing is loaded.
//! 4. Everybody else reads through a borrow of `Loader` or `Driven`, which ends before they write.
//!
//! So a place is written only while no reference to it exists. The samples lie in flash: whoever
//! writes flash must keep off the slots whose compensation is in a place, see
//! [`Loader::vacate`].
#![allow(unsafe_code)]

#[cfg(test)]
mod tests;

use core::cell::UnsafeCell;
use core::fmt;
use core::marker::PhantomData;
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicBool, AtomicU8, Ordering};

use trueaxis::{
    Compensation, Correction, Inputs, LoadError, Refused, Room, Servo, Usual, WeightError,
};

/// Two compensations in static memory, empty at first.
pub struct Places<C: Room = Usual> {
    cells: [UnsafeCell<Compensation<'static, C>>; 2],
    /// Bit of each place that the servo holds. Written by [`Driven`] only.
    read: AtomicU8,
    taken: AtomicBool,
}

// SAFETY: the cells are written only by the one `Loader`, and only while no reference into them
// exists (the rules at the head of this file); otherwise they are shared for reading, which a
// `Compensation` allows: it is plain data. The other fields are atomic.
unsafe impl<C: Room> Sync for Places<C> {}

/// Why no compensation was loaded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NotLoaded {
    /// The servo holds both places: a change is under way.
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

impl<C: Room> Default for Places<C> {
    fn default() -> Self {
        Self::new()
    }
}

impl<C: Room> Places<C> {
    /// Both empty; for a `static`.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            cells: [const { UnsafeCell::new(Compensation::empty()) }; 2],
            // The first is that of the servo from the beginning.
            read: AtomicU8::new(1),
            taken: AtomicBool::new(false),
        }
    }

    /// The two sides, the first time it is called.
    pub fn split(&'static self) -> Option<(Loader<C>, Driven<C>)> {
        if self.taken.swap(true, Ordering::AcqRel) {
            return None;
        }
        let driven = Driven {
            places: self,
            servo: MaybeUninit::new(Servo::new(self.shared(0))),
            next: None,
        };
        Some((Loader { places: self }, driven))
    }

    /// Takes both sides back, which ends the servo; both places are empty, and can be split again.
    /// False if the sides are of other places: those stay split for ever.
    pub fn unite(&'static self, mut loader: Loader<C>, driven: Driven<C>) -> bool {
        // Of the driven side nothing is used from here on: its references are gone.
        let Driven { places, .. } = driven;
        let ours = core::ptr::eq(self, loader.places) && core::ptr::eq(self, places);
        if ours {
            self.read.store(0, Ordering::Release);
            for place in [0, 1] {
                let _ = loader.write(place, &[]);
            }
            self.read.store(1, Ordering::Release);
            self.taken.store(false, Ordering::Release);
        }
        ours
    }

    fn cell(&self, place: u8) -> &UnsafeCell<Compensation<'static, C>> {
        let [first, second] = &self.cells;
        if place == 0 { first } else { second }
    }

    /// Private: whoever calls it keeps the rules at the head of this file.
    fn shared(&self, place: u8) -> &Compensation<'static, C> {
        // SAFETY: it is called from `split`, before anything can be written; from `Loaded` and
        // `Loader`, whose borrows keep the one writer from writing; and from `Driven` for a place
        // whose bit in `read` it has set, which keeps the writer off. So no `&mut` exists while
        // the reference lives.
        unsafe { &*self.cell(place).get() }
    }
}

fn bit(place: u8) -> u8 {
    1 << place
}

/// The side that loads: that of the main loop.
pub struct Loader<C: Room> {
    places: &'static Places<C>,
}

impl<C: Room> Loader<C> {
    /// Loads a slot into the vacant place; bytes after the blob are ignored.
    ///
    /// # Errors
    /// [`NotLoaded`]
    pub fn load(&mut self, slot: &'static [u8]) -> Result<Loaded<'_, C>, NotLoaded> {
        let place = self.vacant().ok_or(NotLoaded::Busy)?;
        self.write(place, slot).map_err(NotLoaded::Refused)?;
        Ok(Loaded {
            places: self.places,
            place,
            loader: PhantomData,
        })
    }

    /// Empties the vacant place, so that no place refers to any slot but the active one. False if
    /// the servo holds both.
    pub fn vacate(&mut self) -> bool {
        match self.vacant() {
            Some(place) => {
                // No bytes are no blob: refused, and emptied thereby.
                let _ = self.write(place, &[]);
                true
            }
            None => false,
        }
    }

    /// The compensation that the servo uses; during a change the old one or the new one.
    #[must_use]
    pub fn current(&self) -> &Compensation<'_, C> {
        let first = self.places.read.load(Ordering::Acquire) & bit(0) != 0;
        self.places.shared(u8::from(!first))
    }

    /// A place that the servo does not hold. Only `Driven::take` makes it hold one, and only one
    /// that is `Loaded`, which cannot exist here: this borrows the loader too. So it stays vacant.
    fn vacant(&self) -> Option<u8> {
        let read = self.places.read.load(Ordering::Acquire);
        [0, 1].into_iter().find(|&place| read & bit(place) == 0)
    }

    /// Writes into a place that is [`vacant`](Self::vacant).
    fn write(&mut self, place: u8, slot: &'static [u8]) -> Result<(), LoadError> {
        // SAFETY: the bit of `place` in `read` is clear, so the servo holds no reference to it;
        // `Driven` gives none away; those of `Loaded` and `current` are borrows of `self`, which
        // is borrowed mutably. There is one `Loader` for these places. The acquiring load in
        // `vacant` comes after the servo's last reading, which its releasing store follows.
        let compensation = unsafe { &mut *self.places.cell(place).get() };
        compensation.load_slot(slot)
    }
}

/// A compensation that is loaded and can be given to the servo.
pub struct Loaded<'l, C: Room> {
    places: &'static Places<C>,
    place: u8,
    loader: PhantomData<&'l mut ()>,
}

impl<C: Room> Loaded<'_, C> {
    /// What is loaded.
    #[must_use]
    pub fn compensation(&self) -> &Compensation<'_, C> {
        self.places.shared(self.place)
    }

    /// What the servo uses.
    #[must_use]
    pub fn active(&self) -> &Compensation<'_, C> {
        self.places.shared(1 - self.place)
    }
}

/// The servo with the places it reads: the side of the interrupt.
pub struct Driven<C: Room> {
    places: &'static Places<C>,
    /// Always there. References within arguments count as in use for as long as the function
    /// runs, and a driven side may be an argument of `main` itself; what is possibly uninitialised
    /// is exempt from that.
    servo: MaybeUninit<Servo<&'static Compensation<'static, C>>>,
    /// The place that is being faded in.
    next: Option<u8>,
}

impl<C: Room> Driven<C> {
    fn servo(&self) -> &Servo<&'static Compensation<'static, C>> {
        // SAFETY: it is initialised in `split`, and only ever assigned as a whole.
        unsafe { self.servo.assume_init_ref() }
    }

    fn servo_mut(&mut self) -> &mut Servo<&'static Compensation<'static, C>> {
        // SAFETY: as in `servo`.
        unsafe { self.servo.assume_init_mut() }
    }

    /// See [`Servo::update`].
    pub fn update(
        &mut self,
        inputs: &Inputs<C::Axes<f32>>,
        referenced: u16,
        dt: f32,
    ) -> Correction<C::Axes<f32>> {
        let correction = self.servo_mut().update(inputs, referenced, dt);
        if let Some(next) = self.next
            && !self.servo().is_swapping()
        {
            // With this the servo holds only `compensation()`, and that is the new one.
            self.servo_mut().take_retired();
            self.next = None;
            self.places.read.store(bit(next), Ordering::Release);
        }
        correction
    }

    /// See [`Servo::swap`].
    ///
    /// # Errors
    /// [`Refused`]; nothing changes.
    pub fn swap(&mut self, loaded: Loaded<'_, C>) -> Result<(), Refused> {
        if self.next.is_some() || !core::ptr::eq(self.places, loaded.places) {
            return Err(Refused::Busy);
        }
        let before = self.places.read.load(Ordering::Relaxed);
        self.places.read.store(0b11, Ordering::Release);
        let places = self.places;
        match self.servo_mut().swap(places.shared(loaded.place)) {
            // None was retired: it is taken back as soon as it is.
            Ok(_) => {
                self.next = Some(loaded.place);
                Ok(())
            }
            // The servo has not taken it.
            Err(refused) => {
                self.places.read.store(before, Ordering::Release);
                Err(refused.why)
            }
        }
    }

    /// Starts a new servo with a compensation that may have other axes: disabled, zero, directions
    /// of travel unknown. To be called only while all corrections are zero, or they jump there.
    ///
    /// # Errors
    /// [`Refused::Busy`] while a change is under way.
    pub fn replace(&mut self, loaded: Loaded<'_, C>) -> Result<(), Refused> {
        if self.next.is_some() || !core::ptr::eq(self.places, loaded.places) {
            return Err(Refused::Busy);
        }
        self.places.read.store(0b11, Ordering::Release);
        let places = self.places;
        *self.servo_mut() = Servo::new(places.shared(loaded.place));
        // The old servo is gone, and with it its references.
        self.places.read.store(bit(loaded.place), Ordering::Release);
        Ok(())
    }

    /// See [`Servo::enable`] and [`Servo::disable`].
    pub fn enable(&mut self, on: bool) {
        if on {
            self.servo_mut().enable();
        } else {
            self.servo_mut().disable();
        }
    }

    /// See [`Servo::dry_run`].
    pub fn dry_run(&mut self, on: bool) {
        self.servo_mut().dry_run(on);
    }

    /// See [`Servo::set_weight`].
    ///
    /// # Errors
    /// [`WeightError`]; nothing changes.
    pub fn set_weight(&mut self, term: usize, value: f32) -> Result<(), WeightError> {
        self.servo_mut().set_weight(term, value)
    }

    /// See [`Servo::compensation`].
    #[must_use]
    pub fn compensation(&self) -> &Compensation<'_, C> {
        self.servo().compensation()
    }

    /// See [`Servo::is_swapping`].
    #[must_use]
    pub fn is_swapping(&self) -> bool {
        self.next.is_some()
    }

    /// See [`Servo::factor`].
    #[must_use]
    pub fn factor(&self) -> f32 {
        self.servo().factor()
    }

    /// See [`Servo::wanted_weights`].
    #[must_use]
    pub fn wanted_weights(&self) -> &trueaxis::Weights {
        self.servo().wanted_weights()
    }
}

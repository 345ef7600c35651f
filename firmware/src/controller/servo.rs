//! The servo side, shared between the servo interrupt and the main loop.

use core::cell::{Cell, RefCell};
use core::sync::atomic::{AtomicU32, Ordering};

use critical_section::Mutex;
use trueaxis::Room;

use crate::device::{Clock, CorrectionSink, PositionSource, ServoAccess, ServoSide};

/// The servo side where both can reach it.
pub type Shared<C> = Mutex<RefCell<ServoSide<C>>>;

/// What the servo interrupt updates and counts: for a `static`.
pub struct Shell<C: Room> {
    /// The servo side, once there is one.
    side: Mutex<Cell<Option<&'static Shared<C>>>>,
    /// Servo interrupts since the last millisecond, and milliseconds since start.
    ticks: AtomicU32,
    milliseconds: AtomicU32,
    ticks_per_ms: u32,
}

/// The main loop's access to the servo side.
#[derive(Clone, Copy)]
pub struct Access<C: Room> {
    shell: &'static Shell<C>,
    side: &'static Shared<C>,
}

impl<C: Room> Shell<C> {
    /// For so many servo periods per second: whole ones per millisecond.
    #[must_use]
    pub const fn new(rate: u32) -> Self {
        assert!(
            rate >= 1000 && rate.is_multiple_of(1000),
            "so many whole servo periods per millisecond"
        );
        Self {
            side: Mutex::new(Cell::new(None)),
            ticks: AtomicU32::new(0),
            milliseconds: AtomicU32::new(0),
            ticks_per_ms: rate / 1000,
        }
    }

    /// Gives `side` to the interrupt too.
    pub fn share(&'static self, side: &'static Shared<C>) -> Access<C> {
        critical_section::with(|token| self.side.borrow(token).set(Some(side)));
        Access { shell: self, side }
    }

    /// One servo period: to be called by the servo interrupt.
    pub fn tick(
        &self,
        source: &mut impl PositionSource<C::Axes<f32>>,
        sink: &mut impl CorrectionSink<C::Axes<f32>>,
        clock: &impl Clock,
    ) {
        let ticks = self.ticks.load(Ordering::Relaxed).wrapping_add(1);
        self.ticks
            .store(ticks % self.ticks_per_ms, Ordering::Relaxed);
        if ticks >= self.ticks_per_ms {
            let now = self.milliseconds();
            self.milliseconds
                .store(now.wrapping_add(1), Ordering::Relaxed);
        }
        critical_section::with(|token| {
            let Some(shared) = self.side.borrow(token).get() else {
                return;
            };
            if let Ok(mut side) = shared.borrow(token).try_borrow_mut() {
                side.tick(source, sink, clock);
            }
        });
    }

    /// Milliseconds since start, as the servo interrupt counts them; wraps at 2³².
    pub fn milliseconds(&self) -> u32 {
        self.milliseconds.load(Ordering::Relaxed)
    }
}

impl<C: Room> Access<C> {
    /// See [`Shell::milliseconds`].
    #[must_use]
    pub fn milliseconds(&self) -> u32 {
        self.shell.milliseconds()
    }
}

impl<C: Room> ServoAccess<C> for Access<C> {
    fn with<R>(&mut self, f: impl FnOnce(&mut ServoSide<C>) -> R) -> R {
        // Nobody else holds it: the interrupt is masked, and the main loop is here.
        critical_section::with(|token| f(&mut self.side.borrow_ref_mut(token)))
    }
}

#[cfg(test)]
mod tests;

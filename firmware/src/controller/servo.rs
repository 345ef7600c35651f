//! The servo side, shared between the servo interrupt and the main loop.
//!
//! It is passed back and forth: whoever uses it first takes it out of the shared place. The servo interrupt takes it,
//! ticks with interrupts enabled, and puts it back. The main loop takes it with interrupts masked, only for the time
//! needed to change a few settings, so the servo interrupt always finds it in place.

use core::cell::Cell;
use core::sync::atomic::{AtomicU32, Ordering};

use critical_section::Mutex;
use trueaxis::Room;

use super::liveness::Liveness;
use crate::device::{Clock, CorrectionSink, PositionSource, ServoAccess, ServoSide};

/// How long the main loop may be silent before it counts as dead, ms: longer than checking and loading the largest
/// compensation takes.
const PATIENCE: u32 = 1000;

/// The state that the servo interrupt updates and counts, for a `static`.
pub struct Shell<C: Room> {
    /// The servo side, unless it has been taken out.
    side: Mutex<Cell<Option<&'static mut ServoSide<C>>>>,
    liveness: Liveness,
    /// Servo interrupts since the last millisecond, and milliseconds since start.
    ticks: AtomicU32,
    milliseconds: AtomicU32,
    overruns: AtomicU32,
    ticks_per_ms: u32,
}

/// The main loop's access to the servo side.
pub struct Access<C: Room> {
    shell: &'static Shell<C>,
}

impl<C: Room> Clone for Access<C> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<C: Room> Copy for Access<C> {}

impl<C: Room> Shell<C> {
    /// `rate`: servo periods per second, a multiple of 1000.
    #[must_use]
    pub const fn new(rate: u32) -> Self {
        assert!(
            rate >= 1000 && rate.is_multiple_of(1000),
            "so many whole servo periods per millisecond"
        );
        Self {
            side: Mutex::new(Cell::new(None)),
            liveness: Liveness::new(PATIENCE * (rate / 1000)),
            ticks: AtomicU32::new(0),
            milliseconds: AtomicU32::new(0),
            overruns: AtomicU32::new(0),
            ticks_per_ms: rate / 1000,
        }
    }

    /// Makes `side` available to the interrupt as well.
    pub fn share(&'static self, side: &'static mut ServoSide<C>) -> Access<C> {
        self.put(side);
        Access { shell: self }
    }

    fn take(&self) -> Option<&'static mut ServoSide<C>> {
        critical_section::with(|token| self.side.borrow(token).take())
    }

    fn put(&self, side: &'static mut ServoSide<C>) {
        critical_section::with(|token| self.side.borrow(token).set(Some(side)));
    }

    /// Runs one servo period; call it from the servo interrupt. Returns whether there is no fault, see
    /// [`ServoSide::is_healthy`].
    pub fn tick(
        &self,
        source: &mut impl PositionSource<C::Axes<f32>>,
        sink: &mut impl CorrectionSink<C::Axes<f32>>,
        clock: &impl Clock,
    ) -> bool {
        let mut ticks = self.ticks.load(Ordering::Relaxed).wrapping_add(1);
        if ticks >= self.ticks_per_ms {
            ticks = 0;
            let now = self.milliseconds();
            self.milliseconds
                .store(now.wrapping_add(1), Ordering::Relaxed);
        }
        self.ticks.store(ticks, Ordering::Relaxed);
        let Some(side) = self.take() else {
            return false;
        };
        side.set_overruns(self.overruns.load(Ordering::Relaxed));
        side.tick(source, sink, clock);
        let healthy = side.is_healthy();
        self.put(side);
        healthy
    }

    /// A servo period has begun before the previous one ended; call this from the servo interrupt.
    pub fn overrun(&self) {
        let count = self.overruns.load(Ordering::Relaxed);
        self.overruns
            .store(count.wrapping_add(1), Ordering::Relaxed);
    }

    /// Whether both are alive, for [`Heart::beat`](super::Heart::beat).
    #[must_use]
    pub fn liveness(&self) -> &Liveness {
        &self.liveness
    }

    /// Milliseconds since start, counted by the servo interrupt; wraps at 2³².
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

    /// The main loop is alive.
    pub fn lives(&self) {
        self.shell.liveness.main_loop();
    }
}

impl<C: Room> ServoAccess<C> for Access<C> {
    fn with<R>(&mut self, f: impl FnOnce(&mut ServoSide<C>) -> R) -> R {
        let mut f = Some(f);
        loop {
            let done = critical_section::with(|token| {
                let place = self.shell.side.borrow(token);
                let side = place.take()?;
                let done = f.take().map(|f| f(&mut *side));
                place.set(Some(side));
                done
            });
            // With one processor it is always present: the servo interrupt puts it back before it ends.
            if let Some(done) = done {
                return done;
            }
        }
    }
}

#[cfg(test)]
mod tests;

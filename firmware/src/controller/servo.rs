//! The servo side, shared between the servo interrupt and the main loop.
//!
//! It is handed over: whoever works with it has taken it out of where both can reach it. The servo
//! interrupt takes it, ticks with no interrupt masked, and puts it back; the main loop takes it with
//! interrupts masked, for as long as a few settings need, so that the servo interrupt never finds
//! it gone.

use core::cell::Cell;
use core::sync::atomic::{AtomicU32, Ordering};

use critical_section::Mutex;
use trueaxis::Room;

use super::liveness::Liveness;
use crate::device::{Clock, CorrectionSink, PositionSource, ServoAccess, ServoSide};

/// So long the main loop may be silent before it counts as dead, ms: longer than it checks and
/// loads the largest compensation.
const PATIENCE: u32 = 1000;

/// What the servo interrupt updates and counts: for a `static`.
pub struct Shell<C: Room> {
    /// The servo side, unless somebody has it.
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
    /// For so many servo periods per second: whole ones per millisecond.
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

    /// Gives `side` to the interrupt too.
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

    /// One servo period: to be called by the servo interrupt. Whether there is no fault, see
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

    /// A servo period has begun before the one before was over: to be called by the servo interrupt.
    pub fn overrun(&self) {
        let count = self.overruns.load(Ordering::Relaxed);
        self.overruns
            .store(count.wrapping_add(1), Ordering::Relaxed);
    }

    /// Whether both live: for [`Heart::beat`](super::Heart::beat).
    #[must_use]
    pub fn liveness(&self) -> &Liveness {
        &self.liveness
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

    /// The main loop lives.
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
            // With one processor it is always there: the servo interrupt puts it back before it ends.
            if let Some(done) = done {
                return done;
            }
        }
    }
}

#[cfg(test)]
mod tests;

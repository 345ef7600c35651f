//! The servo side, shared between the servo interrupt and the main loop.

use core::cell::{Cell, RefCell};
use core::sync::atomic::{AtomicU32, Ordering};

use critical_section::Mutex;
use trueaxis_firmware::device::{Clock, CorrectionSink, PositionSource, ServoAccess};

use crate::{AXES, RATE, ServoSide, Tables};

/// The servo side where both can reach it.
pub type Shared = Mutex<RefCell<ServoSide>>;

/// The servo side that the interrupt updates, once there is one.
static SIDE: Mutex<Cell<Option<&'static Shared>>> = Mutex::new(Cell::new(None));
/// Servo interrupts since the last millisecond, and milliseconds since start.
static TICKS: AtomicU32 = AtomicU32::new(0);
static MILLISECONDS: AtomicU32 = AtomicU32::new(0);
const TICKS_PER_MS: u32 = RATE / 1000;

/// The main loop's access to the servo side.
#[derive(Clone, Copy)]
pub struct Access {
    side: &'static Shared,
}

impl Access {
    /// Gives `side` to the interrupt too.
    pub fn share(side: &'static Shared) -> Self {
        critical_section::with(|token| SIDE.borrow(token).set(Some(side)));
        Self { side }
    }
}

impl ServoAccess<Tables> for Access {
    fn with<R>(&mut self, f: impl FnOnce(&mut ServoSide) -> R) -> R {
        // Nobody else holds it: the interrupt is masked, and the main loop is here.
        critical_section::with(|token| f(&mut self.side.borrow_ref_mut(token)))
    }
}

/// One servo period: to be called by the servo interrupt.
pub fn tick(
    source: &mut impl PositionSource<[f32; AXES]>,
    sink: &mut impl CorrectionSink<[f32; AXES]>,
    clock: &impl Clock,
) {
    let ticks = TICKS.load(Ordering::Relaxed).wrapping_add(1);
    TICKS.store(ticks % TICKS_PER_MS, Ordering::Relaxed);
    if ticks >= TICKS_PER_MS {
        let now = MILLISECONDS.load(Ordering::Relaxed);
        MILLISECONDS.store(now.wrapping_add(1), Ordering::Relaxed);
    }
    critical_section::with(|token| {
        let Some(shared) = SIDE.borrow(token).get() else {
            return;
        };
        if let Ok(mut side) = shared.borrow(token).try_borrow_mut() {
            side.tick(source, sink, clock);
        }
    });
}

/// Milliseconds since start, as the servo interrupt counts them; wraps at 2³².
pub fn milliseconds() -> u32 {
    MILLISECONDS.load(Ordering::Relaxed)
}

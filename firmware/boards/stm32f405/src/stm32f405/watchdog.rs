//! The independent watchdog, which has its own oscillator (17 to 47 kHz, nominally 32).

use trueaxis_firmware::controller::Watchdog;

use crate::bare::iwdg;

/// Nominally 10 ms, at most 19 and at least 6.8 (prescaler 4).
const SHORT: (u8, u16) = (0, 80);
/// Nominally 16 s, at least 10.9 (prescaler 256): longer than the erase of a sector, at most 4 s, during which nothing
/// can run to feed it.
const LONG: (u8, u16) = (6, 2000);

/// The watchdog, fed by the servo interrupt.
pub struct Dog(());

impl Dog {
    /// Starts the only watchdog, which can be stopped only by a reset.
    pub fn start() -> Self {
        iwdg::start();
        set(SHORT);
        Self(())
    }
}

impl Watchdog for Dog {
    fn feed(&mut self) {
        iwdg::feed();
    }
}

/// Executes `f`, during which the servo interrupt cannot run.
pub fn while_nothing_runs<R>(f: impl FnOnce() -> R) -> R {
    set(LONG);
    let done = f();
    set(SHORT);
    done
}

fn set((prescaler, reload): (u8, u16)) {
    // Its oscillator takes about 0.3 ms for each change.
    while iwdg::is_changing() {}
    critical_section::with(|_| iwdg::set(prescaler, reload));
    while iwdg::is_changing() {}
    iwdg::feed();
}

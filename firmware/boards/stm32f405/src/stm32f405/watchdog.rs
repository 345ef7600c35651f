//! The independent watchdog, which has an oscillator of its own (17 to 47 kHz, nominally 32).

use trueaxis_firmware::controller::Watchdog;

use crate::bare::iwdg;

/// Nominally 10 ms, at most 19 and at least 6.8 (prescaler 4).
const SHORT: (u8, u16) = (0, 80);
/// Nominally 16 s, at least 10.9 (prescaler 256): longer than the erase of a sector, 4 s at most,
/// during which nothing runs that could feed it.
const LONG: (u8, u16) = (6, 2000);

/// The watchdog, as the servo interrupt feeds it.
pub struct Dog(());

impl Dog {
    /// Starts it: only a reset ends it. There is one.
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

/// Does something during which the servo interrupt cannot run.
pub fn while_nothing_runs<R>(f: impl FnOnce() -> R) -> R {
    set(LONG);
    let done = f();
    set(SHORT);
    done
}

fn set((prescaler, reload): (u8, u16)) {
    // Its oscillator takes some 0.3 ms over each change.
    while iwdg::is_changing() {}
    critical_section::with(|_| iwdg::set(prescaler, reload));
    while iwdg::is_changing() {}
    iwdg::feed();
}

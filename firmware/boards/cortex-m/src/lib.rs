//! Common code of boards with a Cortex-M: short delays, and the end of a program: a processor fault, a panic, or a
//! board-specific error. The fault pin goes low, the reason is left in memory that survives a reset
//! ([`trueaxis_firmware::record`]), and the controller restarts.
#![no_std]

use core::cell::{Cell, UnsafeCell};
use core::mem::MaybeUninit;
use core::panic::PanicInfo;

use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};
use critical_section::Mutex;
use embedded_hal::delay::DelayNs;
use trueaxis::link::{Restart, Tail};
use trueaxis_firmware::record::{self, Flags, NONE, Words};

struct Kept(UnsafeCell<MaybeUninit<Words>>);

// SAFETY: accessed only by `read` and `write` below, in whole words with volatile accesses, on one processor: at start,
// from the servo interrupt, and where execution ends.
unsafe impl Sync for Kept {}

// SAFETY: `.uninit` is a section of `cortex-m-rt` in RAM that is neither loaded nor cleared; its contents are
// uninitialised, as the type states.
#[unsafe(link_section = ".uninit.trueaxis_record")]
static KEPT: Kept = Kept(UnsafeCell::new(MaybeUninit::uninit()));

/// The board's first action: drives its fault pin low.
static FIRST: Mutex<Cell<Option<fn()>>> = Mutex::new(Cell::new(None));

fn read() -> Words {
    // SAFETY: aligned memory of this program. The access is volatile, so the compiler cannot assume that the memory was
    // never written, and any bits are valid numbers.
    unsafe { KEPT.0.get().cast::<Words>().read_volatile() }
}

fn write(words: &Words) {
    // SAFETY: aligned memory of this program, see `Kept`.
    unsafe { KEPT.0.get().cast::<Words>().write_volatile(*words) };
}

/// Why the controller started; `flags` comes from its hardware. Call this once, at start: whatever is [left](leave)
/// from then on is found by the next start. `first` drives the fault pin low and may be called from anywhere.
pub fn start(flags: Flags, first: fn()) -> Restart {
    let reason = record::reason(flags, &read());
    write(&NONE);
    critical_section::with(|token| FIRST.borrow(token).set(Some(first)));
    reason
}

/// Leaves a reason for the next start: the watchdog is about to fire.
pub fn leave(reason: &Restart) {
    write(&record::write(reason));
}

/// Ends the program.
pub fn stop(reason: &Restart) -> ! {
    cortex_m::interrupt::disable();
    let first = critical_section::with(|token| FIRST.borrow(token).get());
    if let Some(first) = first {
        first();
    }
    leave(reason);
    SCB::sys_reset()
}

/// Stops after a panic: for a panic handler.
#[inline(always)]
pub fn stop_after(panic: &PanicInfo<'_>) -> ! {
    let place = panic.location();
    let (line, file) = place.map_or((0, ""), |place| (place.line(), place.file()));
    let file = Tail::of(file);
    stop(&Restart::Panic { line, file })
}

/// Handles processor faults.
// SAFETY: called only by the processor, and does not return; everything it accesses is designed for that.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    // SAFETY: reading the fault status register has no side effects.
    let status = unsafe { (*SCB::PTR).cfsr.read() };
    stop(&Restart::Exception {
        address: frame.pc(),
        status,
    })
}

/// Delays by counting cycles; waits at least the requested time.
pub struct Cycling {
    /// Processor cycles per microsecond.
    per_us: u32,
}

impl Cycling {
    /// For a processor clock in Hz that is a whole number of cycles per microsecond.
    #[must_use]
    pub const fn new(hertz: u32) -> Self {
        Self {
            per_us: hertz / 1_000_000,
        }
    }
}

impl DelayNs for Cycling {
    fn delay_ns(&mut self, ns: u32) {
        // No driver here waits long enough for this to end early.
        cortex_m::asm::delay((ns / 1000 + 1).saturating_mul(self.per_us));
    }
}

//! What boards with a Cortex-M do alike: short delays, and the end of a program: a fault of the processor, a panic, whatever a board adds. The
//! fault pin goes low, the reason is left in memory that a reset leaves as it is
//! ([`trueaxis_firmware::record`]), and the controller starts again.
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

// SAFETY: reached by `read` and `write` below alone, in whole words by volatile accesses, on one
// processor: at start, from the servo interrupt, and where nothing goes on afterwards.
unsafe impl Sync for Kept {}

// SAFETY: `.uninit` is a section of `cortex-m-rt` in RAM that is neither loaded nor cleared; what is
// in it is not initialised, and the type says so.
#[unsafe(link_section = ".uninit.trueaxis_record")]
static KEPT: Kept = Kept(UnsafeCell::new(MaybeUninit::uninit()));

/// What a board does first: its fault pin.
static FIRST: Mutex<Cell<Option<fn()>>> = Mutex::new(Cell::new(None));

fn read() -> Words {
    // SAFETY: aligned memory of this program. The access is volatile, so the compiler does not know
    // that nobody has written there, and any bits are numbers.
    unsafe { KEPT.0.get().cast::<Words>().read_volatile() }
}

fn write(words: &Words) {
    // SAFETY: aligned memory of this program, see `Kept`.
    unsafe { KEPT.0.get().cast::<Words>().write_volatile(*words) };
}

/// Why the controller has started; `flags` is what its hardware says. To be called once, at start:
/// the next start finds what is [left](leave) from now on. `first` drives the fault pin low, wherever
/// the program is.
pub fn start(flags: Flags, first: fn()) -> Restart {
    let reason = record::reason(flags, &read());
    write(&NONE);
    critical_section::with(|token| FIRST.borrow(token).set(Some(first)));
    reason
}

/// Leaves a reason for the next start: the watchdog is about to bite.
pub fn leave(reason: &Restart) {
    write(&record::write(reason));
}

/// The end of the program.
pub fn stop(reason: &Restart) -> ! {
    cortex_m::interrupt::disable();
    let first = critical_section::with(|token| FIRST.borrow(token).get());
    if let Some(first) = first {
        first();
    }
    leave(reason);
    SCB::sys_reset()
}

/// The same for the handler of a panic.
#[inline(always)]
pub fn stop_after(panic: &PanicInfo<'_>) -> ! {
    let place = panic.location();
    let (line, file) = place.map_or((0, ""), |place| (place.line(), place.file()));
    let file = Tail::of(file);
    stop(&Restart::Panic { line, file })
}

/// The processor cannot go on.
// SAFETY: called by the processor alone, and it does not return; what it touches is made for that.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    // SAFETY: reading the register that says what the fault was changes nothing.
    let status = unsafe { (*SCB::PTR).cfsr.read() };
    stop(&Restart::Exception {
        address: frame.pc(),
        status,
    })
}

/// Waits by counting cycles: at least so long.
pub struct Cycling {
    /// Cycles of the processor per microsecond.
    per_us: u32,
}

impl Cycling {
    /// With a processor that makes so many cycles per second: whole ones per microsecond.
    #[must_use]
    pub const fn new(hertz: u32) -> Self {
        Self {
            per_us: hertz / 1_000_000,
        }
    }
}

impl DelayNs for Cycling {
    fn delay_ns(&mut self, ns: u32) {
        // No driver here waits for so long that this ends early.
        cortex_m::asm::delay((ns / 1000 + 1).saturating_mul(self.per_us));
    }
}

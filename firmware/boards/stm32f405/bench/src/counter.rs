//! Counts instructions with SysTick in QEMU, and marks each measurement in the trace.

use core::arch::asm;

use cortex_m::asm::nop;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use semihosting::println;

/// SysTick ticks in 5 instructions: with `-icount shift=10` one instruction takes 2¹⁰ ns of emulated time, and SysTick
/// counts at the board's 25 MHz.
const TICKS: u32 = 128;
/// SysTick counts down from here.
const TOP: u32 = 0x00FF_FFFF;
/// Number of traced calls of each kind.
const TRACED: usize = 8;

/// An instruction that does nothing and that no compiler generates. A pair of them encloses the two reads of the
/// counter and the measured code, so that `cargo xtask bench-target` can find it in the trace of a run.
#[inline(always)]
fn mark() {
    // SAFETY: moves a register to itself.
    unsafe { asm!("mov r8, r8", options(nomem, nostack, preserves_flags)) };
}

/// Counts executed instructions, not cycles: QEMU models neither the pipeline nor the wait states of a flash.
pub struct Counter {
    /// Every instruction of this run is recorded, which takes long: only a few calls, each with its own count.
    pub traced: bool,
    syst: SYST,
    /// Ticks of an empty measurement.
    empty: u32,
}

impl Counter {
    /// Starts SysTick.
    pub fn new(mut syst: SYST, traced: bool) -> Self {
        syst.set_clock_source(SystClkSource::Core);
        syst.set_reload(TOP);
        syst.clear_current();
        syst.enable_counter();
        let mut counter = Self {
            traced,
            syst,
            empty: 0,
        };
        counter.empty = counter.ticks(|| ());
        counter
    }

    /// Whether ten instructions are counted as ten.
    pub fn is_right(&mut self) -> bool {
        let ten = || {
            nop();
            nop();
            nop();
            nop();
            nop();
            nop();
            nop();
            nop();
            nop();
            nop();
        };
        self.instructions(ten) == 10
    }

    /// The part of `counts` that is measured.
    pub fn some<'c>(&self, counts: &'c mut [u32]) -> &'c mut [u32] {
        let all = counts.len();
        &mut counts[..if self.traced { TRACED.min(all) } else { all }]
    }

    /// Number of instructions in one call of `work`; at most 650 000.
    pub fn instructions(&mut self, work: impl FnOnce()) -> u32 {
        let ticks = self.ticks(work) - self.empty;
        let count = (ticks * 5 + TICKS / 2) / TICKS;
        if self.traced {
            println!("call {count}");
        }
        count
    }

    #[inline(never)]
    fn ticks(&mut self, work: impl FnOnce()) -> u32 {
        // The first read after `clear_current` is the reload.
        self.syst.clear_current();
        mark();
        let before = SYST::get_current();
        work();
        let after = SYST::get_current();
        mark();
        before.wrapping_sub(after) & TOP
    }
}

/// Smallest, median and largest of many counts.
pub struct Spread {
    pub least: u32,
    pub typical: u32,
    pub most: u32,
}

impl Spread {
    /// Sorts `counts`.
    pub fn of(counts: &mut [u32]) -> Self {
        counts.sort_unstable();
        let at = |i: usize| counts.get(i).copied().unwrap_or(0);
        Self {
            least: at(0),
            typical: at(counts.len() / 2),
            most: at(counts.len().saturating_sub(1)),
        }
    }
}

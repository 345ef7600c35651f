//! Counts instructions with SysTick in QEMU.

use cortex_m::asm::nop;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

/// SysTick ticks in 5 instructions: with `-icount shift=10` one instruction takes 2¹⁰ ns of emulated time, and SysTick
/// counts at the board's 25 MHz.
const TICKS: u32 = 128;
/// SysTick counts down from here.
const TOP: u32 = 0x00FF_FFFF;

/// Counts executed instructions, not cycles: QEMU models neither the pipeline nor the wait states of a flash.
pub struct Counter {
    syst: SYST,
    /// Ticks of an empty measurement.
    empty: u32,
}

impl Counter {
    /// Starts SysTick.
    pub fn new(mut syst: SYST) -> Self {
        syst.set_clock_source(SystClkSource::Core);
        syst.set_reload(TOP);
        syst.clear_current();
        syst.enable_counter();
        let mut counter = Self { syst, empty: 0 };
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

    /// Number of instructions in one call of `work`; at most 650 000.
    pub fn instructions(&mut self, work: impl FnOnce()) -> u32 {
        let ticks = self.ticks(work) - self.empty;
        (ticks * 5 + TICKS / 2) / TICKS
    }

    #[inline(never)]
    fn ticks(&mut self, work: impl FnOnce()) -> u32 {
        // The first read after `clear_current` is the reload.
        self.syst.clear_current();
        let before = SYST::get_current();
        work();
        let after = SYST::get_current();
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

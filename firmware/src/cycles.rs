//! Cost of an update on a Cortex-M with a cycle counter.

use cortex_m::peripheral::DWT;
use trueaxis::link::CostUnit;

use crate::device::Clock;

/// The cycle counter of the processor, which must be enabled.
pub struct Cycles;

impl Clock for Cycles {
    const UNIT: CostUnit = CostUnit::Cycles;

    fn now(&self) -> u32 {
        DWT::cycle_count()
    }
}

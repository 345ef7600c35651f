//! From frames to the commands of servo periods, also where the two do not come one for one.

use super::frame::CommandFrame;
use crate::device::{Command, Regularity};

/// How many frames may be missing, damaged, or too many.
///
/// Every period without a new frame costs [`COST`](Self::COST), and so does every frame that this
/// side had no period for; every period with a new frame takes 1 off. Above `limit` that is a
/// fault, until all of it is paid off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Tolerance {
    /// Largest debt that is no fault.
    limit: u32,
}

impl Tolerance {
    /// What one irregularity costs: as many regular periods pay it off.
    pub const COST: u32 = 16;

    /// Four in a row, or one in 17 for ever.
    ///
    /// At 4 kHz four periods are 1 ms, the tenth part of [`PATIENCE`](trueaxis::PATIENCE). At
    /// 60 m/min a command of 1 ms ago is 1 mm away, and where a correction changes by 0.1 mm per
    /// metre it is wrong by 0.1 µm. Two clocks that differ by 1 % cost one in 100.
    pub const USUAL: Self = Self::in_a_row(4);

    /// `n` in a row; more than one in 17 is too much whatever `n` is.
    #[must_use]
    pub const fn in_a_row(n: u32) -> Self {
        Self {
            limit: n * Self::COST,
        }
    }
}

/// Takes frames as they come, and gives one command for each servo period.
#[derive(Clone, Copy, Debug)]
pub struct Intake<A> {
    tolerance: Tolerance,
    /// The last sound frame.
    last: Option<CommandFrame<A>>,
    /// It has come since the last period.
    fresh: bool,
    /// Periods without a new frame since the last one.
    waited: u32,
    debt: u32,
    seen: Regularity,
}

impl<const AXES: usize> Intake<[f32; AXES]> {
    /// Nothing has come yet.
    #[must_use]
    pub const fn new(tolerance: Tolerance) -> Self {
        Self {
            tolerance,
            last: None,
            fresh: false,
            waited: 0,
            debt: 0,
            seen: Regularity::NONE,
        }
    }

    /// Bytes have come from the motion side.
    pub fn hear(&mut self, bytes: &[u8]) {
        let Ok(said) = CommandFrame::get(bytes) else {
            self.seen.damaged = self.seen.damaged.wrapping_add(1);
            return;
        };
        if let Some(last) = self.last {
            let ahead = u32::from(said.count.wrapping_sub(last.count));
            if ahead == 0 {
                // The same once more.
                return;
            }
            // One for this period, and one for each that has gone by without.
            let passed = (ahead - 1).saturating_sub(self.waited) + u32::from(self.fresh);
            self.seen.skipped = self.seen.skipped.wrapping_add(passed);
            self.owe(passed);
        }
        self.last = Some(said);
        self.fresh = true;
        self.waited = 0;
    }

    /// The command of this period: to be called once in each.
    ///
    /// Without a new frame it is the one of the last, once more, as far as that is tolerated, and
    /// `None` beyond.
    pub fn take(&mut self) -> Option<Command<[f32; AXES]>> {
        let last = self.last?;
        if self.fresh {
            self.fresh = false;
            self.seen.frames = self.seen.frames.wrapping_add(1);
            self.debt = self.debt.saturating_sub(1);
            self.seen.fault = self.seen.fault && self.debt > 0;
            return Some(last.command);
        }
        self.waited = self.waited.saturating_add(1);
        self.seen.repeated = self.seen.repeated.wrapping_add(1);
        self.owe(1);
        (!self.seen.fault).then_some(last.command)
    }

    /// What has been counted.
    #[must_use]
    pub const fn seen(&self) -> Regularity {
        self.seen
    }

    /// Count of the command last taken, for the answer.
    #[must_use]
    pub fn count(&self) -> Option<u8> {
        self.last.map(|said| said.count)
    }

    fn owe(&mut self, times: u32) {
        let limit = self.tolerance.limit;
        // At most this much: however long it lasts, it is paid off as soon as the limit would be.
        let most = limit + Tolerance::COST;
        let debt = self.debt + times * Tolerance::COST;
        self.debt = debt.min(most);
        if self.debt > limit && !self.seen.fault {
            self.seen.fault = true;
            self.seen.faults = self.seen.faults.wrapping_add(1);
        }
    }
}

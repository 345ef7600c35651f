//! Turns frames into commands of servo periods, even if their numbers differ.

use super::frame::CommandFrame;
use crate::device::{Command, Regularity};

/// How many frames may be missing, damaged, or too many.
///
/// Every period without a new frame costs [`COST`](Self::COST), and so does every frame without a period of its own;
/// every period with a new frame pays 1 back. A debt above `limit` is a fault, until all of it is paid back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Tolerance {
    /// Largest debt that is not a fault.
    limit: u32,
}

impl Tolerance {
    /// Cost of one irregularity: this many regular periods pay it back.
    pub const COST: u32 = 16;

    /// Four in a row, or one in 17 permanently.
    ///
    /// At 4 kHz four periods are 1 ms, one tenth of [`PATIENCE`](trueaxis::PATIENCE). At 60 m/min a command that is 1
    /// ms old is 1 mm away, and if a correction changes by 0.1 mm per metre it is wrong by 0.1 µm. Two clocks that
    /// differ by 1 % cost one in 100.
    /// metre it is wrong by 0.1 µm. Two clocks that differ by 1 % cost one in 100.
    pub const USUAL: Self = Self::in_a_row(4);

    /// `n` in a row; more than one in 17 is always too many, whatever `n` is.
    #[must_use]
    pub const fn in_a_row(n: u32) -> Self {
        Self {
            limit: n * Self::COST,
        }
    }
}

/// Accepts frames as they arrive, and returns one command for each servo period.
#[derive(Clone, Copy, Debug)]
pub struct Intake<A> {
    tolerance: Tolerance,
    /// The last valid frame.
    last: Option<CommandFrame<A>>,
    /// It has arrived since the last period.
    fresh: bool,
    /// Number of periods since the last new frame.
    waited: u32,
    debt: u32,
    seen: Regularity,
}

impl<const AXES: usize> Intake<[f32; AXES]> {
    /// Nothing has been received yet.
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

    /// Processes bytes from the motion side.
    pub fn hear(&mut self, bytes: &[u8]) {
        let Ok(said) = CommandFrame::get(bytes) else {
            self.seen.damaged = self.seen.damaged.wrapping_add(1);
            return;
        };
        if let Some(last) = self.last {
            let ahead = u32::from(said.count.wrapping_sub(last.count));
            if ahead == 0 {
                // A repetition.
                return;
            }
            // One for this period, and one for each period that passed without a frame.
            let passed = (ahead - 1).saturating_sub(self.waited) + u32::from(self.fresh);
            self.seen.skipped = self.seen.skipped.wrapping_add(passed);
            self.owe(passed);
        }
        self.last = Some(said);
        self.fresh = true;
        self.waited = 0;
    }

    /// The command of this period; call it once per period.
    ///
    /// Without a new frame it repeats the last command as long as that is tolerated, and then returns `None`.
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

    /// Counts so far.
    #[must_use]
    pub const fn seen(&self) -> Regularity {
        self.seen
    }

    /// Counter of the last processed command, for the answer.
    #[must_use]
    pub fn count(&self) -> Option<u8> {
        self.last.map(|said| said.count)
    }

    fn owe(&mut self, times: u32) {
        let limit = self.tolerance.limit;
        // Limited, so that even after a long time the debt is paid back as fast as the limit would be.
        let most = limit + Tolerance::COST;
        let debt = self.debt + times * Tolerance::COST;
        self.debt = debt.min(most);
        if self.debt > limit && !self.seen.fault {
            self.seen.fault = true;
            self.seen.faults = self.seen.faults.wrapping_add(1);
        }
    }
}

//! Results of many drawings, and the claims about them.

use super::judged::NEAR;
use super::{Judged, Kinds, Outcome, TIMES};
use std::fmt;

/// The fraction of drawings that must meet the tolerance.
const MET: f64 = 0.95;
/// The fraction of drawings, all with measured motions, that may miss it by more than a factor of [`NEAR`]: where
/// rotary axes nearly depend on each other, a measured motion bends at each of its points by more than first-order
/// terms can follow (`docs/src/exact.md`, Limits).
const FAR: f64 = 0.01;
/// The finest tolerance (µm, µrad) for which this is claimed: finer ones may be missed, which is then reported.
const FINEST: f64 = 1.0;

const HARMED: &str = "are worse off on an axis than without tables";
const FALSELY: &str = "do not meet what the scheme says they meet";
const WORSE: &str = "are worse than with a coarser tolerance";

/// The number of drawings, in total and of each kind.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Counts {
    /// The requested tolerance (µm, µrad).
    pub tolerance: f64,
    /// Total number.
    pub all: usize,
    /// Number of each kind.
    pub kinds: Kinds,
    /// Drawings tested with each of the tolerances of [`TIMES`], and drawings that meet it.
    pub met: [[usize; 2]; TIMES.len()],
    /// Drawings within three times the requested tolerance.
    pub near: usize,
    /// Drawings beyond that, without measured motions.
    pub far_unmeasured: usize,
    /// Drawings with an axis that is worse than without tables, at any of the tolerances.
    pub harmed: usize,
    /// Drawings for which the scheme wrongly reports that this or a coarser tolerance is met.
    pub falsely: usize,
    /// Drawings that are worse than with a coarser tolerance, and miss their own.
    pub worse: usize,
    /// Drawings tested on the reference board, and those that meet the tolerance there.
    pub board: [usize; 2],
}

impl Counts {
    /// Counts the results.
    #[must_use]
    pub fn of(judged: &[Judged], tolerance: f64) -> Self {
        let count = |is: &dyn Fn(&Judged) -> bool| judged.iter().filter(|j| is(j)).count();
        let any = |is: fn(&Outcome) -> bool| count(&|j| j.outcomes.iter().any(is));
        let mut kinds = Kinds::default();
        for one in judged {
            kinds += one.kinds;
        }
        Self {
            tolerance,
            all: judged.len(),
            kinds,
            met: std::array::from_fn(|k| {
                [
                    count(&|j| j.outcome(k).is_some()),
                    count(&|j| j.outcome(k).is_some_and(Outcome::is_met)),
                ]
            }),
            near: count(&|j| !j.is_far()),
            far_unmeasured: count(&|j| j.is_far() && !j.kinds.has("tabulated")),
            harmed: any(Outcome::is_harmed),
            falsely: any(Outcome::is_false),
            worse: count(&Judged::is_worse_than_coarser),
            board: [
                count(&|j| j.board.is_some()),
                count(&|j| j.board.as_ref().is_some_and(Outcome::is_met)),
            ],
        }
    }

    /// Claims that do not hold.
    #[must_use]
    pub fn shortfalls(&self) -> Vec<String> {
        let claimed = self.tolerance >= FINEST;
        // Of thirty, one may miss, and none by far.
        let part = |share: f64| (share * self.all as f64 + 1e-9).floor() as usize;
        let (most, most_far) = (part(1.0 - MET), part(FAR));
        let missed = self.all - self.met[1][1];
        let far = self.all - self.near;
        let any = usize::MAX;
        let claims = [
            (
                missed,
                if claimed { most } else { any },
                "miss the tolerance",
            ),
            (
                self.far_unmeasured,
                if claimed { 0 } else { any },
                "have no measured motions and miss it by far",
            ),
            (far, if claimed { most_far } else { any }, "miss it by far"),
            (self.harmed, 0, HARMED),
            (self.falsely, 0, FALSELY),
            (self.worse, 0, WORSE),
        ];
        let broken = claims.into_iter().filter(|(count, most, _)| count > most);
        broken
            .map(|(count, most, what)| format!("{count} of {} {what}: at most {most}", self.all))
            .collect()
    }
}

impl fmt::Display for Counts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let all = self.all;
        writeln!(f, "{all} machines: {}", self.kinds)?;
        for (times, [tried, met]) in TIMES.iter().zip(self.met) {
            let tolerance = times * self.tolerance;
            writeln!(f, "{met:>4} of {tried} meet {tolerance} µm and µrad")?;
        }
        let near = format!("come within {NEAR} times {}", self.tolerance);
        for (count, what) in [
            (self.near, &*near),
            (self.harmed, HARMED),
            (self.falsely, FALSELY),
            (self.worse, WORSE),
        ] {
            writeln!(f, "{count:>4} {what}")?;
        }
        if self.board[0] > 0 {
            let [tried, met] = self.board;
            writeln!(
                f,
                "{met:>4} of {tried} meet {} on the stm32f405",
                self.tolerance
            )?;
        }
        Ok(())
    }
}

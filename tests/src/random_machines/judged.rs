//! One drawing with the tables that the scheme generates for it.

use super::{Case, Kinds, Measured, Places};
use std::fmt;
use std::time::{Duration, Instant};
use trueaxis_model::kinematics::Policy;
use trueaxis_tables::schemes::{Options, Scheme, find};
use trueaxis_tables::target::Target;

/// The tolerances with which a drawing is tested, as multiples of the requested one: a finer one, which is often
/// missed, and a coarser one. None of them may give a worse result than a coarser one.
pub const TIMES: [f64; 3] = [0.05, 1.0, 5.0];

/// Largest deviation that counts as a near miss, in tolerances.
pub const NEAR: f64 = 3.0;

/// Minimum number of inside positions, where the tolerance applies; with fewer, meeting it would mean little.
const LEAST_INSIDE: usize = 1000;

/// Result for one tolerance.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The requested tolerance (µm, µrad).
    pub tolerance: f64,
    /// The tolerance that the scheme reports as met.
    pub meets: Option<f64>,
    /// The measured result, or why there are no tables.
    pub measured: Result<Measured, String>,
    /// Number of tables and terms.
    pub size: [usize; 2],
    /// Run time of the scheme.
    pub elapsed: Duration,
}

impl Outcome {
    fn new(
        case: &Case,
        places: &Result<Places<'_>, String>,
        tolerance: f64,
        target: Target,
    ) -> Self {
        let options = Options {
            policy: Policy::Orientation,
            tolerance: 1e-3 * tolerance,
            target,
            ..Options::default()
        };
        let started = Instant::now();
        let found = find(&case.machine, &case.errors, &Scheme::default(), &options);
        let elapsed = started.elapsed();
        let (meets, size, measured) = match (&found, places) {
            (Ok(found), Ok(places)) => (
                found.meets.map(|m| 1e3 * m),
                size(&found.draft),
                places.measure(&found.draft),
            ),
            (Err(error), _) => (None, [0; 2], Err(error.to_string())),
            (_, Err(error)) => (None, [0; 2], Err(error.clone())),
        };
        Self {
            tolerance,
            meets,
            measured,
            size,
            elapsed,
        }
    }

    /// Largest deviation (µm, µrad) where the tolerance applies.
    #[must_use]
    pub fn reached(&self) -> f64 {
        self.measured.as_ref().map_or(f64::INFINITY, |m| m.reached)
    }

    /// True if the tolerance is met.
    #[must_use]
    pub fn is_met(&self) -> bool {
        self.reached() <= self.tolerance
    }

    /// True if some axis would be better off without tables.
    #[must_use]
    pub fn is_harmed(&self) -> bool {
        let harm = |m: &Measured| m.harm(self.tolerance);
        self.measured.as_ref().map_or(f64::INFINITY, harm) > 1.0
    }

    /// True if the scheme wrongly reports that a tolerance is met.
    #[must_use]
    pub fn is_false(&self) -> bool {
        // Tolerances were converted to mm and back.
        self.meets
            .is_some_and(|m| self.reached() > m * (1.0 + 1e-9))
    }
}

fn size(draft: &trueaxis::Draft) -> [usize; 2] {
    let tables = draft.banks.iter().map(|b| b.columns.len()).sum();
    [tables, draft.terms.len()]
}

/// Optional tests that take most of the time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// The finest tolerance.
    pub finest: bool,
    /// The reference board.
    pub board: bool,
}

/// All results of one drawing.
#[derive(Clone, Debug)]
pub struct Judged {
    /// Number of the drawing.
    pub seed: u64,
    /// Special features.
    pub kinds: Kinds,
    /// The tolerances of [`TIMES`], or all but the finest, on a controller with the maximum capacities; finer ones
    /// first.
    pub outcomes: Vec<Outcome>,
    /// The requested tolerance on the reference board, unless omitted.
    pub board: Option<Outcome>,
    line: String,
    /// Number of positions within one correction of a measured point, and number of those where the tolerance applies.
    places: [usize; 2],
}

impl Judged {
    /// Tests a drawing with [`TIMES`] a tolerance (µm, µrad), and with the tolerance itself on the reference board,
    /// unless the finest or the board is omitted.
    #[must_use]
    pub fn new(case: &Case, tolerance: f64, effort: Effort) -> Self {
        let places = Places::new(case).map_err(|e| e.to_string()).and_then(|p| {
            let inside = p.inside();
            let enough = inside >= LEAST_INSIDE;
            enough
                .then_some(p)
                .ok_or_else(|| format!("only {inside} positions are inside"))
        });
        let counted = places.as_ref().map_or([0; 2], |p| [p.near(), p.inside()]);
        let outcome = |tolerance, target| Outcome::new(case, &places, tolerance, target);
        let times = &TIMES[usize::from(!effort.finest)..];
        Self {
            seed: case.seed,
            kinds: Kinds::of(case),
            outcomes: times
                .iter()
                .map(|times| outcome(times * tolerance, Target::desktop()))
                .collect(),
            board: effort
                .board
                .then(|| outcome(tolerance, Target::stm32f405())),
            line: format!(
                "{:<12} {:>3} errors",
                case.machine.topology(),
                case.errors.parameters.len()
            ),
            places: counted,
        }
    }

    /// The result for one of [`TIMES`], by its index, if it was tested.
    #[must_use]
    pub fn outcome(&self, number: usize) -> Option<&Outcome> {
        let left_out = TIMES.len() - self.outcomes.len();
        number
            .checked_sub(left_out)
            .map(|number| &self.outcomes[number])
    }

    /// The result for the requested tolerance.
    #[must_use]
    pub fn asked(&self) -> &Outcome {
        &self.outcomes[self.outcomes.len() - 2]
    }

    /// True if the requested tolerance is missed by more than a factor of three.
    #[must_use]
    pub fn is_far(&self) -> bool {
        self.asked().reached() > NEAR * self.asked().tolerance
    }

    /// True if a tolerance is missed with a larger deviation than that of a coarser one.
    #[must_use]
    pub fn is_worse_than_coarser(&self) -> bool {
        self.outcomes.iter().enumerate().any(|(k, finer)| {
            let missed = !finer.is_met();
            let coarser = &self.outcomes[k + 1..];
            missed && coarser.iter().any(|c| finer.reached() > c.reached())
        })
    }

    /// Marks: its problems, or nothing if all is well.
    #[must_use]
    pub fn marks(&self) -> String {
        let any = |wrong: fn(&Outcome) -> bool| self.outcomes.iter().any(wrong);
        let asked = self.asked();
        let missed = !asked.is_met();
        let far = self.is_far();
        let marks = [
            (missed && !far, "missed"),
            (far, "FAR"),
            (any(Outcome::is_harmed), "HARMED"),
            (any(Outcome::is_false), "FALSE"),
            (self.is_worse_than_coarser(), "WORSE"),
        ];
        let marks = marks.iter().filter(|(is, _)| *is).map(|(_, mark)| *mark);
        marks.collect::<Vec<_>>().join(" ")
    }
}

impl fmt::Display for Judged {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:<7} {:>4} ", self.marks(), self.seed)?;
        for outcome in &self.outcomes {
            match &outcome.measured {
                Ok(measured) => write!(
                    f,
                    " {:>8.4} of {:<4} (said {:<4}) {:>3}/{:<4} {:>4.1}s",
                    measured.reached,
                    outcome.tolerance,
                    outcome.meets.map_or("none".to_owned(), short),
                    outcome.size[0],
                    outcome.size[1],
                    outcome.elapsed.as_secs_f64()
                )?,
                Err(error) => write!(f, " {error}")?,
            }
        }
        write!(f, "  {}  {}", self.line, self.kinds.names())?;
        match (&self.asked().measured, self.places) {
            (Ok(measured), [near, counted]) if near > 0 => write!(
                f,
                "; {:.4} at {near} of {} positions near measured points",
                measured.near,
                near + counted
            ),
            _ => Ok(()),
        }
    }
}

/// Removes rounding errors of the multiplication.
fn short(tolerance: f64) -> String {
    format!("{:.3}", tolerance)
        .trim_end_matches('0')
        .trim_end_matches('.')
        .to_owned()
}

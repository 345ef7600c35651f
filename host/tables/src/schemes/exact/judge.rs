//! From a draft to its largest error, in units of the tolerance: measures tables as the runtime evaluates them.

use super::fit::{Sample, fitted};
use super::positions::{End, JudgedPosition, Positions, SEED, moves, places, position};
use super::tolerance::Tolerance;
use crate::schemes::SchemeError;
use crate::size::Size;
use crate::target::Target;
use trueaxis::Draft;
use trueaxis_model::kinematics::{Jacobian, NotConverged};
use trueaxis_model::machine::{MAX_AXES, PerAxis};
use trueaxis_model::numbers::order;
use trueaxis_model::parallel;
use trueaxis_model::validate::Runtime;

/// Number of the positions of a confirmation, the worst failing ones, that are measured from then on.
const MOST_MISSED: usize = 1000;
/// Number of the worst positions from which worse corners are searched, and number of rounds over the inputs.
const CLIMBS: usize = 24;
const CLIMB_ROUNDS: usize = 4;
/// Number of positions of a fit per weight of an output, enough for it to hold elsewhere.
const FIT_SAMPLES: usize = 12;

/// Measures drafts for one tolerance.
pub struct Judge<'a> {
    positions: &'a Positions<'a>,
    tolerance: Tolerance,
    /// Positions at which a draft failed: those of the latest first. They are measured from then on.
    missed: Vec<JudgedPosition>,
    /// True once drafts are also measured at the positions of confirmation.
    is_confirming: bool,
    /// Further positions for fitting, used if there are many weights.
    further: Vec<JudgedPosition>,
}

/// The result of measuring a draft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// Largest deviation from the kinematic correction where no motion holds its end value, in units of the
    /// tolerance.
    pub error: f64,
    /// Largest deviation of any axis in the whole travel, divided by what is permitted: the larger of the tolerance
    /// and the largest correction of the axis. Above 1 the tables do harm.
    pub harm: f64,
}

impl Verdict {
    const NOTHING: Self = Self {
        error: 0.0,
        harm: 0.0,
    };

    fn worse(self, other: Self) -> Self {
        Self {
            error: self.error.max(other.error),
            harm: self.harm.max(other.harm),
        }
    }
}

/// The result of confirming a draft.
#[derive(Clone, Copy, Debug)]
pub struct Confirmation {
    /// True if the draft stays within the requested multiple of the tolerance.
    pub is_kept: bool,
    verdict: Verdict,
}

impl Confirmation {
    /// Merges this with an earlier verdict. If the draft stayed within the limit, the earlier figures remain,
    /// because here the limit was a little wider.
    pub(crate) fn added_to(self, before: Verdict) -> Verdict {
        Verdict {
            error: match self.is_kept {
                true => before.error,
                false => before.error.max(self.verdict.error),
            },
            harm: before.harm.max(self.verdict.harm),
        }
    }
}

impl<'a> Judge<'a> {
    /// Measures at these positions.
    pub fn new(positions: &'a Positions<'a>, tolerance: Tolerance) -> Self {
        Self {
            positions,
            tolerance,
            missed: Vec::new(),
            is_confirming: false,
            further: Vec::new(),
        }
    }

    /// The positions that are measured first.
    fn places(&self) -> impl Iterator<Item = &JudgedPosition> {
        self.missed.iter().chain(&self.positions.first)
    }

    /// The tolerance of each axis (mm, rad), the unit of errors.
    pub fn tolerance(&self) -> &PerAxis {
        &self.tolerance.axes
    }

    /// A deviation (mm, rad, one per axis) in units of the tolerance.
    pub fn share(&self, deviation: &PerAxis, jacobian: &Jacobian) -> f64 {
        self.tolerance.share(deviation, jacobian)
    }

    /// Measures a draft; `None` if a blob or the target cannot hold it.
    pub fn measure(&self, draft: &Draft, target: &Target) -> Option<Verdict> {
        let others = self.positions.others.get().filter(|_| self.is_confirming);
        let places = self.places().chain(others.into_iter().flatten()).collect();
        self.measure_at(places, draft, target, f64::INFINITY)
    }

    /// Measures a draft, without the positions that confirm good drafts. Also returns `None` if its error exceeds
    /// `most` tolerances.
    pub(crate) fn measure_first(
        &self,
        draft: &Draft,
        target: &Target,
        most: f64,
    ) -> Option<Verdict> {
        self.measure_at(self.places().collect(), draft, target, most)
    }

    fn measure_at(
        &self,
        places: Vec<&JudgedPosition>,
        draft: &Draft,
        target: &Target,
        most: f64,
    ) -> Option<Verdict> {
        let blob = draft.encode().ok()?;
        let runtime = Runtime::load(&blob).ok()?;
        if !target.shortages(&Size::of(&runtime)).is_empty() {
            return None;
        }
        let verdicts = parallel::try_map(&places, |place| {
            let verdict = self.at(place, &runtime);
            if verdict.error <= most {
                Ok(verdict)
            } else {
                Err(())
            }
        });
        let verdicts = verdicts.ok()?.into_iter();
        Some(verdicts.fold(Verdict::NOTHING, Verdict::worse))
    }

    /// Measures a draft at many more positions. Those where it exceeds the multiple of the tolerance are added to
    /// the ones measured first.
    pub(crate) fn confirm(
        &mut self,
        draft: &Draft,
        factor: f64,
    ) -> Result<Confirmation, SchemeError> {
        let others = self.positions.others()?;
        self.is_confirming = true;
        let blob = draft.encode();
        let Some(runtime) = blob.as_ref().ok().and_then(|b| Runtime::load(b).ok()) else {
            return Ok(Confirmation {
                is_kept: false,
                verdict: Verdict::NOTHING,
            });
        };
        let verdicts: Vec<Verdict> = parallel::map(others, |place| self.at(place, &runtime));
        let keys: Vec<f64> = verdicts.iter().map(|verdict| -verdict.error).collect();
        let order = order(&keys);
        let misses = |verdict: &Verdict| verdict.error > factor;
        let missed = order.iter().take_while(|i| misses(&verdicts[**i]));
        let missed = missed.take(MOST_MISSED).map(|i| others[*i].clone());
        let mut missed: Vec<JudgedPosition> = missed.collect();
        let mut worst = verdicts
            .iter()
            .copied()
            .fold(Verdict::NOTHING, Verdict::worse);
        let starts = order.iter().take(CLIMBS);
        let starts: Vec<_> = starts.map(|i| (verdicts[*i], others[*i].clone())).collect();
        let climbed = parallel::try_map(&starts, |(verdict, place)| {
            self.climb(*verdict, place.clone(), &runtime)
        })?;
        for (verdict, place) in climbed.into_iter().filter(|(v, _)| misses(v)) {
            worst = worst.worse(verdict);
            missed.push(place);
        }
        let is_kept = missed.is_empty();
        // Measured first from now on: a draft that fails there needs no further test.
        self.missed.splice(0..0, missed);
        Ok(Confirmation {
            is_kept,
            verdict: worst,
        })
    }

    /// Moves one input after the other, mostly to an end of its range, as long as the deviation grows. The worst
    /// corner is one of thousands and random positions may miss it.
    fn climb(
        &self,
        mut verdict: Verdict,
        mut place: JudgedPosition,
        runtime: &Runtime<'_>,
    ) -> Result<(Verdict, JudgedPosition), NotConverged> {
        let kinematics = &self.positions.kinematics;
        let axes = kinematics.machine.axes.len();
        let moves = moves(kinematics);
        for _ in 0..CLIMB_ROUNDS {
            let before = verdict.error;
            for &(input, end) in &moves {
                let mut command = place.command;
                match end {
                    End::Position(x) => *position(&mut command, axes, input) = x,
                    End::Travel(travel) => command.travel[input] = travel,
                }
                let next = self.positions.climbed_to(command)?;
                let found = self.at(&next, runtime);
                if found.error > verdict.error {
                    (verdict, place) = (found, next);
                }
            }
            if verdict.error == before {
                break;
            }
        }
        Ok((verdict, place))
    }

    /// The draft with fitted weights. The fit uses the positions at which it is measured and some of those at which
    /// it is confirmed, and further ones if there are many weights. The remaining confirmation positions show
    /// whether the fit was right.
    pub fn fitted(&mut self, draft: &Draft) -> Result<Option<Draft>, SchemeError> {
        let positions = self.positions;
        let others = positions.others()?;
        self.is_confirming = true;
        let wanted = FIT_SAMPLES * most_terms(draft);
        let have = self.places().count() + others.len() / 3 + self.further.len();
        if wanted > have {
            let seed = SEED.rotate_left(7) ^ have as u64;
            let more = places(&positions.kinematics, &positions.zero, wanted - have, seed)?;
            self.further.extend(more);
        }
        let machine = positions.kinematics.machine;
        let places = self.places().chain(others.iter().step_by(3));
        let samples: Vec<Sample> = places
            .chain(&self.further)
            .filter(|place| !place.holds)
            .map(|place| Sample {
                command: place.command,
                wanted: machine.to_command(&place.correction),
            })
            .collect();
        Ok(fitted(
            draft,
            &samples,
            &machine.to_command(self.tolerance()),
        ))
    }

    /// Measures tables at one position.
    fn at(&self, place: &JudgedPosition, runtime: &Runtime<'_>) -> Verdict {
        let machine = self.positions.kinematics.machine;
        let table = runtime.evaluate(&place.command).map(f64::from);
        let table = machine.to_kinematic(&table);
        let deviation = std::array::from_fn(|i| table[i] - place.correction[i]);
        let mut harm = 0.0_f64;
        for (i, deviation) in deviation.iter().enumerate().take(machine.axes.len()) {
            let most = self.tolerance.axes[i].max(self.positions.largest[i]);
            harm = harm.max(deviation.abs() / most);
        }
        Verdict {
            error: if place.holds {
                0.0
            } else {
                self.tolerance.share(&deviation, &place.jacobian)
            },
            harm,
        }
    }
}

/// The number of terms of the output that has most.
fn most_terms(draft: &Draft) -> usize {
    let mut counts = [0; MAX_AXES];
    for term in &draft.terms {
        counts[usize::from(term.output)] += 1;
    }
    counts.into_iter().max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::super::specimen::{errors, with_rotary};
    use super::*;
    use crate::schemes::blank::blank;
    use trueaxis::Term;
    use trueaxis_model::kinematics::Kinematics;
    use trueaxis_model::validate::Command;

    #[test]
    fn nothing_does_no_harm_and_the_wrong_sign_does() {
        let machine = with_rotary(&[('A', [-60.0, 60.0])]);
        let errors = errors(&machine, "[parameters]\nEX0A = 20e-3\nEB0A = 40e-6\n");
        let kinematics = Kinematics::new(&machine, &errors);
        let tolerance = Tolerance::new(&kinematics, 1e-3);
        let positions = Positions::new(&kinematics, PerAxis::default()).unwrap();
        let judge = Judge::new(&positions, tolerance);
        let mut draft = blank(&kinematics);
        let target = Target::default();
        let nothing = judge.measure(&draft, &target).unwrap();
        assert_eq!(nothing.harm, 1.0);
        assert!(nothing.error >= 20.0);
        // The table is 20 µm too far in X, so the tool must be too.
        for (weight, harmless) in [(0.02, true), (-0.02, false)] {
            draft.terms = vec![Term {
                output: 0,
                weight,
                limits: None,
                factors: [].into_iter().collect(),
            }];
            let verdict = judge.measure(&draft, &target).unwrap();
            assert_eq!(verdict.harm <= 1.0, harmless, "{verdict:?}");
        }
    }

    #[test]
    fn the_worst_corner_is_found_and_remembered() {
        let machine = with_rotary(&[('A', [-60.0, 60.0])]);
        let errors = errors(&machine, "[parameters]\nEAX1 = 1e-7\nEX0A = 1e-3\n");
        let kinematics = Kinematics::new(&machine, &errors);
        let tolerance = Tolerance::new(&kinematics, 1e-3);
        let positions = Positions::new(&kinematics, PerAxis::default()).unwrap();
        let mut judge = Judge::new(&positions, tolerance);
        let draft = blank(&kinematics);
        let blob = draft.encode().unwrap();
        let runtime = Runtime::load(&blob).unwrap();
        // The error grows towards the ends of several axes at the same time.
        let at = |axes: &[f64]| {
            let command = Command::at(&machine, axes);
            let place = JudgedPosition::inside(&kinematics, &positions.zero, command).unwrap();
            (judge.at(&place, &runtime), place)
        };
        let (start, place) = at(&[10.0, 20.0, -30.0, 5.0]);
        let (worst, corner) = judge.climb(start, place, &runtime).unwrap();
        let (error, worst) = (start.error, worst.error);
        let corners = (0..16).map(|bits| {
            let end = |i: usize, range: f64| if bits >> i & 1 == 1 { range } else { -range };
            at(&[end(0, 200.0), end(1, 200.0), end(2, 200.0), end(3, 60.0)])
                .0
                .error
        });
        let most = corners.fold(0.0, f64::max);
        assert!(worst > 2.0 * error && worst >= most, "{worst} {most}");
        assert!(!corner.holds);
        // Positions where the tables exceed the limit are measured from then on.
        assert!(judge.confirm(&draft, most * 1.01).unwrap().is_kept);
        let before = judge.places().count();
        assert!(!judge.confirm(&draft, most * 0.9).unwrap().is_kept);
        assert!(judge.places().count() > before);
    }

    #[test]
    fn what_the_target_cannot_hold_is_not_measured() {
        let machine = with_rotary(&[]);
        let errors = errors(&machine, "");
        let kinematics = Kinematics::new(&machine, &errors);
        let positions = Positions::new(&kinematics, PerAxis::default()).unwrap();
        let judge = Judge::new(&positions, Tolerance::new(&kinematics, 1.0));
        let draft = blank(&kinematics);
        let mut target = Target::default();
        assert!(judge.measure(&draft, &target).is_some());
        target.bytes = Some(16);
        assert!(judge.measure(&draft, &target).is_none());
    }
}

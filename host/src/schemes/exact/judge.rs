//! What tables do, measured as the runtime evaluates them.

use super::limits::{CONFIRMED, JUDGED, MOST_MISSED};
use crate::errors::Switches;
use crate::kinematics::{Kinematics, NotConverged};
use crate::machine::PerAxis;
use crate::schemes::SchemeError;
use crate::size::Size;
use crate::target::Target;
use crate::validate::{Command, Region, Runtime, holds, random_commands};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use trueaxis::Draft;

/// Seeds of the positions; those of a proof are others.
const SEED: u64 = 0x6a75_6467;

/// Positions with their exact corrections.
pub struct Judge<'a> {
    kinematics: &'a Kinematics<'a>,
    tolerance: PerAxis,
    /// The correction at the zero position (mm, rad).
    zero: PerAxis,
    places: Vec<Place>,
    /// Positions that only what is good so far is measured at, once there is any.
    others: Vec<Place>,
    /// Largest correction of each axis (mm, rad).
    largest: PerAxis,
}

#[derive(Clone)]
struct Place {
    command: Command,
    /// The exact correction (mm, rad), less that of the zero position.
    correction: PerAxis,
    /// True if a motion holds its end value here: tables cannot follow its bend.
    holds: bool,
}

/// What was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// Largest deviation from the kinematic correction where no motion holds, in units of the
    /// tolerance.
    pub error: f64,
    /// Largest deviation of any axis anywhere in the travel, in units of what it may be: the larger
    /// of the tolerance and the axis' largest correction. Above 1 the tables do harm.
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

impl<'a> Judge<'a> {
    /// Draws the positions: over the travel, and where no motion holds; half of them with axes at
    /// their ends, where most functions are largest.
    pub fn new(
        kinematics: &'a Kinematics<'a>,
        tolerance: PerAxis,
        zero: PerAxis,
    ) -> Result<Self, SchemeError> {
        let places = places(kinematics, &zero, JUDGED, SEED)?;
        let largest = std::array::from_fn(|i| {
            let sizes = places.iter().map(|p| p.correction[i].abs());
            sizes.fold(0.0, f64::max)
        });
        Ok(Self {
            kinematics,
            tolerance,
            zero,
            places,
            others: Vec::new(),
            largest,
        })
    }

    /// The tolerance of each axis (mm, rad) in whose units errors are.
    pub fn tolerance(&self) -> &PerAxis {
        &self.tolerance
    }

    /// The part of a correction that does not count: a little of the tolerance, seen from the
    /// largest correction.
    pub fn smallest_part(&self) -> f64 {
        let sizes = self.largest.iter().zip(&self.tolerance).map(|(l, t)| l / t);
        0.02 / sizes.fold(1.0, f64::max)
    }

    /// Measures a draft; `None` if a blob or the target cannot hold it.
    pub fn measure(&self, draft: &Draft, target: &Target) -> Option<Verdict> {
        let blob = draft.encode().ok()?;
        let runtime = Runtime::load(&blob).ok()?;
        if !target.shortages(&Size::of(&runtime)).is_empty() {
            return None;
        }
        let places = self.places.par_iter();
        let found = places.map(|place| self.at(place, &runtime));
        Some(found.reduce(|| Verdict::NOTHING, Verdict::worse))
    }

    /// True if a draft keeps a multiple of the tolerance at many more positions than it was measured
    /// at. If not, those where it does not are among these from now on.
    pub fn confirms(&mut self, draft: &Draft, factor: f64) -> Result<bool, SchemeError> {
        if self.others.is_empty() {
            self.others = places(self.kinematics, &self.zero, CONFIRMED, !SEED)?;
        }
        let blob = draft.encode();
        let Some(runtime) = blob.as_ref().ok().and_then(|b| Runtime::load(b).ok()) else {
            return Ok(false);
        };
        let errors: Vec<f64> = self
            .others
            .par_iter()
            .map(|place| self.at(place, &runtime).error)
            .collect();
        let mut missed: Vec<usize> = (0..errors.len()).filter(|i| errors[*i] > factor).collect();
        missed.sort_by(|a, b| errors[*b].total_cmp(&errors[*a]));
        missed.truncate(MOST_MISSED);
        let places = missed.iter().map(|i| self.others[*i].clone());
        self.places.extend(places);
        Ok(missed.is_empty())
    }

    /// Measures tables at one position.
    fn at(&self, place: &Place, runtime: &Runtime<'_>) -> Verdict {
        let machine = self.kinematics.machine;
        let table = runtime.evaluate(&place.command).map(f64::from);
        let table = machine.to_kinematic(&table);
        let mut verdict = Verdict::NOTHING;
        for i in 0..machine.axes.len() {
            let deviation = (table[i] - place.correction[i]).abs();
            if !place.holds {
                verdict.error = verdict.error.max(deviation / self.tolerance[i]);
            }
            let most = self.tolerance[i].max(self.largest[i]);
            verdict.harm = verdict.harm.max(deviation / most);
        }
        verdict
    }
}

/// Draws positions with their exact corrections: a quarter of them over the travel, the others where
/// no motion holds; half of them with axes at their ends, where most functions are largest.
fn places(
    kinematics: &Kinematics<'_>,
    zero: &PerAxis,
    count: usize,
    seed: u64,
) -> Result<Vec<Place>, SchemeError> {
    let (machine, errors) = (kinematics.machine, kinematics.errors);
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut commands = Vec::new();
    for (region, count) in [(Region::Travel, count / 3), (Region::Inside, count)] {
        let drawn = random_commands(machine, errors, region, count, seed ^ count as u64)?;
        commands.extend(drawn.into_iter().enumerate().map(|(number, mut command)| {
            // Some axes at an end, or every one: corners are where most add up.
            match number % 4 {
                0 => to_ends(kinematics, &mut command, region, &mut random, 4),
                1 => to_ends(kinematics, &mut command, region, &mut random, 2),
                _ => {}
            }
            command
        }));
    }
    let places: Result<Vec<Place>, NotConverged> = commands
        .into_par_iter()
        .map(|command| {
            let (q, situation) = command.kinematic(machine);
            let exact = kinematics.correction(&q, &situation, &Switches::ALL)?.dq;
            Ok(Place {
                command,
                correction: std::array::from_fn(|i| exact[i] - zero[i]),
                holds: holds(machine, errors, &q, &exact),
            })
        })
        .collect();
    Ok(places?)
}

/// Moves two in `of` of the axes, of tool length and of temperatures to an end of their range.
fn to_ends(
    kinematics: &Kinematics<'_>,
    command: &mut Command,
    region: Region,
    random: &mut Pcg64Mcg,
    of: u32,
) {
    let (machine, errors) = (kinematics.machine, kinematics.errors);
    // Just inside, where motions do not hold yet.
    let inset = if region == Region::Inside { 2e-3 } else { 0.0 };
    let mut end = |x: &mut f32, [low, high]: [f64; 2]| {
        let margin = inset * (high - low);
        match random.random_range(0..of) {
            0 => *x = (low + margin) as f32,
            1 => *x = (high - margin) as f32,
            _ => {}
        }
    };
    for (i, (q, axis)) in command.axes.iter_mut().zip(&machine.axes).enumerate() {
        let [mut low, mut high] = axis.travel;
        if region == Region::Inside && errors.motions[i].iter().any(|m| m.holds()) {
            let [from, to] = crate::validate::calibrated(machine, errors, i);
            (low, high) = (low.max(from), high.min(to));
        }
        end(q, [low, high]);
    }
    let with_length = usize::from(machine.length_range.is_some());
    if let Some(range) = machine.length_range {
        end(&mut command.auxiliaries[0], range);
    }
    for (k, sensor) in errors.sensors.iter().enumerate() {
        end(
            &mut command.auxiliaries[with_length + k],
            sensor.range_kelvin,
        );
    }
}

#[cfg(test)]
mod tests {
    use super::super::draft::empty;
    use super::super::specimen::{errors, with_rotary};
    use super::super::variables::variables;
    use super::*;
    use trueaxis::Term;

    #[test]
    fn nothing_does_no_harm_and_the_wrong_sign_does() {
        let machine = with_rotary(&[('A', [-60.0, 60.0])]);
        let errors = errors(&machine, "[parameters]\nEX0A = 20e-3\nEB0A = 40e-6\n");
        let kinematics = Kinematics::new(&machine, &errors);
        let tolerance = [1e-3, 1e-3, 1e-3, 1e-6, 1e-6, 1e-6];
        let judge = Judge::new(&kinematics, tolerance, PerAxis::default()).unwrap();
        let mut draft = empty(&machine, &errors, &variables(&kinematics, 1e-6));
        let target = Target::default();
        let nothing = judge.measure(&draft, &target).unwrap();
        assert_eq!(nothing.harm, 1.0);
        assert!(nothing.error >= 20.0);
        // The table is 20 µm too far in X, and so must the tool be.
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
    fn what_the_target_cannot_hold_is_not_measured() {
        let machine = with_rotary(&[]);
        let errors = errors(&machine, "");
        let kinematics = Kinematics::new(&machine, &errors);
        let judge = Judge::new(&kinematics, [1e-3; 6], PerAxis::default()).unwrap();
        let draft = empty(&machine, &errors, &variables(&kinematics, 1e-6));
        let mut target = Target::default();
        assert!(judge.measure(&draft, &target).is_some());
        target.bytes = Some(16);
        assert!(judge.measure(&draft, &target).is_none());
    }
}

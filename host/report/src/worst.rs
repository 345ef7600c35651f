//! Searches the largest errors over the travel and their positions.

use super::volumetric::applied;
use super::{ReportError, Subject, Volumetric};
use serde::{Deserialize, Serialize};
use trueaxis::Travel;
use trueaxis_model::errors::{ErrorModel, Switches};
use trueaxis_model::kinematics::{Kinematics, Twist};
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_model::numbers::by;
use trueaxis_model::parallel;
use trueaxis_model::uncertainty::Uncertain;
use trueaxis_model::validate::{Command, Quality, Region, direction, random_commands};
use trueaxis_tables::compile::seed_over_travel;

/// Rounds of a search, with the fraction of an axis that each covers on both sides: twice the whole axis, because
/// the others have moved in between, then closer.
const ROUNDS: [f64; 4] = [1.0, 1.0, 0.07, 0.005];
/// Number of steps along each axis per round.
const STEPS: u32 = 16;
/// Values that exceed another one by less than this fraction are equal: the last bit of a mathematical library must
/// not decide.
const LARGER: f64 = 1e-9;
/// Number of positions from which a maximum is searched.
const STARTS: usize = 3;
/// Number of random positions for a search if evaluations are slow or many errors are evaluated.
pub(crate) const FEW: usize = 500;
/// Number of places listed.
const LISTED: usize = 6;
/// Places closer than this fraction of the travel along every axis count as one.
const NEAR: f64 = 0.25;

/// Where the error of the tip is largest.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Worst {
    /// Without correction; the worst first, none close to another.
    pub before: Vec<ErrorAt>,
    /// Like `before`, with the tables; empty if there are none.
    pub after: Vec<ErrorAt>,
}

/// The error at a position.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorAt {
    /// Positions of the axes (mm, deg).
    pub position: Vec<f64>,
    /// Direction from which each axis arrived: 1 from below, −1 from above, 0 if it does not matter.
    pub direction: Vec<i8>,
    /// Tool length (mm) if it is an input, then temperatures (K from their reference).
    pub auxiliaries: Vec<f64>,
    /// Error at the tip.
    pub tip_um: f64,
    /// Error of the tool direction.
    pub direction_urad: f64,
}

/// The error to maximize.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Of {
    /// At the tip (mm).
    Tip,
    /// Of the tool direction (rad).
    Direction,
}

impl Of {
    fn size(self, machine: &Machine, error: &Twist) -> f64 {
        match self {
            Self::Tip => error.t.norm(),
            Self::Direction => direction(machine, error),
        }
    }
}

/// An error at a command.
pub type RemainingError<'a> = dyn Fn(&Command, Of) -> f64 + Sync + 'a;

/// Searches the largest errors, which become the maxima of the figures at random positions.
pub fn worst(subject: &Subject<'_>, found: &mut Volumetric) -> Result<Worst, ReportError> {
    let (machine, errors) = (subject.machine, subject.errors);
    let kinematics = Kinematics::new(machine, errors).with_policy(subject.policy);
    // The positions over which the means are taken.
    let seed = match subject.compensation {
        Some(_) => seed_over_travel(subject.seed),
        None => subject.seed,
    };
    let commands = random_commands(&kinematics, Region::Travel, found.positions, seed)?;
    let few = &commands[..FEW.min(commands.len())];
    let zero = subject.subtracted.zero(machine, errors)?;
    let search = WorstSearch { machine, errors };
    let with = |command: &Command, dq: &PerAxis, of: Of| {
        let (q, situation) = command.kinematic(machine);
        of.size(machine, &kinematics.volumetric_error(&q, dq, &situation))
    };
    let before = |command: &Command, of: Of| with(command, &zero, of);
    let mut worst = Worst {
        before: search.places(&mut found.before, &commands, &before),
        after: Vec::new(),
    };
    if let Some(after) = &mut found.after {
        let left = |command: &Command, of: Of| with(command, &applied(subject, &zero, command), of);
        worst.after = search.places(after, &commands, &left);
    }
    if let Some(best) = &mut found.kinematic {
        let left = |command: &Command, of: Of| {
            let (q, situation) = command.kinematic(machine);
            let exact = kinematics.correction(&q, &situation, &Switches::ALL);
            // Without a correction there is nothing that it leaves.
            exact.map_or(0.0, |exact| with(command, &exact.dq, of))
        };
        search.raise(best, few, &left);
    }
    if let Some(known) = &mut found.known {
        search.raise_coverage(&mut known.coverage, few);
    }
    Ok(worst)
}

/// A search over all inputs of a command: positions, directions of travel, tool length, temperatures.
pub struct WorstSearch<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// Errors, which include the temperature sensors.
    pub errors: &'a ErrorModel,
}

/// An error, and the command at which it is.
type Sized = (f64, Command);

impl WorstSearch<'_> {
    /// Raises the maxima to those found by a search from the worst of `commands`.
    pub fn raise(&self, found: &mut Quality, commands: &[Command], left: &RemainingError<'_>) {
        for of in [Of::Tip, Of::Direction] {
            self.raise_of(of, found, commands, left);
        }
    }

    /// Raises the maxima of what uncertain parameters leave.
    fn raise_coverage(&self, coverage: &mut Quality, commands: &[Command]) {
        let covariance = self.errors.covariance();
        let uncertain = Uncertain::new(self.machine, self.errors, &covariance);
        let left = |command: &Command, of: Of| {
            let (q, situation) = command.kinematic(self.machine);
            let leaves = uncertain.leaves(&q, &situation);
            match of {
                Of::Tip => leaves.tip_band(),
                Of::Direction => leaves.direction_band(),
            }
        };
        self.raise(coverage, commands, &left);
    }

    /// Raises one of the two maxima.
    fn raise_of(
        &self,
        of: Of,
        found: &mut Quality,
        commands: &[Command],
        left: &RemainingError<'_>,
    ) {
        let all = self.climbed(&sized(commands, left, of), STARTS, left, of);
        raise(found, of, all.first());
    }

    /// Raises the maxima, and lists the worst positions for the tip, none close to another.
    fn places(
        &self,
        found: &mut Quality,
        commands: &[Command],
        left: &RemainingError<'_>,
    ) -> Vec<ErrorAt> {
        self.raise_of(Of::Direction, found, commands, left);
        let all = sized(commands, left, Of::Tip);
        let climbed = self.climbed(&all, LISTED, left, Of::Tip);
        raise(found, Of::Tip, climbed.first());
        let chosen = self.apart(climbed.iter().chain(&all), LISTED);
        chosen
            .iter()
            .map(|place| self.place(place.1, left))
            .collect()
    }

    /// The first `count` of them of which none is close to another.
    fn apart<'s>(&self, all: impl Iterator<Item = &'s Sized>, count: usize) -> Vec<Sized> {
        let mut chosen: Vec<Sized> = Vec::new();
        for one in all {
            if chosen.len() == count {
                break;
            }
            if !chosen.iter().any(|other| self.is_near(&other.1, &one.1)) {
                chosen.push(*one);
            }
        }
        chosen
    }

    fn is_near(&self, a: &Command, b: &Command) -> bool {
        let axes = self.machine.axes.iter();
        let mut both = axes.zip(a.axes.iter().zip(&b.axes));
        both.all(|(axis, (a, b))| {
            f64::from((a - b).abs()) < NEAR * (axis.travel[1] - axis.travel[0])
        })
    }

    fn place(&self, mut command: Command, left: &RemainingError<'_>) -> ErrorAt {
        let axes = self.machine.axes.len();
        let errors = |command: &Command| [Of::Tip, Of::Direction].map(|of| left(command, of));
        let here = errors(&command);
        for axis in 0..axes {
            let mut unknown = command;
            unknown.travel[axis] = Travel::Unknown;
            if errors(&unknown) == here {
                command = unknown;
            }
        }
        let whence = |travel: &Travel| match travel {
            Travel::Positive => 1,
            Travel::Negative => -1,
            Travel::Unknown => 0,
        };
        ErrorAt {
            position: command.axes[..axes]
                .iter()
                .copied()
                .map(f64::from)
                .collect(),
            direction: command.travel[..axes].iter().map(whence).collect(),
            auxiliaries: (self.auxiliaries().zip(command.auxiliaries))
                .map(|(_, value)| f64::from(value))
                .collect(),
            tip_um: here[0] * 1e3,
            direction_urad: here[1] * 1e6,
        }
    }

    /// Ranges of tool length and temperatures, if they are inputs.
    fn auxiliaries(&self) -> impl Iterator<Item = [f64; 2]> {
        let sensors = self.errors.sensors.iter().map(|sensor| sensor.range_kelvin);
        self.machine.length_range.into_iter().chain(sensors)
    }

    /// Some of the worst, none close to another, each improved by a climb; the worst first.
    fn climbed(
        &self,
        all: &[Sized],
        starts: usize,
        left: &RemainingError<'_>,
        of: Of,
    ) -> Vec<Sized> {
        let starts = self.apart(all.iter(), starts);
        let climb = |start: &Sized| self.climb(*start, &|command| left(command, of));
        sorted(parallel::map(&starts, climb))
    }

    /// Climbs from a command to a larger error, one input after the other.
    fn climb(&self, start: Sized, size: &dyn Fn(&Command) -> f64) -> Sized {
        let axes = self.machine.axes.iter().map(|axis| axis.travel);
        let ranges: Vec<[f64; 2]> = axes.chain(self.auxiliaries()).collect();
        let count = self.machine.axes.len();
        let mut best = start;
        let take = |command: Command, best: &mut Sized| {
            let found = size(&command);
            if found > best.0 * (1.0 + LARGER) {
                *best = (found, command);
            }
        };
        for part in ROUNDS {
            for (input, range) in ranges.iter().enumerate() {
                let mut command = best.1;
                for value in around(*value(&mut command, count, input), *range, part) {
                    *self::value(&mut command, count, input) = value;
                    take(command, &mut best);
                }
            }
            for axis in 0..count {
                for travel in [Travel::Positive, Travel::Negative] {
                    let mut command = best.1;
                    command.travel[axis] = travel;
                    take(command, &mut best);
                }
            }
        }
        best
    }
}

fn raise(found: &mut Quality, of: Of, worst: Option<&Sized>) {
    let (statistics, factor) = match of {
        Of::Tip => (&mut found.translation_um, 1e3),
        Of::Direction => (&mut found.direction_urad, 1e6),
    };
    statistics.max = worst
        .map_or(0.0, |(size, _)| size * factor)
        .max(statistics.max);
}

/// An input of a command: an axis, or one of the auxiliaries.
fn value(command: &mut Command, axes: usize, input: usize) -> &mut f32 {
    match input.checked_sub(axes) {
        None => &mut command.axes[input],
        Some(other) => &mut command.auxiliaries[other],
    }
}

/// Values around a value, by a fraction of the range to both sides, as rounded by the runtime and limited to the
/// range.
fn around(here: f32, [low, high]: [f64; 2], part: f64) -> impl Iterator<Item = f32> {
    let half = part * (high - low);
    let (from, to) = (
        (f64::from(here) - half).max(low),
        (f64::from(here) + half).min(high),
    );
    (0..=STEPS).map(move |k| {
        let value = from + (to - from) * f64::from(k) / f64::from(STEPS);
        (value as f32).max(low as f32).min(high as f32)
    })
}

/// Commands with their errors, the largest first.
fn sized(commands: &[Command], left: &RemainingError<'_>, of: Of) -> Vec<Sized> {
    sorted(parallel::map(commands, |c| (left(c, of), *c)))
}

/// Sorts by size, largest first; those that differ by less than 1e-9 mm or rad keep their order.
fn sorted(all: Vec<Sized>) -> Vec<Sized> {
    by(all, |(size, _)| -(size * 1e9).round())
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueaxis_model::errors::Parameter;

    /// The mill with given errors.
    fn subject(parameters: &[(&str, f64)]) -> (Machine, ErrorModel) {
        let text = include_str!("../../../examples/mill-21/machine.toml");
        let machine = Machine::from_toml(text).unwrap();
        let mut errors = ErrorModel::perfect(&machine);
        for (name, value) in parameters {
            assert!(errors.set(&machine, Parameter::parse(name).unwrap(), *value));
        }
        (machine, errors)
    }

    #[test]
    fn the_worst_place_of_three_scales_is_a_corner_of_the_travel() {
        let scales = [("EXX1", 20e-6), ("EYY1", 30e-6), ("EZZ1", -10e-6)];
        let (machine, errors) = subject(&scales);
        let subject = Subject::new(&machine, &errors, None, 1);
        let mut found = super::super::volumetric::volumetric(&subject, &mut Vec::new()).unwrap();
        let at_random = found.before.translation_um.max;
        let worst = worst(&subject, &mut found).unwrap();
        let most = |letter: char| {
            let [low, high] = machine.axes[machine.index(letter).unwrap()].travel;
            low.abs().max(high.abs())
        };
        let way = ['X', 'Y', 'Z'].map(most);
        let corner = libm::hypot(libm::hypot(0.02 * way[0], 0.03 * way[1]), 0.01 * way[2]);
        let max = found.before.translation_um.max;
        // Ends of the travel are whole numbers, exact in f32; the rest is rounding of positions of 1 m.
        assert!((max - corner).abs() < 1e-8, "{max} {corner}");
        assert!(max > at_random);
        assert_eq!(worst.before[0].tip_um, max);
        for (axis, at) in machine.axes.iter().zip(&worst.before[0].position) {
            assert!(axis.travel.contains(at), "{}: {at}", axis.letter);
        }
        assert_eq!(worst.before[0].direction, [0; 3]);
        assert!(worst.before.is_sorted_by(|a, b| a.tip_um >= b.tip_um));
        assert!(worst.after.is_empty());
    }

    #[test]
    fn whence_axes_have_come_is_said_where_it_matters() {
        let (machine, errors) = subject(&[("EXX1", 20e-6), ("EXXb", 5e-3)]);
        let subject = Subject::new(&machine, &errors, None, 1);
        let mut found = super::super::volumetric::volumetric(&subject, &mut Vec::new()).unwrap();
        let worst = worst(&subject, &mut found).unwrap();
        let x = machine.index('X').unwrap();
        let place = &worst.before[0];
        for (axis, direction) in place.direction.iter().enumerate() {
            assert_eq!(*direction != 0, axis == x, "{place:?}");
        }
        let expected = 0.02 * place.position[x].abs() + 5.0;
        // Rounding of positions of 1 m.
        assert!((place.tip_um - expected).abs() < 1e-8, "{place:?}");
    }
}

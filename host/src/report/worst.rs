//! The largest errors over the travel, as a search finds them, and where.

use super::{ReportError, Subject, Volumetric};
use crate::compile::seed_over_travel;
use crate::errors::{ErrorModel, Switches};
use crate::kinematics::Kinematics;
use crate::machine::{Machine, PerAxis};
use crate::uncertainty::Uncertain;
use crate::validate::{Command, Quality, Region, Statistics, direction, random_commands};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use trueaxis::Travel;

/// Random positions from the worst of which a search goes on.
const STARTS: usize = 8;
/// Rounds, and how much of an axis to both sides each looks at: all of it, once more after the others have moved, then
/// closer.
const ROUNDS: [f64; 4] = [1.0, 1.0, 0.07, 0.005];
/// Steps of a round along each axis.
const STEPS: u32 = 16;
/// What is not larger by this part is no larger: the last bit of a mathematical library must not decide.
const LARGER: f64 = 1e-9;
/// Random positions at which it is looked for what takes long.
const FEW: usize = 2000;
/// Places that are listed.
const LISTED: usize = 6;
/// Places that are nearer than this part of the travel, along every axis, are one.
const NEAR: f64 = 0.25;

/// Where the tip is farthest off.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Worst {
    /// Without correction, the worst first, none near another.
    pub before: Vec<Place>,
    /// The same with the tables; empty if there are none.
    pub after: Vec<Place>,
}

/// A place, and the error there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Positions of the axes (mm, deg).
    pub position: Vec<f64>,
    /// Whence each axis has come: 1 from below, −1 from above, 0 if it does not matter.
    pub direction: Vec<i8>,
    /// Tool length (mm) if it is an input, then temperatures (K from their reference).
    pub auxiliaries: Vec<f64>,
    /// Error of the tip.
    pub tip_um: f64,
    /// Error of the tool's direction.
    pub direction_urad: f64,
}

/// Errors of the tip (mm) and of the tool's direction (rad) at a command.
type Left<'a> = dyn Fn(&Command) -> [f64; 2] + Sync + 'a;

/// Looks for the largest errors: they become the maxima of what is known at random positions.
pub fn worst(subject: &Subject<'_>, found: &mut Volumetric) -> Result<Worst, ReportError> {
    let (machine, errors) = (subject.machine, subject.errors);
    let kinematics = Kinematics::new(machine, errors).with_policy(subject.policy);
    // Those that the means are of.
    let seed = match subject.compensation {
        Some(_) => seed_over_travel(subject.seed),
        None => subject.seed,
    };
    let commands = random_commands(&kinematics, Region::Travel, found.positions, seed)?;
    let few = &commands[..FEW.min(commands.len())];
    let zero = subject.subtracted.zero(machine, errors)?;
    let search = Search { machine, errors };
    let with = |command: &Command, dq: &PerAxis| {
        let (q, situation) = command.kinematic(machine);
        let error = kinematics.volumetric_error(&q, dq, &situation);
        [error.t.norm(), direction(machine, &error)]
    };
    let before = |command: &Command| with(command, &zero);
    let mut worst = Worst {
        before: search.places(&commands, &before),
        after: Vec::new(),
    };
    search.raise(&mut found.before, &commands, &before);
    if let (Some(compensation), Some(after)) = (subject.compensation, &mut found.after) {
        let left = |command: &Command| {
            let corrections = compensation.runtime.evaluate(command).map(f64::from);
            let dq = machine.to_kinematic(&corrections);
            with(command, &std::array::from_fn(|i| dq[i] + zero[i]))
        };
        worst.after = search.places(&commands, &left);
        search.raise(after, &commands, &left);
    }
    if let Some(best) = &mut found.kinematic {
        let left = |command: &Command| {
            let (q, situation) = command.kinematic(machine);
            let exact = kinematics.correction(&q, &situation, &Switches::ALL);
            // Where there is no correction, there is nothing that it leaves.
            exact.map_or([0.0; 2], |exact| with(command, &exact.dq))
        };
        search.raise(best, few, &left);
    }
    if let Some(known) = &mut found.known {
        let covariance = errors.covariance();
        let uncertain = Uncertain::new(machine, errors, &covariance);
        let left = |command: &Command| {
            let (q, situation) = command.kinematic(machine);
            let leaves = uncertain.leaves(&q, &situation);
            [leaves.tip_band(), leaves.direction_band()]
        };
        search.raise(&mut known.band, few, &left);
    }
    Ok(worst)
}

/// A search over all that a machine is told: positions, directions, tool length, temperatures.
pub struct Search<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// Its errors, which have the temperatures.
    pub errors: &'a ErrorModel,
}

impl Search<'_> {
    /// Raises the maxima at random positions to those that a search from the worst of `commands` finds.
    pub fn raise(&self, found: &mut Quality, commands: &[Command], left: &Left<'_>) {
        let raise = |statistics: &mut Statistics, which: usize, factor: f64| {
            let most = self.climbed(commands, &|command| left(command)[which]);
            let most = most.first().map_or(0.0, |(size, _)| size * factor);
            statistics.max = statistics.max.max(most);
        };
        raise(&mut found.translation_um, 0, 1e3);
        raise(&mut found.direction_urad, 1, 1e6);
    }

    /// The worst places of the tip, none near another.
    fn places(&self, commands: &[Command], left: &Left<'_>) -> Vec<Place> {
        let size = |command: &Command| left(command)[0];
        let mut chosen: Vec<Place> = Vec::new();
        let all = self.climbed(commands, &size).into_iter();
        for (_, command) in all.chain(sized(commands, &size)) {
            if chosen.len() == LISTED {
                break;
            }
            let place = self.place(command, left);
            if !chosen.iter().any(|other| self.is_near(other, &place)) {
                chosen.push(place);
            }
        }
        chosen
    }

    fn is_near(&self, a: &Place, b: &Place) -> bool {
        let axes = self.machine.axes.iter();
        let mut both = axes.zip(a.position.iter().zip(&b.position));
        both.all(|(axis, (a, b))| (a - b).abs() < NEAR * (axis.travel[1] - axis.travel[0]))
    }

    fn place(&self, mut command: Command, left: &Left<'_>) -> Place {
        let axes = self.machine.axes.len();
        let here = left(&command);
        for axis in 0..axes {
            let mut unknown = command;
            unknown.travel[axis] = Travel::Unknown;
            if left(&unknown) == here {
                command = unknown;
            }
        }
        let whence = |travel: &Travel| match travel {
            Travel::Positive => 1,
            Travel::Negative => -1,
            Travel::Unknown => 0,
        };
        Place {
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

    /// Ranges of tool length and temperatures, as far as they are inputs.
    fn auxiliaries(&self) -> impl Iterator<Item = [f64; 2]> {
        let sensors = self.errors.sensors.iter().map(|sensor| sensor.range_kelvin);
        self.machine.length_range.into_iter().chain(sensors)
    }

    /// The worst of `commands`, each gone on to where it is worse; the worst first.
    fn climbed(
        &self,
        commands: &[Command],
        size: &(dyn Fn(&Command) -> f64 + Sync),
    ) -> Vec<(f64, Command)> {
        let starts = sized(commands, size).take(STARTS);
        let starts: Vec<Command> = starts.map(|(_, command)| command).collect();
        let climb = |start: &Command| self.climb(*start, size);
        let mut all: Vec<(f64, Command)> = starts.par_iter().map(climb).collect();
        all.sort_by(|a, b| rounded(b.0).total_cmp(&rounded(a.0)));
        all
    }

    /// From a command, one input after the other, to where it is worse.
    fn climb(&self, start: Command, size: &dyn Fn(&Command) -> f64) -> (f64, Command) {
        let axes = self.machine.axes.iter().map(|axis| axis.travel);
        let ranges: Vec<[f64; 2]> = axes.chain(self.auxiliaries()).collect();
        let count = self.machine.axes.len();
        let mut best = (size(&start), start);
        let take = |command: Command, best: &mut (f64, Command)| {
            let found = size(&command);
            if found > best.0 * (1.0 + LARGER) {
                *best = (found, command);
            }
        };
        for part in ROUNDS {
            for (input, range) in ranges.iter().enumerate() {
                let here = best.1;
                for value in around(*value(&mut here.clone(), count, input), *range, part) {
                    let mut command = here;
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

/// An input of a command: an axis, or one of the others.
fn value(command: &mut Command, axes: usize, input: usize) -> &mut f32 {
    match input.checked_sub(axes) {
        None => &mut command.axes[input],
        Some(other) => &mut command.auxiliaries[other],
    }
}

/// Values around one, by a part of a range to both sides, as the runtime sees them and not beyond its ends.
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

/// Commands with their sizes, the largest first.
fn sized(
    commands: &[Command],
    size: &(dyn Fn(&Command) -> f64 + Sync),
) -> impl Iterator<Item = (f64, Command)> + use<> {
    let mut all: Vec<(f64, Command)> = commands.par_iter().map(|c| (size(c), *c)).collect();
    all.sort_by(|a, b| rounded(b.0).total_cmp(&rounded(a.0)));
    all.into_iter()
}

/// Rounded to 1e-9 mm, rad: what differs by less is the same size.
fn rounded(size: f64) -> f64 {
    (size * 1e9).round()
}

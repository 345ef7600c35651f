//! Positions at which the page checks its results against this program.

use super::{PoseRows, frame};
use serde::Serialize;
use trueaxis::{AUXILIARIES, Travel};
use trueaxis_model::errors::{ErrorModel, Switches};
use trueaxis_model::kinematics::{Kinematics, Twist};
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_model::validate::{Command, Runtime, commands_in_travel};

/// Number of positions checked.
pub(crate) const CHECKS: usize = 100;
/// Equal positions in every report of a machine.
const SEED: u64 = 16;

/// A position and the results of this program there.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PageCheck {
    /// Positions of the axes (mm, deg), exactly representable in f32.
    pub position: Vec<f64>,
    /// Direction from which each axis arrived: 1, −1, 0 if unknown.
    pub direction: Vec<i8>,
    /// Tool length (mm) if it is an input, then temperatures (K from their reference).
    pub auxiliaries: Vec<f64>,
    /// The tool in the workpiece frame (spindle orientation, origin at the tip), without errors.
    pub nominal: PoseRows,
    /// Like `nominal`, with all errors.
    pub actual: PoseRows,
    /// The error without tables.
    pub before: ErrorLeft,
    /// The error with tables.
    pub after: Option<ErrorLeft>,
    /// The corrections of each axis by the tables (mm, deg).
    pub correction: Option<Vec<f64>>,
}

/// The volumetric error in the tool frame at the tip, and the figures derived from it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ErrorLeft {
    /// `[x y z a b c]` (mm, rad).
    pub twist: [f64; 6],
    /// Length of its translation (mm).
    pub tip_mm: f64,
    /// Rotation across the tool axis (rad).
    pub direction_rad: f64,
}

impl ErrorLeft {
    fn of(machine: &Machine, twist: Twist) -> Self {
        let mut across = twist.r;
        across[machine.tool_axis] = 0.0;
        Self {
            twist: twist.to_array(),
            tip_mm: twist.t.norm(),
            direction_rad: across.norm(),
        }
    }
}

/// Zero and both ends with unknown directions, then random positions with random directions.
pub fn checks(
    machine: &Machine,
    errors: &ErrorModel,
    runtime: Option<&Runtime<'_>>,
    zero: &PerAxis,
) -> Vec<PageCheck> {
    let ends = [0, 1].map(|end| {
        let travel: Vec<f64> = machine.axes.iter().map(|a| a.travel[end]).collect();
        Command::at(machine, &travel)
    });
    let mut commands = vec![Command::at(machine, &[])];
    commands.extend(ends);
    let random = CHECKS - commands.len();
    commands.extend(commands_in_travel(machine, errors, random, SEED));
    commands
        .iter()
        .map(|command| check(machine, errors, runtime, zero, command))
        .collect()
}

fn check(
    machine: &Machine,
    errors: &ErrorModel,
    runtime: Option<&Runtime<'_>>,
    zero: &PerAxis,
    command: &Command,
) -> PageCheck {
    let n = machine.axes.len();
    let kinematics = Kinematics::new(machine, errors);
    let (q, situation) = command.kinematic(machine);
    let auxiliaries = usize::from(machine.length_range.is_some()) + errors.sensors.len();
    let left = |dq: &_| ErrorLeft::of(machine, kinematics.volumetric_error(&q, dq, &situation));
    let correction = runtime.map(|runtime| runtime.evaluate(command));
    let direction = |travel: &Travel| match travel {
        Travel::Positive => 1,
        Travel::Negative => -1,
        Travel::Unknown => 0,
    };
    PageCheck {
        position: exactly(&command.axes[..n]),
        direction: command.travel[..n].iter().map(direction).collect(),
        auxiliaries: exactly(&command.auxiliaries[..auxiliaries.min(AUXILIARIES)]),
        nominal: frame(&kinematics.nominal(&q, situation.length)),
        actual: frame(&kinematics.actual(&q, &situation, &Switches::ALL)),
        before: left(zero),
        after: correction.map(|dq| {
            let dq = machine.to_kinematic(&dq.map(f64::from));
            left(&std::array::from_fn(|i| dq[i] + zero[i]))
        }),
        correction: correction.map(|dq| exactly(&dq[..n])),
    }
}

/// The exact values, not the shortest decimals that f32 reads as the same.
fn exactly(values: &[f32]) -> Vec<f64> {
    values.iter().copied().map(f64::from).collect()
}

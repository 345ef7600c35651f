//! Measures the effect of a compensation on the volumetric error: positions and runtime.

mod verification;

use crate::errors::{ErrorModel, Motion, Situation, Switches};
use crate::kinematics::{Kinematics, NotConverged};
use crate::machine::{MAX_AXES, Machine, PerAxis};
use crate::motion::situation;
use crate::parallel;
use crate::policy::of_blob;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::TAU;
use trueaxis::{Inputs, Largest, LoadError, Travel, Travelling};
pub use verification::{
    AxisDeviation, Measured, Quality, Statistics, Verification, direction, verify,
};

/// A position of the machine with all inputs of the runtime.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command {
    /// Axis positions (mm, deg), as the runtime sees them.
    pub axes: [f32; MAX_AXES],
    /// Direction of travel of each axis.
    pub travel: [Travel; MAX_AXES],
    /// Tool length (mm) if it is an input, then temperatures (K from their reference).
    pub auxiliaries: [f32; trueaxis::AUXILIARIES],
}

impl Command {
    /// A position with unknown directions, the machine's own tool and reference temperatures.
    #[must_use]
    pub fn at(machine: &Machine, position: &[f64]) -> Self {
        let mut command = Self {
            axes: [0.0; MAX_AXES],
            travel: [Travel::Unknown; MAX_AXES],
            auxiliaries: [0.0; trueaxis::AUXILIARIES],
        };
        for (a, p) in command.axes.iter_mut().zip(position) {
            *a = *p as f32;
        }
        if machine.length_range.is_some() {
            command.auxiliaries[0] = machine.tool_length() as f32;
        }
        command
    }

    /// Like `at`, with the directions from which the axes arrived: positive, negative, or 0 if unknown.
    #[must_use]
    pub fn coming(machine: &Machine, position: &[f64], direction: &[f64]) -> Self {
        let mut command = Self::at(machine, position);
        for (travel, direction) in command.travel.iter_mut().zip(direction) {
            *travel = match direction {
                d if *d > 0.0 => Travel::Positive,
                d if *d < 0.0 => Travel::Negative,
                _ => Travel::Unknown,
            };
        }
        command
    }

    /// Like `coming`, for the kinematic model: position (mm, rad) and situation.
    #[must_use]
    pub fn kinematic(&self, machine: &Machine) -> (PerAxis, Situation) {
        let position: Vec<f64> = self.axes.iter().map(|a| f64::from(*a)).collect();
        let auxiliaries = self.auxiliaries.into_iter().map(f64::from);
        let situation = situation(machine, self.travel.into_iter(), auxiliaries);
        (machine.to_kinematic(&position), situation)
    }
}

/// A decoded blob, evaluated with the runtime.
pub struct Runtime<'a>(Box<Largest<'a>>);

impl<'a> Runtime<'a> {
    /// Decodes a blob.
    ///
    /// # Errors
    /// [`LoadError`] describes the damage.
    pub fn load(blob: &'a [u8]) -> Result<Self, LoadError> {
        let mut compensation = Box::new(Largest::empty());
        compensation.load(blob)?;
        Ok(Self(compensation))
    }

    /// The compensation itself.
    #[must_use]
    pub fn compensation(&self) -> &Largest<'a> {
        &self.0
    }

    /// The kinematics of a machine with its errors, under the policy of this compensation.
    #[must_use]
    pub fn kinematics<'m>(&self, machine: &'m Machine, errors: &'m ErrorModel) -> Kinematics<'m> {
        Kinematics::new(machine, errors).with_policy(of_blob(self.0.policy()))
    }

    /// Corrections (mm, deg).
    #[must_use]
    pub fn evaluate(&self, command: &Command) -> [f32; MAX_AXES] {
        let mut inputs = Inputs::at([0.0; 16]);
        let mut travelling = Travelling([Travel::Unknown; 16]);
        inputs.axes[..MAX_AXES].copy_from_slice(&command.axes);
        travelling.0[..MAX_AXES].copy_from_slice(&command.travel);
        inputs.auxiliaries = command.auxiliaries;
        let all = self.0.evaluate(&inputs, &travelling, &self.0.weights());
        std::array::from_fn(|i| all[i])
    }
}

/// The region in which random positions are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Region {
    /// The whole travel.
    Travel,
    /// Where no error motion holds its end value, neither at the command nor at the corrected position.
    Inside,
    /// Everywhere else.
    Outside,
}

/// True if a command is in the calibrated range of every error motion that holds its end value, at `position` (mm,
/// rad).
fn is_calibrated(machine: &Machine, errors: &ErrorModel, position: &PerAxis) -> bool {
    (0..machine.axes.len()).all(|i| {
        let [low, high] = errors.calibrated[i];
        !errors.motions[i].iter().any(Motion::holds) || (position[i] >= low && position[i] <= high)
    })
}

/// True if an error motion holds its end value at a position (mm, rad) or at the corrected one, where motions are
/// evaluated.
#[must_use]
pub fn holds(
    machine: &Machine,
    errors: &ErrorModel,
    position: &PerAxis,
    correction: &PerAxis,
) -> bool {
    let corrected = std::array::from_fn(|i| position[i] + correction[i]);
    !(is_calibrated(machine, errors, position) && is_calibrated(machine, errors, &corrected))
}

/// True if an axis with measured motions is within its own correction (mm, rad) of a measured point.
///
/// A motion bends where the *corrected* position passes the point, a table where the command does, and the corrected
/// position depends on all axes. So between the two, no table that reads commands can be exact. At its ends a motion
/// [`holds`] instead.
#[must_use]
pub fn is_near_point(
    machine: &Machine,
    errors: &ErrorModel,
    position: &PerAxis,
    correction: &PerAxis,
) -> bool {
    machine.axes.iter().enumerate().any(|(i, axis)| {
        let is_near = |point: &f64| {
            let mut apart = (position[i] - point).abs();
            if axis.modulo {
                apart %= TAU;
                apart = apart.min(TAU - apart);
            }
            apart <= correction[i].abs()
        };
        let tables = errors.motions[i].iter().filter_map(|m| m.table.as_ref());
        let mut bends = tables.map(|table| match &table.at[..] {
            [_, inner @ .., _] if !axis.modulo => inner,
            all => all,
        });
        bends.any(|points| points.iter().any(is_near))
    })
}

/// True if an error motion holds its end value anywhere in the travel, even if only the correction carries its axis
/// past an end.
#[must_use]
pub fn holds_anywhere(machine: &Machine, errors: &ErrorModel) -> bool {
    let motions = &errors.motions[..machine.axes.len()];
    motions.iter().flatten().any(Motion::holds)
}

/// The calibrated range of an axis in command units.
#[must_use]
pub fn calibrated(machine: &Machine, errors: &ErrorModel, axis: usize) -> [f64; 2] {
    errors.calibrated[axis].map(|c| machine.axes[axis].to_command(c))
}

/// True if a calibrated range leaves out a part of the travel.
#[must_use]
pub fn is_partly_calibrated(machine: &Machine, errors: &ErrorModel) -> bool {
    machine.axes.iter().enumerate().any(|(i, axis)| {
        let [low, high] = calibrated(machine, errors, i);
        errors.motions[i].iter().any(Motion::holds)
            && (low > axis.travel[0] + 1e-9 || high < axis.travel[1] - 1e-9)
    })
}

/// Why random commands cannot be drawn.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum DrawError {
    /// The correction that decides between inside and outside does not converge.
    #[error(transparent)]
    NotConverged(#[from] NotConverged),
    /// Almost no position lies in the region.
    #[error(
        "of {draws} random positions only {found} are {}", .region.of_positions()
    )]
    Rare {
        /// The region to draw in.
        region: Region,
        /// Number of positions tried.
        draws: usize,
        /// Number of positions found in the region.
        found: usize,
    },
}

impl Region {
    fn of_positions(self) -> &'static str {
        match self {
            Self::Travel => "in the travel",
            Self::Inside => "inside the ranges of the error motions",
            Self::Outside => "outside the ranges of the error motions",
        }
    }
}

/// Drawing fails if fewer than one in this many positions is in the region, after this many draws. A calibrated
/// range is much wider than the corrections, so most positions drawn inside it are usable.
const RARE: usize = 50;
const DRAWS: usize = 10_000;

/// Random commands: positions, directions of travel, tool lengths and temperatures.
///
/// # Errors
/// [`DrawError`] if the correction that decides between inside and outside does not converge, or almost no position
/// is in the region.
pub fn random_commands(
    kinematics: &Kinematics<'_>,
    region: Region,
    count: usize,
    seed: u64,
) -> Result<Vec<Command>, DrawError> {
    let (machine, errors) = (kinematics.machine, kinematics.errors);
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut commands = Vec::with_capacity(count);
    if region == Region::Outside && !holds_anywhere(machine, errors) {
        return Ok(commands);
    }
    let is_there = |command: &Command| {
        if region == Region::Travel {
            return Ok(true);
        }
        // The corrected position decides, because motions are evaluated there.
        let (q, situation) = command.kinematic(machine);
        let dq = kinematics.correction(&q, &situation, &Switches::ALL)?.dq;
        Ok(holds(machine, errors, &q, &dq) != (region == Region::Inside))
    };
    let mut draws = 0;
    while commands.len() < count {
        let missing = count - commands.len();
        let drawn: Vec<Command> = (0..missing)
            .map(|_| random_command(machine, errors, region, &mut random))
            .collect();
        let there: Vec<Result<bool, NotConverged>> = parallel::map(&drawn, is_there);
        for (command, there) in drawn.into_iter().zip(there) {
            let found = commands.len();
            if draws >= DRAWS + RARE * found {
                return Err(DrawError::Rare {
                    region,
                    draws,
                    found,
                });
            }
            draws += 1;
            if there? {
                commands.push(command);
            }
        }
    }
    Ok(commands)
}

/// Like [`random_commands`] in the whole travel, where no draw is rejected.
#[must_use]
pub fn commands_in_travel(
    machine: &Machine,
    errors: &ErrorModel,
    count: usize,
    seed: u64,
) -> Vec<Command> {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let draw = |_| random_command(machine, errors, Region::Travel, &mut random);
    (0..count).map(draw).collect()
}

/// One random command, which may turn out to be outside the region.
fn random_command(
    machine: &Machine,
    errors: &ErrorModel,
    region: Region,
    random: &mut Pcg64Mcg,
) -> Command {
    let mut command = Command::at(machine, &[]);
    for (i, axis) in machine.axes.iter().enumerate() {
        let [mut low, mut high] = axis.travel;
        if region == Region::Inside && errors.motions[i].iter().any(Motion::holds) {
            let [from, to] = calibrated(machine, errors, i);
            (low, high) = (low.max(from), high.min(to));
        }
        // Rounded as the runtime sees it, without exceeding the ends by rounding.
        let q = (low + (high - low) * random.random::<f64>()) as f32;
        command.axes[i] = q.max(low as f32).min(high as f32);
        command.travel[i] = if random.random::<bool>() {
            Travel::Positive
        } else {
            Travel::Negative
        };
    }
    let with_length = usize::from(machine.length_range.is_some());
    if let Some([low, high]) = machine.length_range {
        command.auxiliaries[0] = (low + (high - low) * random.random::<f64>()) as f32;
    }
    for (k, sensor) in errors.sensors.iter().enumerate() {
        let [low, high] = sensor.range_kelvin;
        command.auxiliaries[with_length + k] = (low + (high - low) * random.random::<f64>()) as f32;
    }
    command
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::errors::Parameter;

    #[test]
    fn a_table_on_a_part_of_the_travel_leaves_the_rest_uncalibrated() {
        let text = include_str!("../../../examples/kolibri/machine.toml");
        let machine = Machine::from_toml(text).unwrap();
        for (at, is_partly) in [("-100.0, 130.0", true), ("-130.0, 0.0, 130.0", false)] {
            let value = if is_partly {
                "0.0, 1e-3"
            } else {
                "0.0, 1e-3, 0.0"
            };
            let text =
                format!("machine = \"Kolibri\"\n[tabulated.EXX]\nat = [{at}]\nvalue = [{value}]\n");
            let errors = ErrorModel::from_toml(&text, &machine).unwrap();
            assert_eq!(is_partly_calibrated(&machine, &errors), is_partly, "{at}");
        }
    }

    #[test]
    fn drawing_where_hardly_a_position_is_comes_to_an_end() {
        let text = include_str!("../../../examples/kolibri/machine.toml");
        let machine = Machine::from_toml(text).unwrap();
        let mut errors = ErrorModel::perfect(&machine);
        for (name, value) in [("EXX0", 0.5), ("EXX2", 1e-9)] {
            assert!(errors.set(&machine, Parameter::parse(name).unwrap(), value));
        }
        let x = machine.index('X').unwrap();
        for range in [[10.0, 10.2], [500.0, 600.0]] {
            errors.calibrated[x] = range;
            let kinematics = Kinematics::new(&machine, &errors);
            let drawn = random_commands(&kinematics, Region::Inside, 1000, 1);
            assert!(
                matches!(drawn, Err(DrawError::Rare { found: 0, .. })),
                "{drawn:?}"
            );
        }
        // Half of it; in the other half the correction leads outside.
        errors.calibrated[x] = [10.0, 11.0];
        let kinematics = Kinematics::new(&machine, &errors);
        let drawn = random_commands(&kinematics, Region::Inside, 1000, 1).unwrap();
        assert_eq!(drawn.len(), 1000);
    }

    #[test]
    fn a_position_is_near_an_inner_measured_point_within_its_own_correction() {
        let machine = include_str!("../../../examples/kolibri/machine.toml");
        let machine = Machine::from_toml(machine).unwrap();
        let errors = "machine = \"Kolibri\"\n[tabulated.EXX]\nat = [-65.0, 0.0, 65.0]\nvalue = [0.0, 0.003, 0.001]\n";
        let errors = ErrorModel::from_toml(errors, &machine).unwrap();
        let x = machine.index('X').unwrap();
        let is_near = |position: f64, correction: f64| {
            let (mut q, mut dq) = (PerAxis::default(), PerAxis::default());
            (q[x], dq[x]) = (position, correction);
            is_near_point(&machine, &errors, &q, &dq)
        };
        for position in [-0.0029, 0.0, 0.0029] {
            assert!(is_near(position, -0.003) && is_near(position, 0.003));
        }
        assert!(!is_near(0.0031, -0.003) && !is_near(-0.0031, 0.003));
        // At its ends the motion holds its end value; between points it is straight.
        assert!(!is_near(65.0, -0.003) && !is_near(-65.0, 0.003) && !is_near(30.0, 0.003));
    }
}

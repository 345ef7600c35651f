//! The coverage intervals over the travel of a machine.

use super::{band, bounds};
use crate::errors::ErrorModel;
use crate::kinematics::Kinematics;
use crate::machine::Machine;
use crate::validate::{
    Command, DrawError, Quality, Region, Statistics, calibrated, is_partly_calibrated,
    random_commands,
};
use serde::Serialize;

/// Number of positions. A mean over this many is accurate to 3 % if the scatter of the intervals equals their size.
const POSITIONS: usize = 1000;
/// Makes them differ from the positions of a verification.
const OWN: u64 = 0x0095_0095;
/// Number of positions for the bounds of mean, 95 % and largest error; as many more are at ends of the travel.
const OF_BOUNDS: usize = 400;

/// The error that uncertain parameters leave over the travel, with a probability of 95 %.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OverTravel {
    /// Number of random positions.
    pub positions: usize,
    /// Over the whole travel.
    pub travel: Quality,
    /// Where no error motion holds its end value, if that is not the whole travel.
    pub inside: Option<Quality>,
    /// Where all axes are in their calibrated ranges, if the misfit of the model is known, and only there.
    pub zone: Option<Quality>,
    /// In that zone, or else over the whole travel: what mean, 95 % and largest error of a machine do not exceed, each
    /// with a probability of 95 %.
    pub at_most: Quality,
    /// Number of parameters with a standard uncertainty.
    pub parameters: usize,
    /// Number of parameters without one; they count as exact.
    pub exact: usize,
    /// Number of parameters with known correlations; the others count as uncorrelated.
    pub correlated: usize,
    /// Number of tabulated motions with a standard uncertainty.
    pub tables: usize,
    /// Number of tabulated motions without one; they count as exact.
    pub exact_tables: usize,
}

/// The 95 % intervals over the travel, with the policy and the random directions of travel, tool lengths and
/// temperatures of a verification; `None` if no parameter and no tabulated motion has an uncertainty.
///
/// # Errors
/// [`DrawError`] if almost no position is where no error motion holds its end value.
pub fn over_travel(
    kinematics: &Kinematics<'_>,
    seed: u64,
) -> Result<Option<OverTravel>, DrawError> {
    let (machine, errors): (&Machine, &ErrorModel) = (kinematics.machine, kinematics.errors);
    let covariance = errors.covariance();
    if covariance.parameters.is_empty() && errors.table_uncertainty.is_empty() {
        return Ok(None);
    }
    let over = |region: Region| {
        let commands = random_commands(kinematics, region, POSITIONS, seed ^ OWN)?;
        let positions = commands.iter().map(|command| command.kinematic(machine));
        let positions: Vec<_> = positions.collect();
        Ok::<Quality, DrawError>(band(machine, errors, &covariance, &positions))
    };
    let zone = zone(machine, errors);
    let in_zone = |zone: Machine| {
        let kinematics = Kinematics::new(&zone, errors);
        let commands = random_commands(&kinematics, Region::Travel, POSITIONS, seed ^ OWN)?;
        let positions = commands.iter().map(|command| command.kinematic(&zone));
        let positions: Vec<_> = positions.collect();
        Ok::<Quality, DrawError>(band(&zone, errors, &covariance, &positions))
    };
    let at_most = {
        let machine = zone.as_ref().unwrap_or(machine);
        let kinematics = Kinematics::new(machine, errors);
        let within = random_commands(&kinematics, Region::Travel, OF_BOUNDS, seed ^ OWN)?;
        let positions = |commands: &[Command]| -> Vec<_> {
            let all = commands.iter().map(|command| command.kinematic(machine));
            all.collect()
        };
        let statistics = bounds(machine, errors, &covariance, &positions(&within), seed);
        let ends: Vec<Command> = within.iter().map(|one| at_ends(machine, one)).collect();
        let ends = bounds(machine, errors, &covariance, &positions(&ends), seed);
        let larger = |a: Statistics, b: Statistics| Statistics {
            max: a.max.max(b.max),
            ..a
        };
        Quality {
            translation_um: larger(statistics.translation_um, ends.translation_um),
            direction_urad: larger(statistics.direction_urad, ends.direction_urad),
        }
    };
    let motions = errors.motions.iter().flatten();
    let tabulated = motions.filter(|motion| motion.table.is_some()).count();
    let is_known = |p| covariance.parameters.contains(p);
    Ok(Some(OverTravel {
        positions: POSITIONS,
        travel: over(Region::Travel)?,
        inside: match is_partly_calibrated(machine, errors) {
            true => Some(over(Region::Inside)?),
            false => None,
        },
        at_most,
        zone: zone.map(in_zone).transpose()?,
        parameters: covariance.parameters.len(),
        exact: errors.parameters.keys().filter(|p| !is_known(p)).count(),
        correlated: (errors.correlated.as_ref()).map_or(0, |known| known.parameters.len()),
        tables: errors.table_uncertainty.len(),
        exact_tables: tabulated - errors.table_uncertainty.len(),
    }))
}

/// The command with each linear axis at the nearer end of its travel, where errors are largest.
fn at_ends(machine: &Machine, command: &Command) -> Command {
    let mut command = *command;
    for (i, axis) in machine.axes.iter().enumerate() {
        if !axis.letter.is_rotary() {
            let [low, high] = axis.travel.map(|end| end as f32);
            let is_low = command.axes[i] - low < high - command.axes[i];
            command.axes[i] = if is_low { low } else { high };
        }
    }
    command
}

/// The probed zone: the machine with the calibrated ranges as its travel.
#[must_use]
pub fn probed_zone(machine: &Machine, errors: &ErrorModel) -> Machine {
    let mut zone = machine.clone();
    for (i, axis) in zone.axes.iter_mut().enumerate() {
        let [low, high] = calibrated(machine, errors, i);
        let [from, to] = axis.travel;
        axis.travel = [from.max(low), to.min(high)];
    }
    zone
}

/// The probed zone, if the misfit is known there and not in the whole travel.
fn zone(machine: &Machine, errors: &ErrorModel) -> Option<Machine> {
    /// Rounding of the conversion to radians and back (mm, deg).
    const ROUNDED: f64 = 1e-9;
    errors.misfit?;
    let zone = probed_zone(machine, errors);
    let mut axes = zone.axes.iter().zip(&machine.axes);
    let is_narrower = axes.any(|(zone, axis)| {
        let [[low, high], [from, to]] = [zone.travel, axis.travel];
        low > from + ROUNDED || high < to - ROUNDED
    });
    is_narrower.then_some(zone)
}

//! Measures the effect of a blob on the volumetric error, at new random positions.

use super::{CompileError, Progress};
use serde::Serialize;
use trueaxis::AuxiliaryKind;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::errors::temperature_name;
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_model::parallel;
use trueaxis_model::validate::{
    DrawError, Measured, Region, Runtime, Verification, holds_anywhere, is_partly_calibrated,
    random_commands,
};

/// Change of tool length (mm) for measuring the sensitivity.
const LENGTH_CHANGE: f64 = 10.0;
/// Number of positions for measuring the sensitivity.
const LENGTH_POSITIONS: usize = 1000;
/// Makes the positions of a verification differ from those used to find the bounds.
const FRESH: u64 = 0x00f0_0d00;

/// The effect of a compensation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Proof {
    /// Over the whole travel.
    #[serde(flatten)]
    pub travel: Verification,
    /// True if calibrated ranges leave out a part of the travel. Otherwise `outside` only contains positions where
    /// the correction leads past an end of the travel.
    pub partly_calibrated: bool,
    /// Where no error motion holds its end value, neither at the command nor at the corrected position, and farther
    /// than one correction from measured points. `None` if no motion holds its end value.
    pub inside: Option<Verification>,
    /// Within one correction of a measured point; `None` if there are no such positions. A motion bends where the
    /// corrected position passes the point. That depends on all axes, so no table that reads commands is exact
    /// there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub near_points: Option<Verification>,
    /// Where an error motion holds its end value; `None` if there are no such positions. Where it begins to hold,
    /// the reference correction has a bend that depends on all axes, which tables cannot follow.
    pub outside: Option<Verification>,
    /// At the positions of the rotary axes for which alone the tables are made, if any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held: Option<Held>,
    /// Translational error per mm of tool length above or below the nominal (µm/mm), if tool length is not an input.
    pub um_per_mm_of_tool_length: Option<f64>,
}

impl Proof {
    /// The region where the tolerance applies: no error motion holds its end value, measured points are farther than
    /// one correction, and the rotary axes are where the tables are made for.
    #[must_use]
    pub fn inside(&self) -> &Verification {
        match &self.held {
            Some(held) => &held.found,
            None => self.inside.as_ref().unwrap_or(&self.travel),
        }
    }

    /// True if the tables differ from the kinematic correction by at most `um` µm, and in rotation by the equivalent
    /// under the policy, inside the ranges of the error motions.
    #[must_use]
    pub fn meets(&self, um: f64) -> bool {
        self.inside().meets(um)
    }
}

/// Effect of a compensation at the rotary positions for which it is made.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Held {
    /// Letters of the axes, and their positions (deg).
    pub axes: Vec<(char, f64)>,
    /// At random positions of the linear axes; only where no error motion holds its end value, if there are any.
    #[serde(flatten)]
    pub found: Verification,
}

/// A blob that was made for a different machine or different errors.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the blob was made for {blob}, not for {machine}")]
pub struct Mismatch {
    /// What the blob contains.
    pub blob: String,
    /// What the machine and its errors require.
    pub machine: String,
}

/// Checks that a blob was made for this machine: name, axes in order, auxiliary inputs.
///
/// # Errors
/// [`Mismatch`] with the first difference.
pub fn belongs(
    machine: &Machine,
    errors: &ErrorModel,
    runtime: &Runtime<'_>,
) -> Result<(), Mismatch> {
    let compensation = runtime.compensation();
    let [blob, own] = [compensation.machine(), &machine.name].map(|name| format!("`{name}`"));
    agree("the machine", blob, own)?;
    let axes = compensation.axes().iter().map(|a| char::from(a.name));
    let own = machine.axes.iter().map(|a| a.letter.char());
    agree("the axes", axes.collect(), own.collect())?;
    let length = || "the tool length".to_owned();
    let auxiliaries: Vec<String> = (compensation.auxiliaries().iter())
        .map(|a| match a.kind {
            AuxiliaryKind::ToolLength => length(),
            AuxiliaryKind::Temperature => {
                format!("sensor `{}`", temperature_name(&a.name, a.sensor.lag_rate))
            }
        })
        .collect();
    let sensors = errors.sensors.iter();
    let sensors = sensors.map(|sensor| format!("sensor `{}`", sensor.name()));
    let own = machine.length_range.map(|_| length()).into_iter();
    let own: Vec<String> = own.chain(sensors).collect();
    agree("auxiliary inputs", auxiliaries.join(", "), own.join(", "))
}

/// An error if a blob and a machine differ in `what`.
fn agree(what: &str, blob: String, machine: String) -> Result<(), Mismatch> {
    let show = |value: &str| match value.is_empty() {
        true => format!("no {what}"),
        false => format!("{what} {value}"),
    };
    match blob == machine {
        true => Ok(()),
        false => Err(Mismatch {
            blob: show(&blob),
            machine: show(&machine),
        }),
    }
}

/// The seed with which [`prove`] draws positions in the whole travel.
pub fn seed_over_travel(seed: u64) -> u64 {
    seed ^ FRESH
}

/// Compares a blob with the exact model at `random` positions of each region. `zero` (mm, rad) is what was
/// subtracted from its tables ([`Options::zero`](crate::schemes::Options::zero)).
///
/// # Errors
/// [`CompileError`] if the kinematic correction fails or almost nothing is calibrated.
pub fn prove(
    machine: &Machine,
    errors: &ErrorModel,
    runtime: &Runtime<'_>,
    zero: &PerAxis,
    random: usize,
    seed: u64,
    progress: &dyn Progress,
) -> Result<Proof, CompileError> {
    let kinematics = runtime.kinematics(machine, errors);
    let measure = |region: Region, seed: u64| {
        let commands = random_commands(&kinematics, region, random, seed)?;
        progress.stage("verifying", commands.len());
        let step = || progress.step();
        let measured = Measured::new(machine, errors, runtime, zero, commands, step)?;
        Ok::<_, CompileError>(measured)
    };
    let travel = measure(Region::Travel, seed_over_travel(seed))?;
    let (mut inside, mut near_points, mut outside) = (None, None, None);
    let partly_calibrated = is_partly_calibrated(machine, errors);
    if holds_anywhere(machine, errors) {
        // Positions already drawn inside, if that is nearly all of the travel; otherwise draw as many again.
        let in_travel = travel.inside().filter(|_| !partly_calibrated);
        (inside, near_points) = match in_travel {
            Some(inside) => (Some(inside), travel.near_points()),
            None => {
                let measured = measure(Region::Inside, seed ^ FRESH ^ 1)?;
                (measured.inside(), measured.near_points())
            }
        };
        outside = travel.outside();
    }
    let um_per_mm_of_tool_length = match machine.length_range {
        Some(_) => None,
        None => Some(length_sensitivity(machine, errors, runtime, zero, seed)?),
    };
    Ok(Proof {
        travel: travel.everywhere(),
        partly_calibrated,
        inside,
        near_points,
        outside,
        held: None,
        um_per_mm_of_tool_length,
    })
}

/// Verifies at random positions, and also at the positions of rotary axes in `held` (axis indices, deg), if any; then
/// the tolerance applies there.
///
/// # Errors
/// As [`prove`].
#[expect(clippy::too_many_arguments)]
pub(crate) fn prove_held(
    machine: &Machine,
    errors: &ErrorModel,
    runtime: &Runtime<'_>,
    zero: &PerAxis,
    held: &[(usize, f64)],
    random: usize,
    seed: u64,
    progress: &dyn Progress,
) -> Result<Proof, CompileError> {
    let verification = prove(machine, errors, runtime, zero, random, seed, progress)?;
    if held.is_empty() {
        return Ok(verification);
    }
    let kinematics = runtime.kinematics(machine, errors);
    let mut commands = random_commands(&kinematics, Region::Travel, random, seed ^ FRESH ^ 3)?;
    for (axis, position) in held {
        for command in &mut commands {
            command.axes[*axis] = *position as f32;
        }
    }
    progress.stage("verifying", commands.len());
    let step = || progress.step();
    let measured = Measured::new(machine, errors, runtime, zero, commands, step)?;
    let axes = held
        .iter()
        .map(|(i, q)| (machine.axes[*i].letter.char(), *q));
    let held = Held {
        axes: axes.collect(),
        found: measured.inside().unwrap_or_else(|| measured.everywhere()),
    };
    Ok(Proof {
        held: Some(held),
        ..verification
    })
}

/// Largest change of the translational error (µm) per mm of tool length, with corrections for the machine's own
/// tool.
fn length_sensitivity(
    machine: &Machine,
    errors: &ErrorModel,
    runtime: &Runtime<'_>,
    zero: &PerAxis,
    seed: u64,
) -> Result<f64, DrawError> {
    let kinematics = runtime.kinematics(machine, errors);
    let own = machine.tool_length();
    let shorter = (own - LENGTH_CHANGE).max(0.0);
    let longer = shorter + 2.0 * LENGTH_CHANGE;
    let commands = random_commands(
        &kinematics,
        Region::Travel,
        LENGTH_POSITIONS,
        seed ^ FRESH ^ 2,
    )?;
    let changes = parallel::map(&commands, |command| {
        let (q, situation) = command.kinematic(machine);
        let table: Vec<f64> = runtime
            .evaluate(command)
            .iter()
            .map(|c| f64::from(*c))
            .collect();
        let mut dq = machine.to_kinematic(&table);
        for (d, z) in dq.iter_mut().zip(zero) {
            *d += z;
        }
        let error = |length: f64| {
            let mut situation = situation;
            situation.length = Some(length);
            kinematics.volumetric_error(&q, &dq, &situation).t
        };
        (error(longer) - error(shorter)).norm() * 1e3 / (longer - shorter)
    });
    Ok(changes.into_iter().fold(0.0, f64::max))
}

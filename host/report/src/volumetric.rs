//! The volumetric error over the travel: without correction, with the tables, and with the best possible correction.

use super::{ReportError, ReportedCompensation, Subject};
use serde::{Deserialize, Serialize};
use trueaxis_model::errors::Switches;
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::PerAxis;
use trueaxis_model::parallel;
use trueaxis_model::uncertainty::{over_travel, probed_zone};
use trueaxis_model::validate::{Command, Quality, Region, Statistics, direction, random_commands};

/// Number of random positions, unless a verification of a compensation has its own.
pub const POSITIONS: usize = 5000;

/// The volumetric error over the whole travel: mean, root mean square and 95 % at random positions. Maxima in a
/// report are the largest found by a search from the worst of these; in a verdict they are those at these positions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Volumetric {
    /// Number of positions.
    pub positions: usize,
    /// Without correction, except for that of the reference position.
    pub before: Quality,
    /// With the tables, if any.
    pub after: Option<Quality>,
    /// With the exact kinematic correction, a limit for all tables; `None` if it fails somewhere.
    pub kinematic: Option<Quality>,
    /// Largest difference of the tables from the kinematic correction at the tip, where the tolerance applies.
    pub difference_um: Option<f64>,
    /// Like `difference_um`, for the tool direction, or for a rotary axis.
    pub difference_urad: Option<f64>,
    /// True if the tables meet the tolerance.
    pub meets_tolerance: Option<bool>,
    /// Change of the tip error with tool length, if that is not an input of the tables.
    pub um_per_mm_of_tool_length: Option<f64>,
    /// The error that uncertain parameters leave, if an uncertainty is known.
    pub known: Option<ErrorKnowledge>,
}

/// How well the errors are known.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ErrorKnowledge {
    /// 95 % interval of the error that uncertain parameters, measured motions and errors that the model lacks leave.
    pub coverage: Quality,
    /// What mean, 95 % and largest error of a machine by the same do not exceed, each with 95 %. A mean of the band is none
    /// of these.
    #[serde(default)]
    pub at_most: Quality,
    /// True if that is for the calibrated ranges only; how large the errors that the model lacks are elsewhere is not
    /// known.
    #[serde(default)]
    pub is_of_zone: bool,
    /// With the tables, in these ranges; `None` if the interval is for the whole travel.
    #[serde(default)]
    pub after: Option<Quality>,
    /// True if directions were measured. If not, their figures are those of parameters and tabulated motions alone.
    #[serde(default)]
    pub is_direction_measured: bool,
    /// Number of parameters and measured motions with an uncertainty.
    pub uncertain: usize,
    /// Number of those without one, which count as exact.
    pub exact: usize,
}

impl ErrorKnowledge {
    /// What mean, 95 % and largest error of the machine with tables do not exceed, each with 95 %, if their own error is
    /// `after` over the travel: the length of a sum does not exceed the sum of the lengths.
    #[must_use]
    pub fn with_tables(&self, after: &Quality) -> Quality {
        let here = self.after.as_ref().unwrap_or(after);
        // The largest error over the travel was searched for; the one of the zone is that of its random positions.
        let sum = |left: &Statistics, most: &Statistics, over_travel: f64| Statistics {
            mean: left.mean + most.mean,
            rms: left.rms + most.rms,
            p95: left.p95 + most.p95,
            max: left.max.max(over_travel) + most.max,
        };
        Quality {
            translation_um: sum(
                &here.translation_um,
                &self.at_most.translation_um,
                after.translation_um.max,
            ),
            direction_urad: sum(
                &here.direction_urad,
                &self.at_most.direction_urad,
                after.direction_urad.max,
            ),
        }
    }
}

/// Evaluates the machine.
pub fn volumetric(
    subject: &Subject<'_>,
    remarks: &mut Vec<String>,
) -> Result<Volumetric, ReportError> {
    let known = knowledge(subject)?;
    match subject.compensation {
        Some(compensation) => Ok(verified(&compensation, known)),
        None => uncorrected(subject, known, remarks),
    }
}

/// The errors that uncertain parameters leave, without and with the tables.
fn knowledge(subject: &Subject<'_>) -> Result<Option<ErrorKnowledge>, ReportError> {
    let (machine, errors) = (subject.machine, subject.errors);
    let kinematics = Kinematics::new(machine, errors).with_policy(subject.policy);
    let known = match subject.compensation {
        Some(compensation) => compensation.uncertainty.cloned(),
        None => over_travel(&kinematics, subject.seed)?,
    };
    let Some(found) = known else { return Ok(None) };
    let mut after = None;
    if found.zone.is_some() && subject.compensation.is_some() {
        let zone = probed_zone(machine, errors);
        let zone = Kinematics::new(&zone, errors);
        let commands = random_commands(&zone, Region::Travel, POSITIONS, subject.seed)?;
        after = Some(remaining(subject, &commands)?);
    }
    Ok(Some(ErrorKnowledge {
        at_most: found.at_most,
        is_of_zone: found.zone.is_some(),
        after,
        is_direction_measured: errors.is_direction_measured(),
        coverage: found.zone.unwrap_or(found.travel),
        uncertain: found.parameters + found.tables,
        exact: found.exact + found.exact_tables,
    }))
}

/// The figures of a compensation's verification.
fn verified(compensation: &ReportedCompensation<'_>, known: Option<ErrorKnowledge>) -> Volumetric {
    let verification = compensation.verification;
    let (all, inside) = (&verification.travel, verification.inside());
    Volumetric {
        positions: all.positions,
        before: all.before,
        after: Some(all.after),
        kinematic: Some(all.kinematic),
        difference_um: Some(inside.difference_um),
        difference_urad: Some(inside.difference_urad),
        meets_tolerance: Some(inside.meets(compensation.tolerance_um)),
        um_per_mm_of_tool_length: verification.um_per_mm_of_tool_length,
        known,
    }
}

/// Errors at random positions, without correction and with the exact kinematic one.
fn uncorrected(
    subject: &Subject<'_>,
    known: Option<ErrorKnowledge>,
    remarks: &mut Vec<String>,
) -> Result<Volumetric, ReportError> {
    let kinematics = Kinematics::new(subject.machine, subject.errors).with_policy(subject.policy);
    let commands = random_commands(&kinematics, Region::Travel, POSITIONS, subject.seed)?;
    let found: Vec<([f64; 2], Option<[f64; 2]>)> = parallel::map(&commands, |command| {
        let (q, situation) = command.kinematic(subject.machine);
        let left = |dq| {
            let error = kinematics.volumetric_error(&q, &dq, &situation);
            [error.t.norm(), direction(subject.machine, &error)]
        };
        let exact = kinematics.correction(&q, &situation, &Switches::ALL).ok();
        (left(Default::default()), exact.map(|exact| left(exact.dq)))
    });
    let failed = found.iter().filter(|(_, exact)| exact.is_none()).count();
    if failed > 0 {
        remarks.push(format!(
            "At {failed} of {POSITIONS} random positions there is no kinematic correction: the errors are far too large there."
        ));
    }
    let exact: Option<Vec<[f64; 2]>> = found.iter().map(|(_, exact)| *exact).collect();
    Ok(Volumetric {
        positions: POSITIONS,
        before: quality(found.iter().map(|(before, _)| *before)),
        after: None,
        kinematic: exact.map(|exact| quality(exact.into_iter())),
        difference_um: None,
        difference_urad: None,
        meets_tolerance: None,
        um_per_mm_of_tool_length: None,
        known,
    })
}

/// The correction (mm, rad) at a command, with `zero` for a part that the tables subtract; that part alone without tables.
pub(crate) fn applied(subject: &Subject<'_>, zero: &PerAxis, command: &Command) -> PerAxis {
    let Some(compensation) = subject.compensation else {
        return *zero;
    };
    let corrections = compensation.runtime.evaluate(command).map(f64::from);
    let tables = subject.machine.to_kinematic(&corrections);
    std::array::from_fn(|i| zero[i] + tables[i])
}

/// The error at commands, with the tables if there are any.
pub(crate) fn remaining(
    subject: &Subject<'_>,
    commands: &[Command],
) -> Result<Quality, ReportError> {
    Ok(quality(remaining_at(subject, commands)?.into_iter()))
}

/// The errors of tip (mm) and direction (rad) at each position.
pub(crate) fn remaining_at(
    subject: &Subject<'_>,
    commands: &[Command],
) -> Result<Vec<[f64; 2]>, ReportError> {
    let machine = subject.machine;
    let kinematics = Kinematics::new(machine, subject.errors);
    let zero = subject.subtracted.zero(machine, subject.errors)?;
    Ok(parallel::map(commands, |command| {
        let (q, situation) = command.kinematic(machine);
        let error = kinematics.volumetric_error(&q, &applied(subject, &zero, command), &situation);
        [error.t.norm(), direction(machine, &error)]
    }))
}

/// Statistics of errors of tip (mm) and direction (rad).
pub fn quality(errors: impl Iterator<Item = [f64; 2]> + Clone) -> Quality {
    Quality {
        translation_um: Statistics::of(errors.clone().map(|[tip, _]| tip * 1e3)),
        direction_urad: Statistics::of(errors.map(|[_, direction]| direction * 1e6)),
    }
}

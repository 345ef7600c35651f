//! The uncertainty budget: where the uncertainty of the tip comes from, what was not stated, and the combined value.

use super::calibration::{CalibrationRecord, StatedUncertainty};
use crate::words::rounded_up;
use crate::{ReportError, ReportFigures, Subject};
use serde::Serialize;
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::uncertainty::leaves;
use trueaxis_model::validate::{Region, random_commands};

/// Random positions of the travel for the mean square of what parameters leave: their number is that of the volumetric
/// error of a machine.
const POSITIONS: usize = 1000;

/// A source of uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UncertaintySource {
    /// Name of the source of uncertainty.
    pub what: &'static str,
    /// Where the figure is from, or how it enters.
    pub from: &'static str,
    /// Standard uncertainty (µm) of a coordinate of the tip, as printed; `None` if it is not stated.
    pub um: Option<String>,
}

/// The rows of the budget, and the combined expanded uncertainty (µm, k = 2) of a coordinate of the tip.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sources {
    /// The sources.
    pub rows: Vec<UncertaintySource>,
    /// The combined standard uncertainty, as printed; `None` if the parameters have none.
    pub combined_um: Option<String>,
    /// Twice that.
    pub expanded_um: Option<String>,
    /// Number of sources that are not stated and not in it.
    pub not_stated: usize,
}

/// The budget of a coordinate of the tip, rms over the travel.
pub(super) fn sources(
    subject: &Subject<'_>,
    report: &ReportFigures,
    stated: &CalibrationRecord,
) -> Result<Sources, ReportError> {
    let noise = report.identification.as_ref().map(|found| found.noise_um);
    let parameters = of_parameters(subject)?;
    let misfit = subject.errors.misfit.map(|mm| mm * 1e3);
    let budget = &stated.uncertainty;
    let rows = rows([noise, parameters, misfit], budget);
    let others = [
        misfit,
        budget.artefact_um,
        budget.expansion_um,
        budget.lobes_um,
        budget.periodic_um,
    ];
    let square: f64 = others.iter().flatten().map(|um| um * um).sum();
    let combined = parameters.map(|um| (um * um + square).sqrt());
    Ok(Sources {
        not_stated: rows.iter().filter(|row| row.um.is_none()).count(),
        rows,
        combined_um: combined.map(rounded_up),
        expanded_um: combined.map(|um| rounded_up(2.0 * um)),
    })
}

/// The sources with what is stated about them, and what an identification has found.
fn rows(
    [noise, parameters, misfit]: [Option<f64>; 3],
    stated: &StatedUncertainty,
) -> Vec<UncertaintySource> {
    let rows = [
        ("probing (noise)", "residuals; in the parameters", noise),
        (
            "artefact: form and diameter of the ball, length of the bar, wavelength",
            "stated",
            stated.artefact_um,
        ),
        (
            "difference of temperature, and expansion",
            "stated",
            stated.expansion_um,
        ),
        ("lobes of the probe", "stated", stated.lobes_um),
        (
            "errors between the measured positions",
            "stated",
            stated.periodic_um,
        ),
        (
            "parameters, with the noise of probing",
            "their covariance, rms over the travel",
            parameters,
        ),
        (
            "misfit: errors that the model lacks",
            "residuals beyond the noise",
            misfit,
        ),
    ];
    let row = |(what, from, um): (_, _, Option<f64>)| UncertaintySource {
        what,
        from,
        um: um.map(rounded_up),
    };
    rows.map(row).to_vec()
}

/// Standard uncertainty (µm) of a coordinate of the tip by parameters and measured motions, rms over the travel.
fn of_parameters(subject: &Subject<'_>) -> Result<Option<f64>, ReportError> {
    let mut errors = subject.errors.clone();
    errors.misfit = None;
    let covariance = errors.covariance();
    if covariance.parameters.is_empty() && errors.table_uncertainty.is_empty() {
        return Ok(None);
    }
    let kinematics = Kinematics::new(subject.machine, &errors).with_policy(subject.policy);
    let commands = random_commands(&kinematics, Region::Travel, POSITIONS, subject.seed)?;
    let positions: Vec<_> = (commands.iter())
        .map(|command| command.kinematic(subject.machine))
        .collect();
    let all = leaves(subject.machine, &errors, &covariance, &positions);
    let squares: f64 = all.iter().map(|at| at.tip.trace()).sum();
    Ok(Some((squares / (3.0 * all.len() as f64)).sqrt() * 1e3))
}

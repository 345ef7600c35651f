//! What a user should know about a compensation that is no error.

use super::AxisBounds;
use super::bounds::{Peak, Survey};
use crate::errors::{ErrorModel, Parameter, ParameterKind, Switches};
use crate::kinematics::{Kinematics, Linearised, NotConverged, Twist};
use crate::machine::Machine;
use crate::validate::Runtime;
use serde::Serialize;

/// Corrections above these are unusual on a machine tool: mm, deg.
const LARGE: [f64; 2] = [1.0, 0.1];

/// The error that causes most of a correction.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Culprit {
    /// Its name, as in the error file.
    pub parameter: String,
    /// Its part of the correction (mm, deg).
    pub part: f64,
}

/// Something to look at.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Warning {
    /// A correction is larger than machines usually need.
    #[error("the correction of {axis} reaches {correction:.3} {unit} at {place}{}", blame(.culprit, .unit))]
    Large {
        /// The axis.
        axis: char,
        /// Largest correction (mm, deg).
        correction: f64,
        /// `mm` or `deg`.
        unit: &'static str,
        /// Where.
        place: String,
        /// What causes most of it.
        culprit: Option<Culprit>,
    },
    /// A correction is larger than the bound of its axis, which will cut it off.
    #[error(
        "the correction of {axis} reaches {correction:.4} {unit}, over its bound of {bound:.4} {unit}: it will be cut off"
    )]
    OverBound {
        /// The axis.
        axis: char,
        /// Largest correction (mm, deg).
        correction: f64,
        /// The bound (mm, deg).
        bound: f64,
        /// `mm` or `deg`.
        unit: &'static str,
    },
    /// A table in a product ends before the travel of its axis: it holds its end value there,
    /// which is wrong kinematics.
    #[error(
        "table {table} of {axis} covers {from} to {to} only, less than the travel, and stands in a product"
    )]
    ShortTable {
        /// Number of the table.
        table: usize,
        /// The axis it reads.
        axis: char,
        /// First point (mm, deg).
        from: f32,
        /// Last point (mm, deg).
        to: f32,
    },
}

fn blame(culprit: &Option<Culprit>, unit: &str) -> String {
    match culprit {
        Some(c) => format!(", {:.3} {unit} of it because of {}", c.part, c.parameter),
        None => String::new(),
    }
}

/// Corrections over the usual size.
pub fn large(
    machine: &Machine,
    errors: &ErrorModel,
    survey: &Survey<'_>,
) -> Result<Vec<Warning>, NotConverged> {
    let mut warnings = Vec::new();
    for ((axis, bound), peak) in machine
        .axes
        .iter()
        .zip(survey.bounds())
        .zip(&survey.largest)
    {
        if peak.value > LARGE[usize::from(axis.letter.is_rotary())] {
            warnings.push(culprit(machine, errors, &bound, peak)?);
        }
    }
    Ok(warnings)
}

/// Names the place of a correction and the error that causes most of it, by the linearised model.
pub fn culprit(
    machine: &Machine,
    errors: &ErrorModel,
    bound: &AxisBounds,
    peak: &Peak,
) -> Result<Warning, NotConverged> {
    let at = &peak.at;
    let kinematics = Kinematics::new(machine, errors);
    let (q, situation) = at.kinematic(machine);
    let index = machine.index(bound.axis).unwrap_or(0);
    let axis = &machine.axes[index];
    let solver = kinematics
        .jacobian(&q, situation.length)
        .solver(kinematics.policy)
        .ok_or(NotConverged {
            step: f64::INFINITY,
            iterations: 0,
        })?;
    let linearised = Linearised::new(&kinematics, &q, &situation);
    let part = |twist: &Twist, value: f64| axis.to_command(solver.correct(twist)[index] * value);
    let mut parts: Vec<Culprit> = Vec::new();
    for (parameter, value) in &errors.parameters {
        if let Some(column) = linearised.column(*parameter) {
            parts.push(Culprit {
                parameter: parameter.to_string(),
                part: part(&column, *value),
            });
        }
    }
    // Tabulated motions count as a constant of their value here.
    for (i, carrier) in machine.axes.iter().enumerate() {
        let intra = errors.intra_at(machine, i, q[i], &situation, &Switches::ALL);
        for (component, value) in intra.into_iter().flatten().enumerate() {
            let constant = Parameter {
                component,
                axis: carrier.letter.char(),
                kind: ParameterKind::Degree(0),
            };
            if errors.motions[i][component].table.is_some()
                && let Some(column) = linearised.column(constant)
            {
                let name = constant.to_string();
                let parameter = format!("the table {}", &name[..name.len() - 1]);
                parts.push(Culprit {
                    parameter,
                    part: part(&column, value),
                });
            }
        }
    }
    let place: Vec<String> = machine
        .axes
        .iter()
        .zip(at.axes)
        .map(|(axis, q)| format!("{} = {q:.1}", axis.letter))
        .collect();
    Ok(Warning::Large {
        axis: bound.axis,
        correction: peak.correction,
        unit: bound.unit,
        place: place.join(", "),
        culprit: parts
            .into_iter()
            .max_by(|a, b| a.part.abs().total_cmp(&b.part.abs())),
    })
}

/// Corrections (mm, deg, one per axis) that verification found over their bounds.
#[must_use]
pub fn over_bounds(bounds: &[AxisBounds], largest: &[f64]) -> Vec<Warning> {
    let over = bounds.iter().zip(largest);
    over.filter(|(bound, largest)| **largest > f64::from(bound.value_bound))
        .map(|(bound, largest)| Warning::OverBound {
            axis: bound.axis,
            correction: *largest,
            bound: f64::from(bound.value_bound),
            unit: bound.unit,
        })
        .collect()
}

/// Tables in products that end before the travel of their axis.
pub fn short_tables(machine: &Machine, runtime: &Runtime<'_>) -> Vec<Warning> {
    let compensation = runtime.compensation();
    let mut warnings = Vec::new();
    let mut first = 0;
    for bank in compensation.banks() {
        let tables = first..first + usize::from(bank.tables);
        first = tables.end;
        let Some(axis) = machine.axes.get(usize::from(bank.input)) else {
            continue;
        };
        let (from, to) = (
            bank.start,
            bank.start + bank.step * (bank.points - 1) as f32,
        );
        // Points are f32: the ends may be off by their rounding.
        let slack = 1e-5 * (axis.travel[1] - axis.travel[0]);
        if bank.modulo
            || (f64::from(from) <= axis.travel[0] + slack
                && f64::from(to) >= axis.travel[1] - slack)
        {
            continue;
        }
        for table in tables {
            let in_product = compensation
                .terms()
                .any(|t| t.factors.len() > 1 && t.factors.iter().any(|f| usize::from(*f) == table));
            if in_product {
                warnings.push(Warning::ShortTable {
                    table,
                    axis: axis.letter.char(),
                    from,
                    to,
                });
            }
        }
    }
    warnings
}

//! Warnings about a compensation that are not errors.

use super::bounds::{Peak, Survey};
use super::{AxisBounds, Proof};
use serde::Serialize;
use trueaxis_model::errors::{Parameter, ParameterKind, Switches};
use trueaxis_model::kinematics::{Kinematics, Linearised, NotConverged, Policy, Twist};
use trueaxis_model::machine::Machine;
use trueaxis_model::policy::tolerance_urad;
use trueaxis_model::validate::{Runtime, Verification};

/// Corrections above these are unusual on a machine tool: mm, deg.
const LARGE: [f64; 2] = [1.0, 0.1];

/// The error that contributes most to a correction.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Culprit {
    /// Name, as in the error file.
    pub parameter: String,
    /// Contribution (mm, deg).
    pub part: f64,
}

/// Something the user should check.
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
        /// Where it occurs.
        place: String,
        /// What contributes most to it.
        culprit: Option<Culprit>,
    },
    /// A correction exceeds the bound of its axis and will be limited.
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
    /// The volumetric error is larger after than before.
    #[error("{what} is worse after than before: {after:.4} {unit} instead of {before:.4} {unit}{}", .place)]
    Worse {
        /// Which figure: mean or largest, translation or direction.
        what: &'static str,
        /// Without correction (µm, µrad).
        before: f64,
        /// With the tables (µm, µrad).
        after: f64,
        /// `µm` or `µrad`.
        unit: &'static str,
        /// Part of the travel, if not all of it.
        place: &'static str,
    },
    /// At some positions the tool direction is worse after than before, which should not happen anywhere.
    #[error(
        "the tool's direction is worse after than before by more than 1 µrad at {count} of {positions} positions"
    )]
    Turned {
        /// Number of such positions.
        count: usize,
        /// Number of positions tested.
        positions: usize,
    },
    /// A table in a product ends before the travel of its axis. It holds its end value there, which is kinematically
    /// wrong.
    #[error(
        "table {table} of {axis} covers {from} to {to} only, less than the travel, and is a factor of a product"
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

/// Warns about unusually large corrections.
pub fn large(survey: &Survey<'_>) -> Result<Vec<Warning>, NotConverged> {
    let mut warnings = Vec::new();
    let kinematics = &survey.kinematics;
    for ((axis, bound), peak) in kinematics
        .machine
        .axes
        .iter()
        .zip(survey.bounds())
        .zip(&survey.largest)
    {
        if peak.value > LARGE[usize::from(axis.letter.is_rotary())] {
            warnings.push(culprit(kinematics, &bound, peak)?);
        }
    }
    Ok(warnings)
}

/// Names the position of a correction and the error that contributes most to it, by the linearised model.
pub fn culprit(
    kinematics: &Kinematics<'_>,
    bound: &AxisBounds,
    peak: &Peak,
) -> Result<Warning, NotConverged> {
    let at = &peak.at;
    let (machine, errors) = (kinematics.machine, kinematics.errors);
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
    let linearised = Linearised::new(kinematics, &q, &situation);
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
    // A tabulated motion counts as a constant with its value here.
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
pub(crate) fn over_bounds(bounds: &[AxisBounds], largest: &[f64]) -> Vec<Warning> {
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

/// Tables in products that end before the travel of their axis does.
pub(crate) fn short_tables(machine: &Machine, runtime: &Runtime<'_>) -> Vec<Warning> {
    let compensation = runtime.compensation();
    let mut warnings = Vec::new();
    let mut first = 0;
    for bank in compensation.banks() {
        let tables = first..first + usize::from(bank.tables);
        first = tables.end;
        let Some(axis) = machine.axes.get(usize::from(bank.input)) else {
            continue;
        };
        let (from, to) = (bank.start, bank.end());
        // Points are f32, so ends may be off by their rounding.
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

/// Where the volumetric error is larger after than before by more than the tolerance (µm) can explain.
#[must_use]
pub fn worse(verification: &Proof, tolerance: f64) -> Vec<Warning> {
    let mut parts: Vec<(&Verification, &'static str)> =
        match (&verification.inside, &verification.outside) {
            (Some(inside), outside) if verification.partly_calibrated => {
                let outside = outside
                    .iter()
                    .map(|found| (found, ", where an error motion keeps its end value"));
                let inside = (inside, ", inside the ranges of the error motions");
                std::iter::once(inside).chain(outside).collect()
            }
            _ => vec![(&verification.travel, "")],
        };
    let held = verification.held.iter();
    parts.extend(held.map(|held| {
        (
            &held.found,
            ", where the rotary axes are for which the tables are made",
        )
    }));
    let of_part = |(found, place): (&Verification, &'static str)| {
        let turned = matches!(found.policy, Policy::Direction { .. }) && found.direction_worse > 0;
        let turned = turned.then_some(Warning::Turned {
            count: found.direction_worse,
            positions: found.positions,
        });
        let larger = larger_figures(found, tolerance).into_iter();
        let larger = larger.map(move |(what, before, after, unit)| Warning::Worse {
            what,
            before,
            after,
            unit,
            place,
        });
        larger.chain(turned).collect::<Vec<_>>()
    };
    parts.into_iter().flat_map(of_part).collect()
}

/// The figures that are larger after than before by more than the tolerance (µm) allows: name, both values and unit.
fn larger_figures(
    found: &Verification,
    tolerance: f64,
) -> Vec<(&'static str, f64, f64, &'static str)> {
    let [before, after] = [&found.before, &found.after];
    let [from, to] = [&before.translation_um, &after.translation_um];
    let [turned_from, turned_to] = [&before.direction_urad, &after.direction_urad];
    let mut figures = vec![
        ("the mean translation", from.mean, to.mean, "µm"),
        ("the largest translation", from.max, to.max, "µm"),
        (
            "the mean tool direction",
            turned_from.mean,
            turned_to.mean,
            "µrad",
        ),
        (
            "the largest tool direction",
            turned_from.max,
            turned_to.max,
            "µrad",
        ),
    ];
    let urad = tolerance_urad(found.policy, tolerance);
    figures.retain(|(_, before, after, unit)| {
        let slack = if *unit == "µm" { tolerance } else { urad };
        *after > before + slack
    });
    figures
}

//! Expected results of tests, and how far the uncertain error parameters let them be known: each is computed on
//! machines whose errors are drawn with their uncertainties (propagation of distributions, JCGM 101:2008).
//!
//! With tables, what is drawn remains of the true machine: the distribution of the draws is that of the result. Without
//! tables, the parameters as they are have their errors already, and drawing these once more would add them twice: a
//! range of 20 positions of a perfect axis would never contain 0. There the draws are machines with nothing but such errors.
//! Results are ranges, means and largest amounts of displacements, so the result of a sum of errors differs from that of one
//! part by no more than the result of the other part (triangle inequality): the interval extends this far to both sides.

use super::limits::Quantity;
use crate::tested::{self, CircleFound, PositioningFound, Tests};
use crate::volumetric::remaining_at;
use crate::{ReportError, Subject};
use nalgebra::DVector;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use trueaxis_model::numbers::ascending;

use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::numbers::normal;
use trueaxis_model::parallel;
use trueaxis_model::uncertainty::{MISFIT_MEAN, MISFIT_P95, TURN_MEAN, TURN_P95, probed_zone};
use trueaxis_model::validate::{Command, Region, Statistics, random_commands};

/// Number of drawn machines: the ends of a 95 % interval are then those of 94 to 96 %.
pub(crate) const DRAWS: usize = 1000;
/// Random positions at which the volumetric error of each is computed. Their choice widens the interval.
const POSITIONS: usize = 1000;
/// Makes the draws differ from those of positions.
const OWN: u64 = 0x00ce_47f1;

/// A value that is expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Expected {
    /// With tables the mean of the draws; otherwise, or without uncertainties, the value with the parameters as they are.
    pub value: f64,
    /// Contains the value with 95 %; `None` if no uncertainty is known, or that of a direction that was not measured.
    pub interval: Option<[f64; 2]>,
}

/// What 95 % of ranges of 20 independent normal values do not exceed, in standard deviations (studentized range), and
/// of the largest amounts among them. A test has 20 targets, and a smooth path has fewer independent places.
const RANGE_OF_20: f64 = 5.01;
const LARGEST_OF_20: f64 = 3.02;

/// By how much a displacement of the tip with this standard deviation in each coordinate, and a turn of the tool about
/// each axis (µrad), of which nothing else is known, change a quantity at most (95 %). A mean length changes by no more than the root mean square of what is added, a
/// range by no more than its range, a largest amount by no more than its largest.
fn by_displacement(quantity: &Quantity, um: f64, urad: f64) -> f64 {
    match quantity {
        Quantity::Volumetric {
            at_tip: false,
            is_mean,
            ..
        } => urad * if *is_mean { TURN_MEAN } else { TURN_P95 },
        Quantity::Volumetric { is_mean: true, .. } => um * MISFIT_MEAN,
        Quantity::Volumetric { .. } => um * MISFIT_P95,
        Quantity::Circle('F', _) => um * LARGEST_OF_20,
        _ => um * RANGE_OF_20,
    }
}

/// Computes quantities of volumetric error and tests (µm, µrad); `None` for those that the machine has no room for.
/// Errors that the model lacks, and `stated_um` for what readings do not show, widen the intervals.
pub(crate) fn expected(
    subject: &Subject<'_>,
    quantities: &[Quantity],
    stated_um: f64,
) -> Result<Vec<Option<Expected>>, ReportError> {
    let probed = probed_zone(subject.machine, subject.errors);
    let places = [subject.machine, &probed].map(|machine| {
        let kinematics = Kinematics::new(machine, subject.errors).with_policy(subject.policy);
        random_commands(&kinematics, Region::Travel, POSITIONS, subject.seed)
    });
    let [travel, probed] = places;
    let commands = [travel?, probed?];
    let of = |errors: &ErrorModel| {
        let drawn = Subject {
            errors,
            ..subject.clone()
        };
        values(&drawn, &commands, quantities)
    };
    let drawn = draws(subject);
    let as_they_are = match subject.compensation.is_some() && !drawn.is_empty() {
        true => vec![None; quantities.len()],
        false => of(subject.errors)?,
    };
    let found = parallel::try_map(&drawn, of)?;
    let one = |(k, quantity): (usize, &Quantity)| {
        let all: Option<Vec<SampledValue>> = found.iter().map(|values| values[k]).collect();
        let known = match (as_they_are[k], all?) {
            (Some(known), all) if all.is_empty() => Expected {
                value: known.value,
                interval: None,
            },
            (Some(known), all) => around(known, &all),
            (None, all) if all.is_empty() => return None,
            (None, all) => summary(&all),
        };
        Some(widened(known, quantity, subject.errors, stated_um))
    };
    Ok(quantities.iter().enumerate().map(one).collect())
}

/// Widens an interval by errors that the model lacks and what readings do not show; none for a direction not measured.
fn widened(found: Expected, quantity: &Quantity, errors: &ErrorModel, stated_um: f64) -> Expected {
    let misfit = errors.misfit.unwrap_or(0.0) * 1e3;
    let turn = errors.misfit_of_direction.unwrap_or(0.0) * 1e6;
    let by = by_displacement(quantity, libm::hypot(misfit, stated_um), turn);
    // The uncertainty of the parameters does not include errors outside the model.
    let is_known = !matches!(quantity, Quantity::Volumetric { at_tip: false, .. })
        || errors.is_direction_measured();
    let known = found.interval.filter(|_| is_known);
    Expected {
        interval: known.map(|[low, high]| [(low - by).max(0.0), high + by]),
        ..found
    }
}

/// True if an error alone changes a quantity of an otherwise perfect machine.
pub(super) fn matters(subject: &Subject<'_>, parameter: Parameter, quantity: Quantity) -> bool {
    /// 10 µm or 10 µrad of it, at the end of the travel, must do more than this (µm, µrad).
    const NOTHING: f64 = 0.01;
    const FEW: usize = 30;
    if let Quantity::Parameter(of) = quantity {
        return of == parameter;
    }
    let mut errors = ErrorModel::perfect(subject.machine);
    let whole = if parameter.is_angular() { 1e-5 } else { 1e-2 };
    let size = match (parameter.kind, subject.machine.index(parameter.axis)) {
        (ParameterKind::Degree(k), Some(index)) => {
            let axis = &subject.machine.axes[index];
            let ends = axis.travel.map(|q| axis.to_kinematic(q).abs());
            whole / ends[0].max(ends[1]).powi(i32::from(k))
        }
        _ => whole,
    };
    errors.set(subject.machine, parameter, size);
    let alone = Subject {
        errors: &errors,
        compensation: None,
        ..subject.clone()
    };
    let kinematics = Kinematics::new(subject.machine, &errors);
    let commands = random_commands(&kinematics, Region::Travel, FEW, subject.seed);
    let found = commands.ok().and_then(|commands| {
        let all = values(&alone, &[commands.clone(), commands], &[quantity]);
        all.ok()?.first().copied().flatten()
    });
    // What cannot be computed may matter.
    found.is_none_or(|found| found.value > NOTHING)
}

/// A value, and its standard uncertainty from the choice of random positions.
#[derive(Clone, Copy, Debug)]
struct SampledValue {
    value: f64,
    choice: f64,
}

impl SampledValue {
    fn exact(value: f64) -> Self {
        Self { value, choice: 0.0 }
    }

    fn mean(all: impl Iterator<Item = f64>) -> Self {
        let found = Statistics::of(all);
        let variance = (found.rms * found.rms - found.mean * found.mean).max(0.0);
        Self {
            value: found.mean,
            choice: (variance / POSITIONS as f64).sqrt(),
        }
    }

    /// Where a rotary axis cannot turn the tool, a few positions have most of the error of direction. So the uncertainty is
    /// of no distribution: the number of values below the true one is binomial, and its standard deviation is one of ranks.
    fn p95(all: impl Iterator<Item = f64>) -> Self {
        let mut all: Vec<f64> = all.collect();
        ascending(&mut all);
        let value = Statistics::of(all.iter().copied()).p95;
        let n = all.len() as f64;
        let ranks = (n * 0.95 * 0.05).sqrt();
        let at = |rank: f64| all[(rank.max(0.0) as usize).min(all.len() - 1)];
        Self {
            value,
            choice: 0.5 * (at(0.95 * n + ranks) - at(0.95 * n - ranks)),
        }
    }
}

/// Mean and 95 % interval, with equal probabilities beyond both ends.
fn summary(found: &[SampledValue]) -> Expected {
    let mut values: Vec<f64> = found.iter().map(|found| found.value).collect();
    ascending(&mut values);
    let n = values.len();
    let beyond = n / 40;
    let mean = |of: fn(&SampledValue) -> f64| found.iter().map(of).sum::<f64>() / n as f64;
    let choice = 2.0 * mean(|found| found.choice);
    Expected {
        value: mean(|found| found.value),
        interval: Some([
            (values[beyond] - choice).max(0.0),
            values[n - 1 - beyond] + choice,
        ]),
    }
}

/// A value, and the interval that extends on both sides as far as 95 % of the errors of parameters change it at most.
fn around(known: SampledValue, errors: &[SampledValue]) -> Expected {
    let mut values: Vec<f64> = errors.iter().map(|found| found.value).collect();
    ascending(&mut values);
    let by = values[values.len() * 19 / 20] + 2.0 * known.choice;
    Expected {
        value: known.value,
        interval: Some([(known.value - by).max(0.0), known.value + by]),
    }
}

/// A machine with the calibrated ranges and measured points of these errors, and no error.
fn perfect(subject: &Subject<'_>) -> ErrorModel {
    let mut perfect = ErrorModel::perfect(subject.machine);
    perfect.calibrated = subject.errors.calibrated;
    let motions = perfect.motions.iter_mut().flatten();
    for (motion, of) in motions.zip(subject.errors.motions.iter().flatten()) {
        motion.table = of.table.clone();
        if let Some(table) = &mut motion.table {
            let both = [Some(&mut table.positive), table.negative.as_mut()];
            both.into_iter()
                .flatten()
                .for_each(|values| values.fill(0.0));
        }
    }
    perfect
}

/// The errors with their uncertainties, so many times, with tables; otherwise machines with nothing but the errors of their
/// parameters. None if no uncertainty is known.
fn draws(subject: &Subject<'_>) -> Vec<ErrorModel> {
    let errors = subject.errors;
    let covariance = errors.covariance();
    if covariance.parameters.is_empty() && errors.table_uncertainty.is_empty() {
        return Vec::new();
    }
    let root = covariance.root();
    let base = match subject.compensation {
        Some(_) => errors.clone(),
        None => perfect(subject),
    };
    let mut random = Pcg64Mcg::seed_from_u64(subject.seed ^ OWN);
    let mut draw = || {
        let mut drawn = base.clone();
        let off = &root * DVector::from_fn(root.ncols(), |_, _| normal(&mut random));
        for (parameter, off) in covariance.parameters.iter().zip(off.iter()) {
            let value = base.parameters.get(parameter).copied().unwrap_or(0.0);
            drawn.set(subject.machine, *parameter, value + off);
        }
        for ((axis, component), uncertainty) in &errors.table_uncertainty {
            let Some(table) = &mut drawn.motions[*axis][*component].table else {
                continue;
            };
            let both = [Some(&mut table.positive), table.negative.as_mut()];
            for values in both.into_iter().flatten() {
                for (value, u) in values.iter_mut().zip(uncertainty) {
                    *value += u * normal(&mut random);
                }
            }
        }
        drawn
    };
    (0..DRAWS).map(|_| draw()).collect()
}

/// The quantities of one machine, with the tables if it has any, at positions over the travel and in the probed zone.
fn values(
    subject: &Subject<'_>,
    commands: &[Vec<Command>; 2],
    quantities: &[Quantity],
) -> Result<Vec<Option<SampledValue>>, ReportError> {
    let at = |is_of_zone: bool| -> Result<Option<Vec<[f64; 2]>>, ReportError> {
        let is_this = |quantity: &Quantity| matches!(quantity, Quantity::Volumetric { is_probed, .. } if *is_probed == is_of_zone);
        if !quantities.iter().any(is_this) {
            return Ok(None);
        }
        remaining_at(subject, &commands[usize::from(is_of_zone)]).map(Some)
    };
    let volumetric = [at(false)?, at(true)?];
    let names: Vec<String> = quantities.iter().filter_map(test_name).collect();
    let tests = match names.is_empty() {
        true => Tests::default(),
        false => tested::some(subject, |name| names.iter().any(|wanted| wanted == name)),
    };
    let of = |quantity: &Quantity| match quantity {
        Quantity::Volumetric {
            at_tip,
            is_mean,
            is_probed,
        } => volumetric[usize::from(*is_probed)].as_ref().map(|found| {
            let (part, unit) = if *at_tip { (0, 1e3) } else { (1, 1e6) };
            let all = found.iter().map(|errors| errors[part] * unit);
            match is_mean {
                true => SampledValue::mean(all),
                false => SampledValue::p95(all),
            }
        }),
        _ => test_result(&tests, quantity).map(SampledValue::exact),
    };
    Ok(quantities.iter().map(of).collect())
}

/// The name of the test that shows a quantity.
fn test_name(quantity: &Quantity) -> Option<String> {
    match quantity {
        Quantity::Circle(_, plane) => Some(plane.iter().collect()),
        Quantity::Positioning(_, axis) => Some(axis.to_string()),
        Quantity::Diagonal(_) => Some(quantity.name().replace("E ", "").replace('-', "−")),
        Quantity::Volumetric { .. } | Quantity::Parameter(_) | Quantity::Validation { .. } => None,
    }
}

/// The result (µm) of a test of the machine, with the tables if it has any.
fn test_result(tests: &Tests, quantity: &Quantity) -> Option<f64> {
    let name = test_name(quantity)?;
    match quantity {
        Quantity::Circle(what, _) => {
            let test = tests.circles.iter().find(|test| test.plane == name)?;
            let found: &CircleFound = test.after.as_ref().unwrap_or(&test.before);
            let radial = found.radial_um.iter();
            Some(match what {
                'G' => found.deviation_um,
                'F' => radial.fold(0.0, |most, r| r.abs().max(most)),
                _ => found.hysteresis_um,
            })
        }
        Quantity::Positioning(what, axis) => {
            let test = tests.positioning.iter().find(|test| test.axis == *axis)?;
            let found: &PositioningFound = test.after.as_ref().unwrap_or(&test.before);
            match what {
                'E' => found.systematic_um,
                'M' => found.mean_range_um,
                _ => found.reversal_um,
            }
        }
        Quantity::Diagonal(_) => {
            let test = tests.diagonals.iter().find(|test| test.name == name)?;
            test.systematic_after_um.or(Some(test.systematic_before_um))
        }
        Quantity::Volumetric { .. } | Quantity::Parameter(_) | Quantity::Validation { .. } => None,
    }
}

#[cfg(test)]
mod tests;

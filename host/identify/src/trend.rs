//! Tests whether the residuals depend on something that is not in the model: time, temperature, the run, the
//! direction from which an axis arrived.

use crate::rows::{LARGEST_LENGTH, Problem};
use crate::{Identified, root_mean_square};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use trueaxis_model::numbers::extremes;

/// A displacement of the tip relative to the balls (workpiece frame) that varies with some quantity, fitted together
/// with everything that was identified.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trend {
    /// Displacement of the tip (mm) from the smallest to the largest value of the quantity.
    pub change: Vector3<f64>,
    /// Standard uncertainty of each coordinate of that (mm).
    pub uncertainty: Vector3<f64>,
    /// Squared length in standard deviations: χ² with three degrees of freedom if there is no trend.
    pub square: f64,
}

impl Trend {
    /// True if chance gives one this large once in a thousand.
    #[must_use]
    pub fn is_significant(&self) -> bool {
        self.square > SIGNIFICANT
    }
}

/// The 99.9 % quantile of χ² with three degrees of freedom.
const SIGNIFICANT: f64 = 16.27;

/// The trend along a value of each row (in the order of the file). `None` if all rows have the same value, or if
/// these rows cannot separate it from what was identified: it would have to be larger than any error to show.
pub(crate) fn trend(
    problem: &Problem<'_>,
    identified: &Identified,
    values: &[f64],
) -> Option<Trend> {
    let [low, high] = extremes(values.iter().copied());
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let parts: Vec<f64> = (problem.places.iter())
        .map(|place| (values[place.row] - mean) / (high - low))
        .collect();
    if !parts.iter().all(|part| part.is_finite()) {
        return None;
    }
    let place = &identified.place;
    let residuals = problem.residuals(&place.estimate, &place.weights);
    let columns = shifts(problem, identified, &parts)?;
    let normal: Matrix3<f64> = columns.tr_mul(&columns).fixed_view::<3, 3>(0, 0).into();
    let gradient: Vector3<f64> = columns.tr_mul(&residuals).fixed_rows::<3>(0).into();
    let inverse = normal.try_inverse()?;
    let change = inverse * gradient;
    // The noise is the residual without the trend, unless it is stated.
    let square = residuals.norm_squared();
    let freedom = identified.freedom.saturating_sub(3).max(1) as f64;
    let noise = match identified.of_stated {
        Some(_) => 1.0,
        None => (square - change.dot(&gradient)).max(0.0) / freedom,
    };
    let covariance = inverse * noise;
    let uncertainty = covariance.diagonal().map(f64::sqrt);
    if !uncertainty.iter().all(|u| *u < LARGEST_LENGTH) {
        return None;
    }
    Some(Trend {
        change,
        uncertainty,
        square: change.dot(&gradient) / noise,
    })
}

/// What is left of residuals that follow a quantity along x, y and z once the unknowns have absorbed what they can.
fn shifts(problem: &Problem<'_>, identified: &Identified, parts: &[f64]) -> Option<DMatrix<f64>> {
    let place = &identified.place;
    let jacobian = problem.jacobian(&place.estimate, &place.weights);
    // Only probings: an instrument that has moved is a drift of its set-up.
    let mut columns = DMatrix::zeros(jacobian.nrows(), 3);
    for (i, (part, weight)) in parts.iter().zip(&place.weights.rows).enumerate() {
        for k in 0..3 {
            columns[(3 * i + k, k)] = part * weight;
        }
    }
    // The part that the unknowns cannot absorb.
    for mut column in columns.column_iter_mut() {
        let step: DVector<f64> = place.factor.step(&jacobian.tr_mul(&column))?;
        column += &jacobian * step;
    }
    Some(columns)
}

/// Repeated probings of one ball at the same rotary positions, from the same directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repeats {
    /// Number of places that were probed more than once.
    pub places: usize,
    /// Degrees of freedom: probings beyond the first at each place, three coordinates each.
    pub freedom: usize,
    /// Pooled standard deviation of a coordinate (mm).
    pub deviation: f64,
    /// Ratio of the residuals to that.
    pub ratio: f64,
    /// True if chance gives a ratio this large less than once in a thousand: the model lacks something.
    pub is_less: bool,
}

/// Rotary positions (deg) that differ by less are equal.
const SAME: f64 = 1e-3;
/// Standard deviations of the logarithm of a ratio, one-sided: one in a thousand.
const CHANCE: f64 = 3.1;

/// Repeatability, if anything was probed more than once.
pub(crate) fn repeats(
    problem: &Problem<'_>,
    identified: &Identified,
    keys: &[Vec<f64>],
) -> Option<Repeats> {
    let after: Vec<&super::RowResult> = identified.rows.iter().collect();
    let is_same = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < SAME);
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for i in (0..keys.len()).filter(|i| after[*i].is_trusted) {
        match groups.iter_mut().find(|g| is_same(&keys[g[0]], &keys[i])) {
            Some(group) => group.push(i),
            None => groups.push(vec![i]),
        }
    }
    groups.retain(|group| group.len() > 1);
    let freedom: usize = groups.iter().map(|group| 3 * (group.len() - 1)).sum();
    let squares: f64 = (groups.iter())
        .map(|group| {
            let all = group.iter().map(|i| after[*i].after);
            let mean = all.clone().sum::<Vector3<f64>>() / group.len() as f64;
            all.map(|miss| (miss - mean).norm_squared()).sum::<f64>()
        })
        .sum();
    if freedom == 0 || squares <= 0.0 {
        return None;
    }
    let deviation = (squares / freedom as f64).sqrt();
    let ratio = identified.noise / deviation;
    let chance = (0.5 / freedom as f64 + 0.5 / problem.equations() as f64).sqrt();
    Some(Repeats {
        places: groups.len(),
        freedom,
        deviation,
        ratio,
        is_less: libm::log(ratio) > CHANCE * chance,
    })
}

/// Residuals at one ball.
#[derive(Clone, Debug, PartialEq)]
pub struct OfBall {
    /// Name.
    pub name: String,
    /// Number of probings.
    pub rows: usize,
    /// Root of the mean square distance from tip to ball (mm).
    pub rms: f64,
    /// Largest distance (mm).
    pub max: f64,
}

/// Residuals at each ball, in the order of the file.
pub(crate) fn by_ball(problem: &Problem<'_>, identified: &Identified) -> Vec<OfBall> {
    let of = |(ball, name): (usize, &String)| {
        let rows = problem.places.iter().filter(|place| place.ball == ball);
        let left: Vec<f64> = rows.map(|p| identified.rows[p.row].after.norm()).collect();
        OfBall {
            name: name.clone(),
            rows: left.len(),
            rms: root_mean_square(left.iter().copied()),
            max: left.iter().copied().fold(0.0, f64::max),
        }
    };
    problem.balls.iter().enumerate().map(of).collect()
}

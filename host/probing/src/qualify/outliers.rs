//! Finds touches of a ball that do not fit the others, and a ball that was moved, as `identify` finds rows and set-ups: one
//! outlier at a time, each with the hypothesis that explains it.

use nalgebra::{DMatrix, DVector, Vector3};
use trueaxis_identify::deviations;

/// What does not fit the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TouchSuspect {
    /// One touch (by index), and how much farther from the ball it is than the others say (mm).
    Touch(usize, f64),
    /// The ball was moved before this touch (by index), by this vector (mm, workpiece frame).
    Moved(usize, Vector3<f64>),
}

/// Hypotheses are accepted beyond this many standard deviations of a normal distribution, as in `identify`.
const CRITICAL: f64 = 5.2;
/// A moved ball explains this fraction of the squares of all residuals.
const EXPLAINS: f64 = 0.5;
/// The fraction of a hypothesis' effect that the unknowns must not be able to absorb.
const TESTABLE: f64 = 1e-3;
/// Largest fraction of the touches that count as outliers one by one.
const MOST: f64 = 0.2;

/// The outliers among touches with these residuals (mm) and their derivatives. `groups` are the touches (by index) of each
/// rotary position in their order, with the direction from the ball.
pub fn outliers(
    left: &DVector<f64>,
    by: &DMatrix<f64>,
    groups: &[Vec<(usize, Vector3<f64>)>],
) -> Vec<TouchSuspect> {
    let mut basis = by.clone();
    let mut rest = left.clone();
    let mut found = Vec::new();
    let most = (left.len() as f64 * MOST).ceil() as usize;
    while found.len() < most {
        let space = basis.clone().qr().q();
        rest -= &space * space.tr_mul(&rest);
        let mut best: Option<(f64, TouchSuspect, DMatrix<f64>)> = None;
        let mut offer =
            |columns: DMatrix<f64>, least: f64, outlier: &dyn Fn(&DVector<f64>) -> TouchSuspect| {
                let Some((gain, change)) = tested(&space, &rest, &columns, least) else {
                    return;
                };
                if best.as_ref().is_none_or(|(most, ..)| gain > *most) {
                    best = Some((gain, outlier(&change), columns));
                }
            };
        for touch in 0..rest.len() {
            let mut column = DMatrix::zeros(rest.len(), 1);
            column[(touch, 0)] = 1.0;
            offer(column, 0.0, &|change| TouchSuspect::Touch(touch, change[0]));
        }
        for group in groups {
            let mut columns = DMatrix::zeros(rest.len(), 3);
            for k in (1..group.len()).rev() {
                let (touch, out) = &group[k];
                columns.set_row(*touch, &out.transpose());
                offer(columns.clone(), EXPLAINS, &|change| {
                    TouchSuspect::Moved(*touch, Vector3::new(change[0], change[1], change[2]))
                });
            }
        }
        let Some((_, outlier, columns)) = best else {
            break;
        };
        let first = basis.ncols();
        basis = basis.insert_columns(first, columns.ncols(), 0.0);
        basis
            .columns_mut(first, columns.ncols())
            .copy_from(&columns);
        found.push(outlier);
    }
    found
}

/// The logarithm of the likelihood of a hypothesis less the penalty for its unknowns, and these, if it is significant and
/// explains at least this fraction of the squares.
fn tested(
    space: &DMatrix<f64>,
    rest: &DVector<f64>,
    columns: &DMatrix<f64>,
    least: f64,
) -> Option<(f64, DVector<f64>)> {
    let count = columns.ncols();
    let freedom = rest.len().checked_sub(space.ncols() + count)?;
    if freedom == 0 {
        return None;
    }
    let free = columns - space * space.tr_mul(columns);
    let normal = free.tr_mul(&free);
    let whole = columns.norm_squared() / count as f64;
    let smallest = normal.symmetric_eigenvalues().min();
    if smallest.is_nan() || smallest < TESTABLE * whole {
        return None;
    }
    let gradient = free.tr_mul(rest);
    let change = normal.try_inverse()? * &gradient;
    let (all, explained) = (rest.norm_squared(), change.dot(&gradient));
    let unexplained = (all - explained).max(f64::MIN_POSITIVE);
    let ratio = explained / count as f64 / (unexplained / freedom as f64);
    if explained < least * all || deviations(ratio, count, freedom) < CRITICAL {
        return None;
    }
    let gain = 0.5 * freedom as f64 * libm::log(all / unexplained)
        - 0.5 * count as f64 * libm::log(rest.len() as f64);
    Some((gain, change))
}

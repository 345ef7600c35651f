//! Drift of the artefact and of instruments that the residuals show.

use super::rows::Problem;
use super::snooping::deviations;
use super::{Identified, Unknown};
use nalgebra::DVector;

/// A component of drift is significant beyond this many standard deviations of a normal distribution: chance gives
/// one this large once in a thousand.
const SIGNIFICANT: f64 = 3.09;
/// The fraction of its effect that the unknowns must not be able to absorb. Drift of rows in an order in which a
/// parameter changes steadily would otherwise take the place of the parameter.
const TESTABLE: f64 = 0.1;

/// The drift that the residuals of an identification show: linear in time, along and about the axes of the workpiece
/// frame, of the artefact and of each set-up whose rows all have a time. The component with the largest F is accepted
/// if it is significant, then the next one is searched. For
/// [`Observations::drift`](crate::formats::observations::Observations::drift).
#[must_use]
pub fn drifting(problem: &Problem<'_>, identified: &Identified) -> Vec<(Option<usize>, usize)> {
    let is_timed = |setup: usize| problem.observed.periods[setup].is_some();
    let setups = (0..problem.observed.setups.len()).filter(|i| is_timed(*i));
    let artefact = problem.period.map(|_| None);
    let sources = artefact.into_iter().chain(setups.map(Some));
    let all = sources.flat_map(|source| (0..6).map(move |k| (source, k)));
    let all: Vec<(Option<usize>, usize)> = all.collect();
    if all.is_empty() {
        return all;
    }
    let place = &identified.place;
    let unknowns: Vec<Unknown> = all.iter().map(|(of, k)| Unknown::Drift(*of, *k)).collect();
    let columns = problem.derivatives(&unknowns, &place.estimate, &place.weights);
    let jacobian = problem.jacobian(&place.estimate, &place.weights);
    let mut left = problem.residuals(&place.estimate, &place.weights);
    // The part that the unknowns cannot absorb, and the size of the whole.
    let mut free: Vec<(DVector<f64>, f64)> = (columns.column_iter())
        .map(|column| {
            let mut part = column.into_owned();
            if let Some(step) = place.factor.step(&jacobian.tr_mul(&column)) {
                part += &jacobian * step;
            }
            (part, column.norm())
        })
        .collect();
    let mut freedom = identified.freedom;
    let mut found = Vec::new();
    while freedom > 1 {
        let rest = left.norm_squared();
        let gain = |(part, whole): &(DVector<f64>, f64)| {
            let size = part.norm();
            let is_testable = size > TESTABLE * whole;
            is_testable.then(|| (part.dot(&left) / size).powi(2))
        };
        let gains = free.iter().map(gain).enumerate();
        let gains = gains.filter_map(|(i, gain)| Some((i, gain?)));
        let Some((best, gain)) = gains.max_by(|a, b| a.1.total_cmp(&b.1)) else {
            break;
        };
        let ratio = gain / ((rest - gain).max(f64::MIN_POSITIVE) / (freedom - 1) as f64);
        if deviations(ratio, 1, freedom - 1) < SIGNIFICANT {
            break;
        }
        found.push(all[best]);
        let unit = free[best].0.normalize();
        left -= &unit * unit.dot(&left);
        for (part, _) in &mut free {
            *part -= &unit * unit.dot(part);
        }
        freedom -= 1;
    }
    found
}

//! Error motions that runs show, kept as tables beside errors that are identified otherwise.

use crate::direct_error::DirectError;
use crate::measurement::Measurement;
use crate::motion::without;
use crate::solve::{DirectResult, SolveOptions, solve};
use crate::warnings::counted_twice;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;

/// Tables that change by less than this (mm, or rad over a metre) do not change what is identified with them.
const SAME: f64 = 2e-5;
const OVER: f64 = 1000.0;

/// The errors that are `known`, with tables of the motions that runs show on a machine with the errors in `found`.
///
/// # Errors
/// [`DirectError`]: as for [`solve`].
pub fn kept(
    machine: &Machine,
    runs: &[Measurement],
    known: &ErrorModel,
    found: &ErrorModel,
) -> Result<(ErrorModel, DirectResult), DirectError> {
    let mut solved = solve(machine, runs, found, SolveOptions::default())?;
    // Slopes belong to the squareness that is identified with them.
    let slopes = counted_twice(machine, &solved.errors).len();
    solved.doubts.truncate(solved.doubts.len() - slopes);
    let anew = solved.motions.iter();
    let anew: Vec<(usize, usize, bool)> = anew
        .map(|m| (m.axis, m.component, m.negative.is_some()))
        .collect();
    let mut errors = without(known, machine, &anew, &[]);
    let left: Vec<_> = errors.parameters.keys().copied().collect();
    errors.correlated = known.correlated.as_ref().map(|all| {
        let gone = all.parameters.iter().filter(|p| !left.contains(p));
        all.without(&gone.copied().collect::<Vec<_>>())
    });
    errors.slopes_beside_squareness = true;
    for motion in &solved.motions {
        let of = (motion.axis, motion.component);
        let Some(table) = solved.errors.motions[of.0][of.1].table.clone() else {
            continue;
        };
        errors.tabulate(of.0, of.1, table);
        let uncertainty = solved.errors.table_uncertainty.get(&of).cloned();
        errors
            .table_uncertainty
            .extend(uncertainty.map(|u| (of, u)));
    }
    Ok((errors, solved))
}

/// True if no table of one model differs from that of the other by more than what matters.
#[must_use]
pub fn same_tables(one: &ErrorModel, other: &ErrorModel) -> bool {
    let motions = one.motions.iter().zip(&other.motions);
    let mut pairs = motions.flat_map(|(one, other)| one.iter().zip(other).enumerate());
    pairs.all(|(component, (one, other))| {
        let size = if component >= 3 { OVER } else { 1.0 };
        let (Some(one), Some(other)) = (&one.table, &other.table) else {
            return one.table.is_none() && other.table.is_none();
        };
        let negative = one.negative.iter().flatten();
        let values = one.positive.iter().chain(negative);
        let others = other.positive.iter().chain(other.negative.iter().flatten());
        values.zip(others).all(|(a, b)| (a - b).abs() * size < SAME)
    })
}

//! Finds the errors that each term of a compensation corrects.

use super::groups::Group;
use super::sources::Source;
use super::{Arranged, arranged};
use crate::schemes::products::Placed;
use crate::schemes::{Options, SchemeError};
use trueaxis::{Draft, Largest};
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::machine::Machine;
use trueaxis_model::policy::of_blob;

/// The errors of each term of a compensation that this scheme made from these errors; empty for terms that subtract
/// the zero position. `None` if the compensation does not match.
///
/// A blob contains no names, so the scheme is run again on the errors and its result compared term by term.
///
/// # Errors
/// [`SchemeError`].
pub fn names(
    machine: &Machine,
    errors: &ErrorModel,
    compensation: &Largest<'_>,
) -> Result<Option<Vec<Vec<String>>>, SchemeError> {
    let points = compensation.banks().iter().map(|bank| bank.points as usize);
    let options = Options {
        policy: of_blob(compensation.policy()),
        points: points.max().filter(|points| *points > 2),
        ..Options::default()
    };
    let open = compensation.terms().filter(|term| term.limits.is_some());
    let weights: Vec<f32> = open.map(|term| term.weight).collect();
    let set = errors.parameters.iter();
    let set = set.filter(|(_, value)| weights.contains(&(**value as f32)));
    let set: Vec<Parameter> = set.map(|(parameter, _)| *parameter).collect();
    for adjustable in [Vec::new(), set] {
        match arranged(machine, errors, &adjustable, &options) {
            Ok(Arranged { draft, names, .. }) => {
                if let Some(names) = matched(&draft, names, compensation) {
                    return Ok(Some(names));
                }
            }
            // Two errors with the same value may both have been requested although there is no room for both.
            Err(SchemeError::TooManyWeights { .. }) => {}
            Err(error) => return Err(error),
        }
    }
    Ok(None)
}

/// The names in a draft, if its terms are those of the compensation.
fn matched(
    draft: &Draft,
    names: Vec<Vec<String>>,
    compensation: &Largest<'_>,
) -> Option<Vec<Vec<String>>> {
    let columns: Vec<&Vec<f32>> = draft.banks.iter().flat_map(|bank| &bank.columns).collect();
    let largest = |column: &Vec<f32>| column.iter().fold(0.0_f32, |m, v| m.max(v.abs()));
    // To the precision of 16-bit integers.
    let same = |(number, column): (usize, &&Vec<f32>)| {
        let peak = compensation.peak(number).unwrap_or(f32::NAN);
        (peak - largest(column)).abs() <= 1e-4 * peak
    };
    let mut known = draft.terms.iter().zip(names);
    let mut found = Vec::new();
    for term in compensation.terms() {
        if term.factors.is_empty() {
            found.push(Vec::new());
            continue;
        }
        let (drafted, names) = known.next()?;
        let is_it = term.output == drafted.output
            && term.weight == drafted.weight
            && term.limits == drafted.limits
            && *term.factors == drafted.factors[..];
        if !is_it {
            return None;
        }
        found.push(names);
    }
    let all = columns.len() == compensation.tables() && columns.iter().enumerate().all(same);
    (all && known.next().is_none()).then_some(found)
}

/// The errors of each term.
pub(crate) fn of_terms(
    sources: &[Source],
    groups: &[Group],
    placed: &[Placed],
) -> Vec<Vec<String>> {
    let of = |placed: &Placed| {
        let members = groups.get(placed.tag).map(|group| &group.members);
        let members = members.into_iter().flatten();
        members
            .map(|(member, _)| sources[*member].name.clone())
            .collect()
    };
    placed.iter().map(of).collect()
}

/// The number of tables of each output, the terms of each adjustable weight, and errors without a term.
pub fn notes(
    machine: &Machine,
    sources: &[Source],
    open: &[Option<usize>],
    placed: &[Placed],
    names: &[Vec<String>],
) -> Vec<String> {
    let tables = machine.axes.iter().enumerate().map(|(output, axis)| {
        let of = |p: &&Placed| usize::from(p.term.output) == output;
        let terms = placed.iter().filter(of);
        let mut tables: Vec<u8> = terms.flat_map(|p| p.term.factors.iter().copied()).collect();
        tables.sort_unstable();
        tables.dedup();
        format!("{} {}", axis.letter, tables.len())
    });
    let tables: Vec<String> = tables.collect();
    let mut notes = vec![format!("tables of each output: {}", tables.join(", "))];
    let mut weights = Vec::new();
    let mut idle = Vec::new();
    for (number, source) in sources.iter().enumerate() {
        let set = |p: &Placed| open.get(p.tag).is_some_and(|open| *open == Some(number));
        let terms = placed.iter().enumerate().filter(|(_, p)| set(p));
        let terms: Vec<String> = terms.map(|(k, _)| k.to_string()).collect();
        if !terms.is_empty() {
            weights.push(format!("{} of term {}", source.name, terms.join(", ")));
        }
        if !names.iter().flatten().any(|name| *name == source.name) {
            idle.push(source.name.clone());
        }
    }
    if !weights.is_empty() {
        notes.push(format!("weights that can be set: {}", weights.join("; ")));
    }
    if !idle.is_empty() {
        notes.push(format!(
            "errors that ask for no correction under this policy: {}",
            idle.join(", ")
        ));
    }
    notes
}

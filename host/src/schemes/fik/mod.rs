//! The scheme `fik` of Chapter 7 of the source document: one chain of tables for each closed-form term of each
//! error, with the error itself as a weight that can be set, or in a table.
//!
//! The closed forms are those of Δq = −J⁺·E (Eq. 51, 59), the correction of first order; here they are derived
//! from the machine: sampled where that tells them exactly ([`form`]), put together where errors ask the same
//! of an output ([`groups`]), and taken apart into products of functions of one input each ([`chains`]).
//! Second order is left out, as in the document.

mod chains;
mod form;
mod groups;
mod sources;
#[cfg(test)]
mod tests;

use crate::errors::{ErrorModel, Parameter};
use crate::kinematics::Kinematics;
use crate::machine::Machine;
use crate::schemes::blank::blank;
use crate::schemes::products::points;
use crate::schemes::products::{Factor, Placed, Product, layout, subtracted};
use crate::schemes::{Found, Options, SchemeError};
use form::Variables;
use groups::Group;
use sources::Source;
use trueaxis::Draft;

/// Points of tables that are no straight lines, unless told otherwise.
pub const POINTS: usize = 101;
/// The most tables of a blob, which numbers them in a byte.
const TABLES: usize = 255;
/// A weight that is set may go from nothing to this many times what it is.
const MOST_WEIGHT: f64 = 2.0;
/// How far a weight of nothing may be set, if asked for: mm, and rad or mm per mm.
const FROM_NOTHING: [f64; 2] = [0.05, 2e-4];

/// The tables of Chapter 7 for any machine with two rotary axes. The weights of the errors `adjustable` can be
/// set on the controller, or, if it is empty, of those that are one term: scales and offsets, which drift.
///
/// # Errors
/// [`SchemeError`].
pub fn compile(
    machine: &Machine,
    errors: &ErrorModel,
    adjustable: &[Parameter],
    options: &Options,
) -> Result<Found, SchemeError> {
    let kinematics = Kinematics::new(machine, errors).with_policy(options.policy);
    let is_known = |p: &Parameter| errors.clone().set(machine, *p, 0.0);
    if let Some(unknown) = adjustable.iter().find(|p| !is_known(p)) {
        return Err(SchemeError::NoSuchError {
            name: unknown.to_string(),
        });
    }
    let Some(variables) = Variables::new(machine) else {
        return Err(SchemeError::axes(machine, "fik", "two rotary axes"));
    };
    let points = points(&kinematics, options.points.unwrap_or(POINTS));
    let sources = sources::sources(machine, errors, &points, adjustable);
    let forms = form::forms(&kinematics, &variables, &points, &sources);
    let forms = forms.ok_or(SchemeError::NoClosedForm)?;
    let groups = groups::groups(machine, &sources, &forms);
    let chains = groups
        .iter()
        .map(|group| chains::chains(group, &variables, &points));
    let chains: Vec<Vec<Vec<Factor>>> = chains.collect();
    let open = adjustable_groups(&sources, &groups, &|group| chains[group].len())?;
    let mut products = Vec::new();
    for (tag, (group, chains)) in groups.iter().zip(chains).enumerate() {
        let limits = open[tag].map(|source| limits(&sources[source]));
        products.extend(chains.into_iter().map(|mut factors| {
            // A weight that stays as it is costs nothing in a table.
            let weight = match limits {
                Some(_) => group.weight,
                None => {
                    chains::scale(&mut factors, group.weight, group.output, &points);
                    1.0
                }
            };
            Product {
                output: group.output,
                weight,
                limits,
                factors,
                tag,
            }
        }));
    }
    products.extend(subtracted(machine, &options.zero(machine, errors)?));
    let (banks, placed) = layout(&products, &points, options.format);
    let tables: usize = banks.iter().map(|bank| bank.columns.len()).sum();
    if tables > TABLES {
        return Err(SchemeError::TooManyTables { tables });
    }
    let notes = notes(machine, &sources, &groups, &open, &placed);
    Ok(Found {
        draft: Draft {
            banks,
            terms: placed.into_iter().map(|p| p.term).collect(),
            ..blank(&kinematics)
        },
        structure_error: None,
        meets: None,
        is_full: false,
        notes,
    })
}

/// For each group the error whose weight it is, if that is adjustable.
fn adjustable_groups(
    sources: &[Source],
    groups: &[Group],
    chains: &dyn Fn(usize) -> usize,
) -> Result<Vec<Option<usize>>, SchemeError> {
    let of = |source: usize| {
        let numbered = groups.iter().enumerate();
        numbered.filter(move |(_, g)| g.members.iter().any(|(member, _)| *member == source))
    };
    let terms = |source: usize| of(source).map(|(k, _)| chains(k)).sum::<usize>();
    let asked: Vec<usize> = (0..sources.len())
        .filter(|s| sources[*s].is_adjustable)
        .collect();
    let needed = asked.iter().map(|s| terms(*s)).sum::<usize>();
    if needed > trueaxis::ADJUSTABLE {
        return Err(SchemeError::TooManyWeights {
            needed,
            held: trueaxis::ADJUSTABLE,
        });
    }
    let mut chosen = asked;
    if chosen.is_empty() {
        let alone = |source: &usize| of(*source).all(|(_, g)| g.alone() == Some(*source));
        let all = (0..sources.len()).filter(|source| terms(*source) == 1);
        chosen = all.filter(alone).take(trueaxis::ADJUSTABLE).collect();
    }
    let open = |group: &Group| group.alone().filter(|source| chosen.contains(source));
    Ok(groups.iter().map(open).collect())
}

/// Between which numbers the weight of an error can be set.
fn limits(source: &Source) -> [f32; 2] {
    let most = match source.value {
        0.0 => {
            let length = source.along.is_empty() && !source.unit.is_angular();
            FROM_NOTHING[usize::from(!length)]
        }
        value => (MOST_WEIGHT - 1.0) * value.abs(),
    };
    [source.value - most, source.value + most].map(|limit| limit as f32)
}

/// Which errors stand where: the tables of each output, then the terms of each weight.
fn notes(
    machine: &Machine,
    sources: &[Source],
    groups: &[Group],
    open: &[Option<usize>],
    placed: &[Placed],
) -> Vec<String> {
    let tables = machine.axes.iter().enumerate().map(|(output, axis)| {
        let terms = placed
            .iter()
            .filter(|p| usize::from(p.term.output) == output);
        let mut tables: Vec<u8> = terms.flat_map(|p| p.term.factors.iter().copied()).collect();
        tables.sort_unstable();
        tables.dedup();
        format!("{} {}", axis.letter, tables.len())
    });
    let tables: Vec<String> = tables.collect();
    let mut notes = vec![format!("tables of each output: {}", tables.join(", "))];
    for (number, source) in sources.iter().enumerate() {
        let of = |p: &Placed| {
            let group = groups.get(p.tag);
            group.is_some_and(|g| g.members.iter().any(|(member, _)| *member == number))
        };
        let of_source = placed.iter().enumerate().filter(|(_, p)| of(p));
        let of_source: Vec<(usize, &Placed)> = of_source.collect();
        let numbers: Vec<String> = of_source.iter().map(|(k, _)| k.to_string()).collect();
        let terms = if numbers.len() == 1 { "term" } else { "terms" };
        if of_source.is_empty() {
            notes.push(format!(
                "{}: no term, for it asks for no correction",
                source.name
            ));
            continue;
        }
        let mut note = format!("{}: {terms} {}", source.name, numbers.join(", "));
        if of_source.iter().all(|(_, p)| open[p.tag] == Some(number)) {
            note += ", adjustable";
        }
        notes.push(note);
    }
    notes
}

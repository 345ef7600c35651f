//! The scheme `fik` of Chapter 7 of the source document: one chain of tables for each closed-form term of each
//! error, with the error itself in a table or as an adjustable weight.
//!
//! The closed forms are those of Δq = −J⁺·E (Eq. 51, 59), the first-order correction. Here they are derived from the
//! machine: sampled so that they are exactly determined (`form`), merged where errors have proportional corrections
//! (`groups`), and split into products of functions of one input each (`chains`). Second order is left out, as in
//! the document.

mod chains;
mod form;
mod groups;
mod named;
mod sources;
#[cfg(test)]
mod tests;
mod weights;

use crate::schemes::blank::blank;
use crate::schemes::points::points;
use crate::schemes::products::{Factor, Product, layout, subtracted};
use crate::schemes::{Options, SchemeError, SchemeResult};
use form::Variables;
pub use named::names;
use trueaxis::Draft;
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::Machine;

/// Default number of points of tables that are not straight lines.
pub const POINTS: usize = 101;
/// Largest number of tables in a blob, which numbers them with one byte.
const TABLES: usize = 255;

/// Tables and terms, with the errors that each term corrects.
struct Arranged {
    draft: Draft,
    /// For each term.
    names: Vec<Vec<String>>,
    notes: Vec<String>,
}

/// The tables of Chapter 7 for any machine with two rotary axes, or with three under `orientation` and `position`. The
/// weights of the errors in `adjustable` can be set on the controller.
///
/// # Errors
/// [`SchemeError`].
pub fn compile(
    machine: &Machine,
    errors: &ErrorModel,
    adjustable: &[Parameter],
    options: &Options,
) -> Result<SchemeResult, SchemeError> {
    let arranged = arranged(machine, errors, adjustable, options)?;
    Ok(SchemeResult {
        draft: arranged.draft,
        structure_error: None,
        meets: None,
        is_full: false,
        notes: arranged.notes,
    })
}

fn arranged(
    machine: &Machine,
    errors: &ErrorModel,
    adjustable: &[Parameter],
    options: &Options,
) -> Result<Arranged, SchemeError> {
    let kinematics = Kinematics::new(machine, errors).with_policy(options.policy);
    let is_known = |p: &Parameter| errors.clone().set(machine, *p, 0.0);
    if let Some(unknown) = adjustable.iter().find(|p| !is_known(p)) {
        return Err(SchemeError::NoSuchError {
            name: unknown.to_string(),
        });
    }
    let Some(variables) = Variables::new(machine) else {
        return Err(SchemeError::axes(
            machine,
            "fik",
            "two or three rotary axes",
        ));
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
    let open = weights::adjustable(&sources, &groups, &|group| chains[group].len())?;
    let mut products = Vec::new();
    for (tag, (group, chains)) in groups.iter().zip(chains).enumerate() {
        let limits = open[tag].map(|source| weights::limits(&sources[source]));
        products.extend(chains.into_iter().map(|mut factors| {
            // A fixed weight costs nothing if it is part of a table.
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
    let names = named::of_terms(&sources, &groups, &placed);
    Ok(Arranged {
        notes: named::notes(machine, &sources, &open, &placed, &names),
        names,
        draft: Draft {
            banks,
            terms: placed.into_iter().map(|p| p.term).collect(),
            ..blank(&kinematics)
        },
    })
}

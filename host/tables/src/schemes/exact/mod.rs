//! The scheme `exact`: finds the factors itself.
//!
//! The correction is sampled from the exact kinematic correction on small grids, split into what
//! it is without motions that vary, without backlash and at reference temperature, and what each of
//! these (and each pair, where it shows) adds. Along every variable
//! the functions it is made of are found: the constant, the coordinate, products of sine and
//! cosine, and what remains by singular value decomposition. Sums of functions of one variable
//! become one table. The tables' values are sampled from the exact correction, so that second
//! order comes in wherever the structure holds it; and what they do is measured, as the runtime
//! evaluates them, before any is accepted.

mod along;
mod attempt;
mod basis;
mod between;
mod budget;
mod chebyshev;
mod components;
mod core;
mod cover;
mod cubic;
mod draft;
mod fit;
mod fold;
mod generators;
mod grid;
mod judge;
mod limits;
mod memory;
mod peak_tables;
mod peaks;
mod points;
mod prune;
mod sampling;
mod search;
#[cfg(test)]
mod specimen;
mod spline;
mod structure;
mod tables;
mod tolerance;
mod trials;
mod turning;
mod variables;

use crate::schemes::blank::blank;
use crate::schemes::{self, Options, SchemeError};
pub use cover::Minimize;
use judge::Judge;
use sampling::Sampler;
use search::Search;
use tolerance::Tolerance;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::Machine;

/// Finds tables and terms that reproduce the kinematic correction within the tolerance.
///
/// Where the tolerance cannot be met, the best found is returned, which may be one for a coarser
/// tolerance. On no axis do the tables deviate from the kinematic correction by more than the
/// largest correction of that axis or the tolerance: if nothing better is found, there are no tables.
///
/// # Errors
/// [`SchemeError`].
pub fn compile(
    machine: &Machine,
    errors: &ErrorModel,
    minimize: Minimize,
    options: &Options,
) -> Result<schemes::SchemeResult, SchemeError> {
    let kinematics = Kinematics::new(machine, errors).with_policy(options.policy);
    let whole = Tolerance::new(&kinematics, options.tolerance);
    let tolerance = whole.axes;
    let zero = options.zero(machine, errors)?;
    let judge = Judge::new(&kinematics, whole, zero)?;
    let variables = variables::variables(&kinematics, judge.smallest_part());
    let sampler = Sampler::new(&kinematics, &variables, zero);
    let mut search = Search::new(minimize, options, sampler, judge)?;
    // What misses the tolerance may be bettered by what is made for a finer one, or for a coarser one;
    // unless it is only for want of room: then the least has been left out.
    if !search.run(&tolerance)?
        && !search.fit()?
        && !search.lacks_room()
        && !search.finer(&tolerance)?
        && !search.fit()?
    {
        search.coarser(&tolerance)?;
        search.fit()?;
    }
    let Some(best) = search.best else {
        return Ok(schemes::SchemeResult {
            draft: blank(&kinematics),
            structure_error: None,
            meets: None,
            is_full: search.is_full,
            notes: vec!["no tables were found that do no harm".to_owned()],
        });
    };
    Ok(schemes::SchemeResult {
        meets: best.meets().map(|factor| options.tolerance * factor),
        draft: best.draft,
        structure_error: Some(best.structure_error),
        is_full: search.is_full,
        notes: match best.pairs {
            0 => Vec::new(),
            pairs => vec![format!(
                "pairs of motions whose joint second order is taken in: {pairs}"
            )],
        },
    })
}

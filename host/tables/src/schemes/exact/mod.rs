//! The scheme `exact`: finds the factors itself.
//!
//! The exact kinematic correction is sampled on small grids. It is split into the part without varying motions,
//! without backlash and at reference temperature, and the parts that each of these adds, or each pair where
//! significant. Along every variable the functions that make it up are found: the constant, the coordinate, products
//! of sine and cosine, and the remainder by singular value decomposition. Sums of functions of one variable become
//! one table. The values of the tables are sampled from the exact correction, so they include second order wherever
//! the structure allows it. Tables are accepted only after their effect has been measured as the runtime evaluates
//! them.

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
mod edit;
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
mod sums;
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
/// If the tolerance cannot be met, the best result is returned, which may have been made for a coarser tolerance. No
/// axis deviates from the kinematic correction by more than its largest correction or the tolerance, whichever is
/// larger; if nothing better is found, there are no tables.
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
    // Drafts for a finer or a coarser tolerance may improve a result that misses the tolerance, unless only capacity
    // is lacking: then the smallest parts have been left out already.
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

//! The scheme `exact`: finds the factors itself.
//!
//! The exact kinematic correction is sampled on small grids. It is split into the part without varying motions,
//! without backlash and at reference temperature, and the parts that each of these adds, or each pair where
//! significant. Along every variable the functions that make it up are found: the constant, the coordinate, products
//! of sine and cosine, and the remainder by singular value decomposition. Sums of functions of one variable become
//! one table. The values of the tables are sampled from the reference correction, so they include second order wherever
//! the structure allows it. Tables are accepted only after their effect has been measured as the runtime evaluates
//! them. So no constant decides whether a result is right: they decide how quickly a good one is found.
//!
//! The files, in the order in which they use each other: `nodes`, `variables`, `component`, `sampling`, `along` and `basis` find the
//! functions; `spline`, `grid`, `structure`, `entries`, `share` and `cover` the terms; `points` and `draft` the
//! tables; `fit`, `trials`, `components`, `tolerance`, `positions`, `judge`, `budget`, `candidate` and `search` try them.

mod along;
mod basis;
mod budget;
mod candidate;
mod component;
mod components;
mod cover;
mod draft;
mod entries;
mod fit;
mod grid;
mod judge;
mod nodes;
mod points;
mod positions;
mod sampling;
mod search;
mod share;
#[cfg(test)]
mod specimen;
mod spline;
mod structure;
mod tolerance;
mod trials;
mod variables;

use crate::schemes::blank::blank;
use crate::schemes::{self, Options, SchemeError};
use crate::target::Target;
pub use candidate::Effort;
pub use cover::Minimize;
use judge::Judge;
use positions::Positions;
use sampling::Sampler;
use search::{FAR_OUT_OF_REACH, Sampled, Search};
use tolerance::Tolerance;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::Machine;

/// The tolerance (mm) that samples resolve, unless a finer one is asked for: the finest that is tried by default.
const USUAL: f64 = 5e-5;

/// Finds tables and terms that reproduce the kinematic correction within a tolerance. What does not depend on the
/// tolerance is sampled once.
pub struct Exact<'a> {
    minimize: Minimize,
    kinematics: Kinematics<'a>,
    positions: Positions<'a>,
    /// For all tolerances tried so far.
    sampled: Option<Sampled<'a>>,
    /// A target that was too small for a tolerance, and the error (mm) that its capacity left.
    too_small: Option<(Target, f64)>,
}

impl<'a> Exact<'a> {
    /// Draws the positions at which tables are measured. The tolerance and the target in `options` do not matter.
    ///
    /// # Errors
    /// [`SchemeError`].
    pub fn new(
        machine: &'a Machine,
        errors: &'a ErrorModel,
        minimize: Minimize,
        options: &Options,
    ) -> Result<Self, SchemeError> {
        let kinematics = Kinematics::new(machine, errors).with_policy(options.policy);
        let zero = options.zero(machine, errors)?;
        Ok(Self {
            minimize,
            positions: Positions::new(&kinematics, zero)?,
            kinematics,
            sampled: None,
            too_small: None,
        })
    }

    /// Samples that resolve a tolerance: new ones only if it is finer than all before, and finer than what is usual.
    fn sample(&mut self, mm: f64) -> Result<(), SchemeError> {
        let finest = Tolerance::new(&self.kinematics, mm.min(USUAL)).axes;
        if self.sampled.as_ref().is_some_and(|s| s.resolves(&finest)) {
            return Ok(());
        }
        let relative = self.positions.smallest_part(&finest);
        let variables = variables::variables(&self.kinematics, relative);
        let sampler = Sampler::new(&self.kinematics, variables, self.positions.zero);
        self.sampled = Some(Sampled::new(sampler, finest)?);
        Ok(())
    }

    /// Finds the tables for the tolerance and the target in `options`.
    ///
    /// If the tolerance cannot be met, the best result is returned.
    /// No axis deviates from the kinematic correction by more than its largest correction or the tolerance, whichever
    /// is larger; if nothing better is found, there are no tables.
    ///
    /// `None` if the effort does not allow for a result.
    ///
    /// # Errors
    /// [`SchemeError`].
    pub fn find(
        &mut self,
        options: &Options,
        effort: Effort,
    ) -> Result<Option<schemes::SchemeResult>, SchemeError> {
        // What a target's capacity leaves hardly depends on the tolerance.
        let leaves = self
            .too_small
            .as_ref()
            .filter(|(t, _)| *t == options.target);
        if leaves.is_some_and(|(_, left)| *left > FAR_OUT_OF_REACH * options.tolerance)
            && matches!(effort, Effort::IfWithinReach | Effort::IfNearlyMet)
        {
            return Ok(None);
        }
        let whole = Tolerance::new(&self.kinematics, options.tolerance);
        self.sample(options.tolerance)?;
        let judge = Judge::new(&self.positions, whole);
        let sampled = self.sampled.as_ref().expect("sampled above");
        let mut search = Search::new(self.minimize, options, effort, sampled, judge);
        if !search.is_worth_while()? {
            if let Some(error) = search.left_by_target() {
                self.too_small = Some((options.target.clone(), error * options.tolerance));
            }
            return Ok(None);
        }
        if !search.run()? && effort != Effort::IfItFits {
            search.fit()?;
        }
        if !search.is_good_enough() {
            return Ok(None);
        }
        let Some(best) = search.best else {
            return Ok(Some(schemes::SchemeResult {
                draft: blank(&self.kinematics),
                structure_error: None,
                meets: None,
                is_full: search.is_full,
                notes: vec!["no tables were found that do no harm".to_owned()],
            }));
        };
        Ok(Some(schemes::SchemeResult {
            meets: best.is_good().then_some(options.tolerance),
            draft: best.draft,
            structure_error: Some(best.structure_error),
            is_full: search.is_full,
            notes: match best.pairs {
                0 => Vec::new(),
                pairs => vec![format!(
                    "pairs of motions whose joint second order is taken in: {pairs}"
                )],
            },
        }))
    }
}

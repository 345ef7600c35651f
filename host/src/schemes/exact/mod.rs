//! The scheme `exact`: finds the factors itself.
//!
//! The correction is sampled from the exact kinematic correction on small grids, split into what
//! it is without the bending motions of linear axes, without backlash and at reference
//! temperature, and what each of these (and each pair, where it shows) adds. Along every variable
//! the functions it is made of are found: the constant, the coordinate, products of sine and
//! cosine, and what remains by singular value decomposition. Sums of functions of one variable
//! become one table. The tables' values are sampled from the exact correction, so that second
//! order comes in wherever the structure holds it.

mod along;
mod attempt;
mod basis;
mod components;
mod core;
mod cover;
mod draft;
mod generators;
mod judge;
mod limits;
mod points;
mod sampling;
mod tables;
mod trials;
mod turning;
mod variables;

use crate::errors::ErrorModel;
use crate::kinematics::Kinematics;
use crate::machine::{Machine, PerAxis};
use crate::schemes::{self, Options, SchemeError};
use attempt::{Attempt, attempt};
pub use cover::Minimize;
use judge::{Judge, Verdict};
use limits::{
    ATTEMPTS, COARSER, FIRST_SHARE, GOOD, HARMLESS, LEAST_POINT_SHARE, REFINEMENTS, STRUCTURE_SHARE,
};
use sampling::{Component, Sampler};
use trials::Trials;
use trueaxis::Draft;

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
) -> Result<schemes::Found, SchemeError> {
    let kinematics = Kinematics::new(machine, errors);
    let tolerance: PerAxis = std::array::from_fn(|i| match machine.axes.get(i) {
        Some(axis) if axis.letter.is_rotary() => options.tolerance * 1e-3,
        _ => options.tolerance,
    });
    let zero = options.zero(machine, errors)?;
    let judge = Judge::new(&kinematics, tolerance, zero)?;
    let variables = variables::variables(&kinematics, judge.smallest_part());
    let sampler = Sampler {
        kinematics: &kinematics,
        variables: &variables,
        zero,
    };
    let mut search = Search {
        minimize,
        options,
        trials: Trials::new(&sampler)?,
        components: components::first_order(&sampler)?,
        pairs: None,
        judge,
        sampler,
        best: None,
    };
    // What misses the tolerance, for want of room mostly, may be bettered by what is made for a
    // coarser one: less is left out there. From what was reached on to finer ones, as far as they
    // are met.
    if !search.run(&tolerance)? {
        let reached = search
            .best
            .as_ref()
            .map_or(f64::INFINITY, |b| b.verdict.error);
        for factor in COARSER.into_iter().rev().filter(|f| *f <= reached) {
            let met = search.run(&tolerance.map(|t| t * factor))?;
            if !met && search.best.is_some() {
                break;
            }
        }
    }
    let Some(best) = search.best else {
        return Ok(schemes::Found {
            draft: draft::empty(machine, errors, &variables),
            structure_error: None,
            notes: vec!["no tables were found that do no harm".to_owned()],
        });
    };
    Ok(schemes::Found {
        draft: best.draft,
        structure_error: Some(best.structure_error),
        notes: match best.pairs {
            0 => Vec::new(),
            pairs => vec![format!(
                "pairs of motions whose joint second order is taken in: {pairs}"
            )],
        },
    })
}

/// A draft that does no harm.
struct Candidate {
    draft: Draft,
    verdict: Verdict,
    structure_error: f64,
    pairs: usize,
}

/// The way to the best draft.
struct Search<'a> {
    minimize: Minimize,
    options: &'a Options,
    sampler: Sampler<'a>,
    trials: Trials,
    judge: Judge<'a>,
    /// What the correction is made of.
    components: Vec<Component>,
    /// How many of them are joint effects, once these have been looked for.
    pairs: Option<usize>,
    best: Option<Candidate>,
}

impl Search<'_> {
    /// Looks for a draft that meets a tolerance; true if it was found.
    fn run(&mut self, tolerance: &PerAxis) -> Result<bool, SchemeError> {
        // Start generously; where the trial shows that too much was left out, take in what motions
        // add in pairs, then leave out less.
        let mut share = FIRST_SHARE;
        let mut left_out = 0.0;
        let mut closest: Option<(f64, Attempt)> = None;
        for _ in 0..ATTEMPTS {
            let target = (self.minimize, &self.options.target);
            let attempt = attempt(
                &self.sampler,
                &self.components,
                tolerance,
                target,
                share,
                left_out,
            )?;
            left_out = attempt.left_out;
            let error =
                self.trials
                    .error(&attempt.found(&self.sampler, &self.components, tolerance))?;
            if std::env::var("TRACE").is_ok() {
                eprintln!(
                    "share {share}: error {error:.3}, {} tables {} terms, left out {:.3}, full {}",
                    attempt.structure.count(),
                    attempt.structure.terms.len(),
                    attempt.left_out,
                    attempt.is_full
                );
            }
            if error <= STRUCTURE_SHARE && self.finish(tolerance, &attempt, error)? {
                return Ok(true);
            }
            let is_full = attempt.is_full;
            let better = closest.as_ref().is_none_or(|(e, _)| error < 0.9 * e);
            if better {
                closest = Some((error, attempt));
            }
            if self.pairs.is_none() {
                let joint = components::second_order(&self.sampler, tolerance)?;
                self.pairs = Some(joint.len());
                if !joint.is_empty() {
                    // Numbers of functions change with the components: nothing of before can stay.
                    if let Some((error, attempt)) = closest.take() {
                        self.finish(tolerance, &attempt, error)?;
                    }
                    self.components.extend(joint);
                    continue;
                }
            }
            if !better || is_full {
                break;
            }
            share *= 0.5;
        }
        match closest {
            Some((error, attempt)) => self.finish(tolerance, &attempt, error),
            None => Ok(false),
        }
    }

    /// Gives the tables of an attempt points, finer ones until the draft is good; true if it is.
    fn finish(
        &mut self,
        tolerance: &PerAxis,
        attempt: &Attempt,
        structure_error: f64,
    ) -> Result<bool, SchemeError> {
        if attempt.structure.count() > usize::from(u8::MAX) {
            return Ok(false);
        }
        let machine = self.sampler.kinematics.machine;
        let errors = self.sampler.kinematics.errors;
        let found = attempt.found(&self.sampler, &self.components, tolerance);
        // Tolerances differ by a common factor.
        let factor = tolerance[0] / self.options.tolerance;
        // Points finer than what the structure leaves would be wasted.
        let mut share = (GOOD - structure_error)
            .max(LEAST_POINT_SHARE)
            .max(LEAST_POINT_SHARE * structure_error);
        let mut last = f64::INFINITY;
        for _ in 0..=REFINEMENTS {
            let fixed = self.options.points.map(|points| points.max(2) - 1);
            let grids = points::grids(&found, fixed, share)?;
            let draft = draft::draft(machine, errors, &found, &grids, self.options)?;
            let Some(verdict) = self.judge.measure(&draft, &self.options.target) else {
                // More than the target holds.
                return Ok(false);
            };
            if std::env::var("TRACE").is_ok() {
                eprintln!(
                    "  factor {factor} structure {structure_error:.3} share {share:.3}: {verdict:?} {} samples",
                    draft
                        .banks
                        .iter()
                        .map(|b| b.columns.iter().map(Vec::len).sum::<usize>())
                        .sum::<usize>()
                );
            }
            let good = verdict.error <= GOOD * factor;
            let better = match &self.best {
                Some(best) => verdict.error < best.verdict.error,
                None => true,
            };
            if verdict.harm <= HARMLESS && better {
                self.best = Some(Candidate {
                    draft,
                    verdict,
                    structure_error: structure_error * factor,
                    pairs: self.pairs.unwrap_or(0),
                });
            }
            if good {
                return Ok(verdict.harm <= HARMLESS);
            }
            if fixed.is_some() || verdict.error > 0.9 * last {
                break;
            }
            last = verdict.error;
            share *= 0.5;
        }
        Ok(false)
    }
}

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
mod memory;
mod points;
mod sampling;
#[cfg(test)]
mod specimen;
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
    BLAMELESS, COARSER, CUT, FIRST_SHARE, FULL_ATTEMPTS, GOOD, HARMLESS, HOPELESS,
    LEAST_POINT_SHARE, REFINEMENTS, ROOM_STEPS, SHARES,
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
    let sampler = Sampler::new(&kinematics, &variables, zero);
    let mut search = Search {
        minimize,
        options,
        trials: Trials::new(&sampler)?,
        components: components::first_order(&sampler)?,
        pairs: None,
        judge,
        sampler,
        is_full: false,
        best: None,
    };
    // What misses the tolerance may be bettered by what is made for a coarser one, unless it is only
    // for want of room: then the least has been left out.
    if !search.run(&tolerance)? && !search.lacks_room() {
        search.coarser(&tolerance)?;
    }
    let Some(best) = search.best else {
        return Ok(schemes::Found {
            draft: draft::empty(machine, errors, &variables),
            structure_error: None,
            meets: None,
            is_full: search.is_full,
            notes: vec!["no tables were found that do no harm".to_owned()],
        });
    };
    Ok(schemes::Found {
        draft: best.draft,
        structure_error: Some(best.structure_error),
        meets: best.meets.then_some(options.tolerance * best.factor),
        is_full: search.is_full,
        notes: match best.pairs {
            0 => Vec::new(),
            pairs => vec![format!(
                "pairs of motions whose joint second order is taken in: {pairs}"
            )],
        },
    })
}

/// A structure that was tried.
struct Tried {
    attempt: Attempt,
    /// What it leaves at the places of the trial, in units of the tolerance.
    error: f64,
    /// With what motions add in pairs.
    pairs: bool,
}

/// A draft that does no harm.
struct Candidate {
    draft: Draft,
    verdict: Verdict,
    structure_error: f64,
    pairs: usize,
    /// For which multiple of the tolerance it was made, and if it meets that.
    factor: f64,
    meets: bool,
    /// If it fills the target, and what was left out, in units of the tolerance asked for.
    is_full: bool,
    left_out: f64,
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
    /// True if the tolerance asked for needs more than the target holds.
    is_full: bool,
    best: Option<Candidate>,
}

impl Search<'_> {
    /// Looks for a draft that meets a tolerance; true if it was found.
    fn run(&mut self, tolerance: &PerAxis) -> Result<bool, SchemeError> {
        // Start generously; where that is not enough, take in what motions add in pairs, then leave
        // out less and less.
        if self.is_full && self.pairs.is_some_and(|pairs| pairs > 0) {
            // It was tried for a finer tolerance, and joint effects were needed.
            let second = self.attempt(tolerance, FIRST_SHARE, true)?;
            return self.finish(tolerance, &second, true);
        }
        let first = self.attempt(tolerance, FIRST_SHARE, false)?;
        self.is_full |= first.attempt.is_full;
        // Joint effects do not help where most of the error is what there was no room for.
        let joint = |search: &mut Self| -> Result<bool, SchemeError> {
            let other = first.error > CUT * first.attempt.left_out;
            Ok(other && search.joint(tolerance)? > 0)
        };
        let hopeless = first.error > HOPELESS;
        if hopeless && first.attempt.is_full && joint(self)? {
            let second = self.attempt(tolerance, FIRST_SHARE, true)?;
            return self.finish(tolerance, &second, true);
        }
        if !(hopeless && joint(self)?)
            && (self.finish(tolerance, &first, false)? || self.finish(tolerance, &first, true)?)
        {
            return Ok(true);
        }
        if first.attempt.is_full {
            return Ok(false);
        }
        let pairs = joint(self)?;
        self.closer(tolerance, pairs)
    }

    /// Leaves out less as long as that helps; true if the tolerance is met.
    fn closer(&mut self, tolerance: &PerAxis, pairs: bool) -> Result<bool, SchemeError> {
        let shares: &[f64] = if pairs {
            &SHARES
        } else {
            &SHARES[SHARES.len() - 2..]
        };
        let mut last = None;
        for &share in shares {
            let next = self.attempt(tolerance, share, pairs)?;
            if self.finish(tolerance, &next, false)? {
                return Ok(true);
            }
            let is_full = next.attempt.is_full;
            last = Some(next);
            if is_full {
                break;
            }
        }
        match last {
            Some(last) => self.finish(tolerance, &last, true),
            None => Ok(false),
        }
    }

    /// True if what the best leaves is explained by what there was no room for.
    fn lacks_room(&self) -> bool {
        let best = self.best.as_ref();
        best.is_some_and(|b| b.is_full && b.verdict.error < CUT * b.left_out)
    }

    /// Looks for the finest tolerance that is met, among multiples of one that is not.
    fn coarser(&mut self, tolerance: &PerAxis) -> Result<(), SchemeError> {
        // Coarser than what is reached already, nothing can be won; and where a tolerance is missed,
        // finer ones are.
        let reached = self
            .best
            .as_ref()
            .map_or(f64::INFINITY, |b| b.verdict.error);
        for factor in COARSER.into_iter().rev().filter(|f| *f < reached) {
            if !self.run(&tolerance.map(|t| t * factor))? && self.best.is_some() {
                break;
            }
        }
        Ok(())
    }

    /// How many pairs of motions have a joint effect that shows.
    fn joint(&mut self, tolerance: &PerAxis) -> Result<usize, SchemeError> {
        if self.pairs.is_none() {
            let joint = components::second_order(&self.sampler, tolerance)?;
            self.pairs = Some(joint.len());
            self.components.extend(joint);
        }
        Ok(self.pairs.unwrap_or(0))
    }

    /// How many of the components count, with or without joint effects.
    fn count(&self, pairs: bool) -> usize {
        let joint = if pairs { 0 } else { self.pairs.unwrap_or(0) };
        self.components.len() - joint
    }

    /// Tries a structure that leaves out no more than a share of the tolerance, with what pairs of
    /// motions add or without.
    fn attempt(&self, tolerance: &PerAxis, share: f64, pairs: bool) -> Result<Tried, SchemeError> {
        let components = &self.components[..self.count(pairs)];
        let target = (self.minimize, &self.options.target);
        let mut left_out = 0.0;
        let mut best: Option<(f64, Attempt)> = None;
        for _ in 0..FULL_ATTEMPTS {
            let next = attempt(
                &self.sampler,
                components,
                tolerance,
                target,
                share,
                left_out,
            )?;
            left_out = next.left_out;
            let is_full = next.is_full;
            let error = self
                .trials
                .error(&next.found(&self.sampler, components, tolerance))?;
            if best.as_ref().is_some_and(|(least, _)| error > 0.9 * least) {
                break;
            }
            best = Some((error, next));
            if !is_full {
                break;
            }
        }
        let (error, attempt) = best.ok_or(SchemeError::TooManyTables { tables: 0 })?;
        if std::env::var("TRACE").is_ok() {
            eprintln!(
                "share {share} pairs {pairs}: error {error:.3}, {} tables {} terms, left out {:.3}, full {}",
                attempt.structure.count(),
                attempt.structure.terms.len(),
                attempt.left_out,
                attempt.is_full
            );
        }
        Ok(Tried {
            attempt,
            error,
            pairs,
        })
    }

    /// Gives the tables of an attempt points, more of them until the draft is good; true if it is.
    /// Between positions where motions were measured only if `finer`.
    fn finish(
        &mut self,
        tolerance: &PerAxis,
        tried: &Tried,
        finer: bool,
    ) -> Result<bool, SchemeError> {
        let Tried {
            attempt,
            error: structure_error,
            pairs,
        } = tried;
        let structure_error = *structure_error;
        if attempt.structure.count() > usize::from(u8::MAX) {
            return Ok(false);
        }
        let machine = self.sampler.kinematics.machine;
        let errors = self.sampler.kinematics.errors;
        let found = attempt.found(
            &self.sampler,
            &self.components[..self.count(*pairs)],
            tolerance,
        );
        // Tolerances differ by a common factor.
        let factor = tolerance[0] / self.judge.tolerance()[0];
        // Points finer than what the structure leaves would be wasted.
        let mut share = (GOOD - structure_error)
            .max(LEAST_POINT_SHARE)
            .max(LEAST_POINT_SHARE * structure_error);
        let mut last = f64::INFINITY;
        let mut room = ROOM_STEPS;
        let mut refinement = 0;
        while refinement <= REFINEMENTS {
            let fixed = self.options.points.map(|points| points.max(2) - 1);
            let grids = points::grids(&found, fixed, share, finer)?;
            let draft = draft::draft(machine, errors, &found, &grids, self.options)?;
            let Some(verdict) = self.judge.measure(&draft, &self.options.target) else {
                self.is_full = true;
                // More than the target holds: fewer points, unless they were enough before.
                if last.is_finite() || room == 0 {
                    return Ok(false);
                }
                room -= 1;
                share *= 2.0;
                continue;
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
                    pairs: if *pairs { self.pairs.unwrap_or(0) } else { 0 },
                    factor,
                    meets: good,
                    is_full: attempt.is_full,
                    left_out: attempt.left_out * factor,
                });
            }
            if good {
                return Ok(verdict.harm <= HARMLESS);
            }
            let blameless = share * factor < BLAMELESS * verdict.error;
            if fixed.is_some() || verdict.error > 0.9 * last || blameless {
                break;
            }
            last = verdict.error;
            share *= 0.5;
            refinement += 1;
        }
        Ok(false)
    }
}

//! Search for the best draft: structures first, then points, each measured.

use super::budget::{Budget, GOOD, LITTLE_LESS, TOOL_SHARE};
use super::candidate::{Candidate, Effort, HARMLESS, confirm};
use super::components::{Joint, Split};
use super::cover::{self, Attempt, Minimize, attempt};
use super::judge::Judge;
use super::points::{PeakTables, STUCK};
use super::sampling::Sampler;
use super::trials::Trials;
use super::{components, draft, points};
use crate::schemes::{Options, SchemeError};
use trueaxis_model::kinematics::NotConverged;
use trueaxis_model::machine::PerAxis;

/// Share of the tolerance that a structure may leave out at first, in each output (twice the root of the sum of
/// squares, because peaks rarely coincide).
const FIRST_SHARE: f64 = 0.25;
/// [`FIRST_SHARE`] if the tip and the direction are measured, where deviations of related axes partly cancel.
const FIRST_TOOL_SHARE: f64 = 1.1;
/// An error of more than this many times what was left out has another cause: joint effects.
const CUT: f64 = 2.0;
/// Shares tried if the first one is not enough, with joint effects of motions included. These cost many tables, so no
/// more of them than needed.
const SHARES: [f64; 8] = [1.5, 1.0, 0.85, 0.7, 0.4, 0.25, 0.12, 0.06];
/// Interpolation may use at least this share of the tolerance, and this fraction of what the structure leaves.
const LEAST_POINT_SHARE: f64 = 0.4;
/// If the tolerance is missed, drafts for these fractions of it are tried: more tables and less left out, although
/// the trials did not require it.
const FINER: [f64; 2] = [0.3, 0.1];
/// If it is still missed, drafts for these multiples of it are tried too.
const COARSER: [f64; 16] = [
    2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1e3, 2e3, 5e3, 1e4, 2e4, 5e4, 1e5, 2e5,
];
/// Most nodes of joint effects, each counted once for every subset of its switches: half a minute on one core. Weaker
/// effects are left out.
const MOST_WORK: usize = 600_000;
/// If a structure leaves more tolerances than this, nothing but joint effects can help: no fit has more than halved an
/// error. If it leaves that because the target is full, the tolerance is out of reach.
const MOST_FITTED: f64 = 2.0;
/// [`MOST_FITTED`] before the structure for a tolerance is known, from the error that a finer one leaves. Functions
/// chosen for a coarser tolerance may halve it.
pub const FAR_OUT_OF_REACH: f64 = 2.0 * MOST_FITTED;
/// A draft that leaves more tolerances than this at the worst positions found also misses the tolerance at random
/// ones: there the largest error is 0.82 to 0.88 of it.
const NEARLY_MET: f64 = 1.25;

/// Samples that resolve a tolerance.
pub struct Sampled<'a> {
    sampler: Sampler<'a>,
    trials: Trials,
    first: Split,
    joint: Joint,
    /// The finest tolerance that they resolve (mm, rad).
    finest: PerAxis,
}

impl<'a> Sampled<'a> {
    /// Samples the first-order components.
    pub fn new(sampler: Sampler<'a>, finest: PerAxis) -> Result<Self, NotConverged> {
        let first = components::first_order(&sampler)?;
        Ok(Self {
            trials: Trials::new(&sampler)?,
            first: Split::new(&sampler, first, finest),
            joint: Joint::default(),
            sampler,
            finest,
        })
    }

    /// True if they resolve a tolerance.
    pub fn resolves(&self, tolerance: &PerAxis) -> bool {
        let mut pairs = self.finest.iter().zip(tolerance);
        pairs.all(|(finest, tolerance)| finest <= tolerance)
    }
}

/// A structure that was tried.
struct Tried {
    attempt: Attempt,
    /// Error at the trial positions, in units of the tolerance.
    error: f64,
    /// True if it includes second-order effects of motion pairs.
    pairs: bool,
}

/// State of the search.
pub struct Search<'a> {
    minimize: Minimize,
    options: &'a Options,
    effort: Effort,
    sampled: &'a Sampled<'a>,
    judge: Judge<'a>,
    /// The first structure for the requested tolerance, once it has been found.
    first: Option<Tried>,
    /// Number of joint effects, once these have been searched, and the correction split with them.
    pairs: Option<usize>,
    with_pairs: Option<Split>,
    /// True if the requested tolerance needs more than the target holds.
    pub is_full: bool,
    /// The best candidate so far.
    pub best: Option<Candidate>,
}

impl<'a> Search<'a> {
    /// Begins with the first-order components.
    pub fn new(
        minimize: Minimize,
        options: &'a Options,
        effort: Effort,
        sampled: &'a Sampled<'a>,
        judge: Judge<'a>,
    ) -> Self {
        Self {
            minimize,
            options,
            effort,
            first: None,
            pairs: None,
            with_pairs: None,
            judge,
            sampled,
            is_full: false,
            best: None,
        }
    }

    /// The share of the tolerance that a structure may leave out at first.
    fn first_share(&self) -> f64 {
        match self.judge.is_of_tool() {
            true => FIRST_TOOL_SHARE,
            false => FIRST_SHARE,
        }
    }

    /// False if the effort only allows for a result that meets the tolerance, or nearly does, and the best one does not.
    pub fn is_good_enough(&self) -> bool {
        let best = self.best.as_ref();
        let error = best.map_or(f64::INFINITY, |b| b.verdict.error);
        error
            <= match self.effort {
                Effort::Best | Effort::IfWithinReach => f64::INFINITY,
                Effort::IfNearlyMet => NEARLY_MET,
                Effort::IfItFits => GOOD,
            }
    }

    /// False if the effort is not worth while for the requested tolerance, before any table has been sampled.
    pub fn is_worth_while(&mut self, tolerance: &PerAxis) -> Result<bool, SchemeError> {
        if self.effort == Effort::Best {
            return Ok(true);
        }
        let first = self.attempt(tolerance, self.first_share(), false)?;
        self.is_full |= first.attempt.is_full;
        self.first = Some(first);
        Ok(match (self.left_by_target(), self.effort) {
            (Some(_), Effort::IfItFits) => false,
            (left, _) => left.is_none_or(|left| left <= MOST_FITTED),
        })
    }

    /// The error of the first structure that fills the target, as far as it is due to that, in units of the tolerance.
    pub fn left_by_target(&self) -> Option<f64> {
        let first = self.first.as_ref().filter(|first| first.attempt.is_full);
        first.map(|first| first.error.min(first.attempt.left_out))
    }

    /// Searches a draft that meets a tolerance; true if one was found.
    pub fn run(&mut self, tolerance: &PerAxis) -> Result<bool, SchemeError> {
        // Start with a generous share. If that is not enough, include effects of motion pairs, then reduce the share
        // step by step.
        let share = self.first_share();
        let first = match self.first.take() {
            Some(first) => first,
            None => self.attempt(tolerance, share, false)?,
        };
        self.is_full |= first.attempt.is_full;
        // Joint effects do not help if most of the error was left out for lack of capacity.
        let hopeless = first.error > MOST_FITTED;
        let other = first.error > CUT * first.attempt.left_out;
        let is_left_to_joint = other && self.effort == Effort::IfItFits;
        if hopeless && is_left_to_joint {
            return Ok(false);
        }
        let joint = |search: &mut Self| -> Result<bool, SchemeError> {
            Ok(other && search.joint(tolerance)? > 0)
        };
        if hopeless && first.attempt.is_full && joint(self)? {
            let second = self.attempt(tolerance, FIRST_SHARE, true)?;
            return Ok(
                self.finish(tolerance, &second, true)? || self.finish(tolerance, &first, true)?
            );
        }
        if !(hopeless && joint(self)?)
            && (self.finish(tolerance, &first, false)?
                || self.is_measured() && self.finish(tolerance, &first, true)?)
        {
            return Ok(true);
        }
        if first.attempt.is_full || is_left_to_joint {
            return Ok(false);
        }
        let pairs = joint(self)?;
        self.closer(tolerance, pairs)
    }

    /// The initial share of the tolerance for interpolation, after a structure that leaves an error of `error`.
    /// Finer points than the remainder needs would be wasted.
    fn first_point_share(&self, error: f64) -> f64 {
        let share = (GOOD - error)
            .max(LEAST_POINT_SHARE)
            .max(LEAST_POINT_SHARE * error);
        match self.adapts() {
            true => TOOL_SHARE * share,
            false => share,
        }
    }

    /// True if the share of interpolation follows the measurements.
    fn adapts(&self) -> bool {
        self.judge.is_of_tool() && self.options.points.is_none()
    }

    /// True if motions were measured somewhere; otherwise there are no measured points to go between.
    fn is_measured(&self) -> bool {
        let mut variables = self.sampled.sampler.variables.iter();
        variables.any(|v| v.kinks.len() > v.ends.len())
    }

    /// Reduces the share as long as that helps; true if the tolerance is met.
    fn closer(&mut self, tolerance: &PerAxis, pairs: bool) -> Result<bool, SchemeError> {
        // Joint effects are new; otherwise only smaller shares than the first one can help.
        let most = match pairs {
            true => f64::INFINITY,
            false => LITTLE_LESS * self.first_share(),
        };
        let mut last: Option<Tried> = None;
        for share in SHARES.into_iter().filter(|share| *share < most) {
            let next = self.attempt(tolerance, share, pairs)?;
            if self.finish(tolerance, &next, false)? {
                return Ok(true);
            }
            // What remains has another cause than what was left out.
            let before = last.map_or(f64::INFINITY, |last| last.error);
            let is_stuck = next.error > CUT * share && next.error > STUCK * before;
            let is_full = next.attempt.is_full;
            last = Some(next);
            if is_full || is_stuck {
                break;
            }
        }
        match last {
            Some(last) if self.is_measured() => self.finish(tolerance, &last, true),
            _ => Ok(false),
        }
    }

    /// True if the error of the best candidate is explained by what was left out for lack of capacity.
    pub(crate) fn lacks_room(&self) -> bool {
        let best = self.best.as_ref();
        best.is_some_and(|b| b.is_full && b.verdict.error < CUT * b.left_out)
    }

    /// Fits the weights of the best candidate; true if it then meets the tolerance.
    pub fn fit(&mut self) -> Result<bool, SchemeError> {
        let Some(best) = self.best.as_mut().filter(|best| !best.is_fitted) else {
            return Ok(false);
        };
        best.fit(&mut self.judge, &self.options.target, self.effort)
    }

    /// Tries drafts made for finer tolerances; true if one meets this tolerance.
    pub fn finer(&mut self, tolerance: &PerAxis) -> Result<bool, SchemeError> {
        let reached = |search: &Self| {
            let best = search.best.as_ref();
            best.map_or(f64::INFINITY, |b| b.verdict.error)
        };
        for factor in FINER {
            let before = reached(self);
            if self.is_full {
                break;
            }
            self.run(&tolerance.map(|t| t * factor))?;
            if reached(self) <= GOOD {
                return Ok(true);
            }
            if reached(self) > STUCK * before {
                break;
            }
        }
        Ok(false)
    }

    /// Searches the finest tolerance that is met, among multiples of one that is missed.
    pub fn coarser(&mut self, tolerance: &PerAxis) -> Result<(), SchemeError> {
        // A draft for a tolerance not much coarser than the error reached so far may improve on it; where a
        // tolerance is missed, finer ones are missed too.
        let error =
            |best: &Option<Candidate>| best.as_ref().map_or(f64::INFINITY, |b| b.verdict.error);
        let reached = error(&self.best);
        // Begin where a structure may leave out even the largest correction: coarser tolerances need no tables either.
        let needs_none = 2.0 * self.sampled.trials.largest(tolerance) / self.first_share();
        let count = COARSER.partition_point(|f| *f < needs_none) + 1;
        let wanted = COARSER.into_iter().take(count).rev();
        for factor in wanted.filter(|f| *f < 4.0 * reached) {
            // Its draft may be worse before its weights are fitted.
            let before = self.best.take();
            let met = self.run(&tolerance.map(|t| t * factor))?;
            self.fit()?;
            if error(&before) <= error(&self.best) {
                self.best = before;
            }
            if !met && self.best.is_some() {
                break;
            }
        }
        Ok(())
    }

    /// Number of motion pairs whose joint effect is significant and fits into the given work.
    fn joint(&mut self, tolerance: &PerAxis) -> Result<usize, SchemeError> {
        if self.pairs.is_none() {
            let joint = components::second_order(
                &self.sampled.sampler,
                &self.sampled.joint,
                tolerance,
                MOST_WORK,
            )?;
            self.pairs = Some(joint.len());
            if !joint.is_empty() {
                let Sampled {
                    sampler,
                    first,
                    finest,
                    ..
                } = self.sampled;
                let all = first.components.iter().cloned().chain(joint).collect();
                self.with_pairs = Some(Split::new(sampler, all, *finest));
            }
        }
        Ok(self.pairs.unwrap_or(0))
    }

    /// Tries a structure that leaves out no more than a share of the tolerance, with or without effects of motion
    /// pairs.
    fn attempt(&self, tolerance: &PerAxis, share: f64, pairs: bool) -> Result<Tried, SchemeError> {
        let Sampled {
            sampler, trials, ..
        } = self.sampled;
        let with = self.with_pairs.as_ref().filter(|_| pairs);
        let split = with.unwrap_or(&self.sampled.first);
        let components = &split.components;
        let bases = cover::bases(sampler, split, tolerance, self.minimize, share)?;
        let target = (self.minimize, &self.options.target);
        let leaves_out = self.effort != Effort::IfItFits;
        let attempt = attempt(
            sampler, components, bases, tolerance, target, share, leaves_out,
        )?;
        let error = trials.error(&attempt.found(sampler, components, tolerance))?;
        Ok(Tried {
            attempt,
            error,
            pairs,
        })
    }

    /// Gives the tables of an attempt points, and adds points until the draft is good; true if it is. Points go
    /// between measured positions of motions only if `finer`.
    fn finish(
        &mut self,
        tolerance: &PerAxis,
        tried: &Tried,
        finer: bool,
    ) -> Result<bool, SchemeError> {
        let attempt = &tried.attempt;
        if attempt.structure.count() > usize::from(u8::MAX) {
            return Ok(false);
        }
        let with = self.with_pairs.as_ref().filter(|_| tried.pairs);
        let components = &with.unwrap_or(&self.sampled.first).components;
        let found = attempt.found(&self.sampled.sampler, components, tolerance);
        let seen = &PeakTables::all(&found)?;
        // Tolerances differ by a common factor. A draft for a finer tolerance is meant to meet the requested one.
        let factor = tolerance[0] / self.judge.tolerance()[0];
        let wanted = factor.max(1.0);
        let target = &self.options.target;
        let adapts = self.adapts();
        let mut budget = Budget::new(self.first_point_share(tried.error), wanted, adapts);
        while budget.goes_on() {
            let grids = points::grids(&found, seen, self.options, budget.share, finer)?;
            let draft = draft::draft(&found, &grids, seen, self.options)?;
            let measured = match budget.most_error() {
                Some(most) => self.judge.measure_first(&draft, target, most),
                None => self.judge.measure(&draft, target),
            };
            let Some(mut verdict) = measured else {
                self.is_full |= !budget.is_coarsening();
                if budget.after_unusable() {
                    continue;
                }
                return Ok(false);
            };
            if verdict.harm <= HARMLESS && budget.takes_more(verdict.error) {
                continue;
            }
            let is_good = verdict.error <= GOOD * wanted
                && confirm(
                    &mut self.judge,
                    self.best.as_mut(),
                    &draft,
                    &mut verdict,
                    wanted,
                    target,
                )?;
            let is_better = match &self.best {
                // Between tables with more and with fewer points, the first good one wins, not the most accurate.
                Some(best) if adapts && is_good => best.verdict.error > GOOD * wanted,
                Some(best) => verdict.error < best.verdict.error,
                None => true,
            };
            if verdict.harm <= HARMLESS && is_better {
                self.best = Some(Candidate {
                    draft,
                    verdict,
                    structure_error: tried.error * factor,
                    pairs: self.pairs.filter(|_| tried.pairs).unwrap_or(0),
                    factor,
                    is_fitted: false,
                    is_full: attempt.is_full,
                    left_out: attempt.left_out * factor,
                });
            }
            if is_good {
                return Ok(verdict.harm <= HARMLESS);
            }
            if !budget.after_bad(verdict.error, self.options.points.is_some()) {
                break;
            }
        }
        Ok(false)
    }
}

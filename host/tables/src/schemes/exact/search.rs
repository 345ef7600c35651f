//! The way to the best draft: structures, then points, each measured.

use super::attempt::{self, Attempt, attempt};
use super::basis::Basis;
use super::cover::Minimize;
use super::judge::{Judge, Verdict};
use super::limits::{
    BLAMELESS, CLOSER, COARSENINGS, COARSER, CUT, FINER, FIRST_SHARE, FIRST_TOOL_SHARE, FITS,
    FULL_ATTEMPTS, GOOD, HARMLESS, HOPELESS, JUST_GOOD, LEAST_COARSER, LEAST_POINT_SHARE,
    LITTLE_LESS, MOST_WORK, MOST_WORK_IF_HOPELESS, OUT_OF_REACH, REFINEMENTS, ROOM_STEPS, SHARES,
    STARVING, STUCK, TOO_GOOD, TOOL_SHARE,
};
use super::peak_tables::Seen;
use super::sampling::{Component, Sampler};
use super::tables::Found;
use super::trials::Trials;
use super::{components, cubic, draft, points};
use crate::schemes::{Options, SchemeError};
use std::collections::BTreeMap;
use trueaxis::Draft;
use trueaxis_model::machine::PerAxis;

/// A structure that was tried.
struct Tried {
    attempt: Attempt,
    /// What it leaves at the places of the trial, in units of the tolerance.
    error: f64,
    /// With what motions add in pairs.
    pairs: bool,
    /// Its tables with peaks, once they have been looked at.
    seen: Option<BTreeMap<usize, Seen>>,
}

/// A draft that does no harm.
pub struct Candidate {
    pub draft: Draft,
    verdict: Verdict,
    /// What its structure leaves before interpolation, in units of the tolerance asked for.
    pub structure_error: f64,
    /// How many pairs of motions are in it.
    pub pairs: usize,
    /// For which multiple of the tolerance it was made.
    factor: f64,
    /// If its weights were fitted, as well as they can be.
    is_fitted: bool,
    /// If it fills the target, and what was left out, in units of the tolerance asked for.
    is_full: bool,
    left_out: f64,
}

impl Candidate {
    /// The multiple of the tolerance that it was measured to meet: 1, or the coarser one it was made
    /// for.
    pub fn meets(&self) -> Option<f64> {
        let multiples = [1.0, self.factor].into_iter();
        multiples
            .filter(|f| *f >= 1.0)
            .find(|f| self.verdict.error <= GOOD * f)
    }
}

/// The way to the best draft.
pub struct Search<'a> {
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
    pub is_full: bool,
    /// The best so far.
    pub best: Option<Candidate>,
}

/// Looks for the fewest points that are enough: which share of the tolerance they may take.
struct Coarsening {
    /// How often fewer points were tried.
    tried: usize,
    /// The largest share that left enough, and the smallest that did not.
    enough: Option<f64>,
    too_few: f64,
    /// If what was enough is what remains.
    is_last: bool,
}

impl Default for Coarsening {
    fn default() -> Self {
        Self {
            tried: 0,
            enough: None,
            too_few: f64::INFINITY,
            is_last: false,
        }
    }
}

impl Coarsening {
    /// True if fewer points may be tried.
    fn goes_on(&self) -> bool {
        !self.is_last && self.tried < COARSENINGS
    }

    /// The share that was enough, while larger ones are tried.
    fn enough_so_far(&self) -> Option<f64> {
        self.enough.filter(|_| !self.is_last)
    }

    /// The share to try after one that was enough: so many times more, or something between.
    fn was_enough(&mut self, share: f64, more: f64) -> f64 {
        self.tried += 1;
        self.enough = Some(share);
        (share * more).min((share * self.too_few).sqrt())
    }

    /// The share to try after one that was not: something between, or what was enough.
    fn was_too_few(&mut self, share: f64, enough: f64) -> f64 {
        self.tried += 1;
        self.too_few = share;
        self.is_last = self.tried > COARSENINGS;
        match self.is_last {
            true => enough,
            false => (enough * share).sqrt(),
        }
    }
}

impl<'a> Search<'a> {
    /// Samples what is of first order.
    pub fn new(
        minimize: Minimize,
        options: &'a Options,
        sampler: Sampler<'a>,
        judge: Judge<'a>,
    ) -> Result<Self, SchemeError> {
        Ok(Self {
            minimize,
            options,
            trials: Trials::new(&sampler)?,
            components: components::first_order(&sampler)?,
            pairs: None,
            judge,
            sampler,
            is_full: false,
            best: None,
        })
    }

    /// Looks for a draft that meets a tolerance; true if it was found.
    pub fn run(&mut self, tolerance: &PerAxis) -> Result<bool, SchemeError> {
        // Start generously; where that is not enough, take in what motions add in pairs, then leave
        // out less and less.
        if self.is_full && self.pairs.is_some_and(|pairs| pairs > 0) {
            // It was tried for a finer tolerance, and joint effects were needed.
            let second = self.attempt(tolerance, FIRST_SHARE, true)?;
            return self.finish(tolerance, &second, true);
        }
        let share = match self.judge.is_of_tool() {
            true => FIRST_TOOL_SHARE,
            false => FIRST_SHARE,
        };
        let mut first = self.attempt(tolerance, share, false)?;
        self.is_full |= first.attempt.is_full;
        // Joint effects do not help where most of the error is what there was no room for.
        let hopeless = first.error > HOPELESS;
        let other = first.error > CUT * first.attempt.left_out;
        let joint = |search: &mut Self| -> Result<bool, SchemeError> {
            let work = match hopeless {
                true => MOST_WORK_IF_HOPELESS,
                false => MOST_WORK,
            };
            Ok(other && search.joint(tolerance, work)? > 0)
        };
        if hopeless && first.attempt.is_full && joint(self)? {
            let second = self.attempt(tolerance, FIRST_SHARE, true)?;
            return Ok(
                self.finish(tolerance, &second, true)? || self.finish(tolerance, &first, true)?
            );
        }
        if !(hopeless && joint(self)?)
            && (self.finish_cheapest(tolerance, &mut first, share)?
                || self.is_measured() && self.finish(tolerance, &first, true)?)
        {
            return Ok(true);
        }
        if first.attempt.is_full {
            return Ok(false);
        }
        let pairs = joint(self)?;
        self.closer(tolerance, pairs)
    }

    /// Where the structure leaves much, interpolation may leave little and takes many points: one that leaves
    /// less may be cheaper. The one that is expected to be goes first.
    fn finish_cheapest(
        &mut self,
        tolerance: &PerAxis,
        first: &mut Tried,
        share: f64,
    ) -> Result<bool, SchemeError> {
        if !self.judge.is_of_tool() || first.error < STARVING {
            return self.finish(tolerance, first, false);
        }
        // The functions are the same: what they may leave hardly differs.
        let bases = first.attempt.bases();
        let closer = &mut self.attempt_with(bases, tolerance, CLOSER * share, false)?;
        let expected = self.expected_cost(tolerance, first)?;
        let order = match self.expected_cost(tolerance, closer)? < expected {
            true => [closer, first],
            false => [first, closer],
        };
        for tried in order {
            if self.finish(tolerance, tried, false)? {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// What a structure costs, in instructions, with the points that it gets at first.
    fn expected_cost(&self, tolerance: &PerAxis, tried: &mut Tried) -> Result<f64, SchemeError> {
        let found = self.found(tolerance, tried);
        let seen = Seen::all(&found)?;
        let share = self.first_point_share(tried.error);
        let grids = points::grids(&found, &seen, self.options, share, false)?;
        let mut cost = tried.attempt.structure.cost(self.sampler.variables);
        for (v, (bent, _)) in found.tables() {
            if let Some(grid) = grids.get(&v) {
                let samples = grid.samples(self.sampler.variables[v].wraps);
                cost += cubic::stored(bent.len() * samples, self.options.format);
            }
        }
        tried.seen = Some(seen);
        Ok(cost)
    }

    /// The share of the tolerance that interpolation may take at first, after a structure that leaves `error`
    /// of it: points finer than what that leaves would be wasted.
    fn first_point_share(&self, error: f64) -> f64 {
        let share = (GOOD - error)
            .max(LEAST_POINT_SHARE)
            .max(LEAST_POINT_SHARE * error);
        match self.adapts() {
            true => TOOL_SHARE * share,
            false => share,
        }
    }

    /// True if the share of interpolation follows what is measured.
    fn adapts(&self) -> bool {
        self.judge.is_of_tool() && self.options.points.is_none()
    }

    /// With what the tables of a structure are sampled from.
    fn found<'t>(&'t self, tolerance: &'t PerAxis, tried: &'t Tried) -> Found<'t> {
        let components = &self.components[..self.count(tried.pairs)];
        tried.attempt.found(&self.sampler, components, tolerance)
    }

    /// True if motions were measured somewhere: elsewhere there are no points to lie between.
    fn is_measured(&self) -> bool {
        let mut variables = self.sampler.variables.iter();
        variables.any(|v| v.kinks.len() > v.ends.len())
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
            Some(last) if self.is_measured() => self.finish(tolerance, &last, true),
            _ => Ok(false),
        }
    }

    /// True if what the best leaves is explained by what there was no room for.
    pub(crate) fn lacks_room(&self) -> bool {
        let best = self.best.as_ref();
        best.is_some_and(|b| b.is_full && b.verdict.error < CUT * b.left_out)
    }

    /// Fits the weights of the best; true if it meets the tolerance. Where it nearly does, again with
    /// the positions at which it does not.
    pub fn fit(&mut self) -> Result<bool, SchemeError> {
        for _ in 0..FITS {
            let Some(best) = self.best.as_mut().filter(|b| !b.is_fitted) else {
                return Ok(false);
            };
            let Some(draft) = self.judge.fitted(&best.draft)? else {
                return Ok(false);
            };
            let target = &self.options.target;
            let Some(mut verdict) = self.judge.measure(&draft, target) else {
                return Ok(false);
            };
            // What the best was confirmed to meet, the fitted one must meet too.
            let meets = best.meets();
            let good = verdict.error <= GOOD;
            let factor = if good { 1.0 } else { meets.unwrap_or(1.0) };
            let confirmed = self.judge.confirm(&draft, factor)?;
            verdict = confirmed.added_to(verdict);
            if !confirmed.is_kept {
                let known = self.judge.measure(&best.draft, target);
                best.verdict = known.unwrap_or(best.verdict);
            }
            let keeps = confirmed.is_kept || best.meets().is_none();
            let harmless = verdict.harm <= HARMLESS;
            if keeps && harmless && verdict.error < best.verdict.error {
                best.draft = draft;
                best.verdict = verdict;
            }
            if good && confirmed.is_kept && harmless {
                return Ok(true);
            }
            if verdict.error > OUT_OF_REACH {
                break;
            }
        }
        if let Some(best) = &mut self.best {
            best.is_fitted = true;
        }
        Ok(false)
    }

    /// Looks among what is made for finer tolerances; true if something meets this one.
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

    /// Looks for the finest tolerance that is met, among multiples of one that is not.
    pub fn coarser(&mut self, tolerance: &PerAxis) -> Result<(), SchemeError> {
        // What is made for a tolerance not much coarser than what is reached already may better it;
        // where a tolerance is missed, finer ones are.
        let error =
            |best: &Option<Candidate>| best.as_ref().map_or(f64::INFINITY, |b| b.verdict.error);
        let reached = error(&self.best);
        for factor in COARSER.into_iter().rev().filter(|f| *f < 4.0 * reached) {
            // What is made for it may be worse before its weights are fitted.
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

    /// How many pairs of motions have a joint effect that shows and can be had for so much work.
    fn joint(&mut self, tolerance: &PerAxis, work: usize) -> Result<usize, SchemeError> {
        if self.pairs.is_none() {
            let joint = components::second_order(&self.sampler, tolerance, work)?;
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
        let bases = attempt::bases(&self.sampler, components, tolerance, self.minimize, share)?;
        self.attempt_with(&bases, tolerance, share, pairs)
    }

    /// [`Self::attempt`] with functions that are known.
    fn attempt_with(
        &self,
        bases: &[Basis],
        tolerance: &PerAxis,
        share: f64,
        pairs: bool,
    ) -> Result<Tried, SchemeError> {
        let components = &self.components[..self.count(pairs)];
        let sampler = &self.sampler;
        let target = (self.minimize, &self.options.target);
        let try_with = |before: f64| -> Result<(Attempt, f64), SchemeError> {
            let bases = bases.to_vec();
            let next = attempt(sampler, components, bases, tolerance, target, share, before)?;
            let error = self
                .trials
                .error(&next.found(&self.sampler, components, tolerance))?;
            Ok((next, error))
        };
        let (mut attempt, mut error) = try_with(0.0)?;
        for _ in 1..FULL_ATTEMPTS {
            if !attempt.is_full {
                break;
            }
            let (next, less) = try_with(attempt.left_out)?;
            if less > 0.9 * error {
                break;
            }
            (attempt, error) = (next, less);
        }
        Ok(Tried {
            attempt,
            error,
            pairs,
            seen: None,
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
            seen,
        } = tried;
        let structure_error = *structure_error;
        if attempt.structure.count() > usize::from(u8::MAX) {
            return Ok(false);
        }
        let found = attempt.found(
            &self.sampler,
            &self.components[..self.count(*pairs)],
            tolerance,
        );
        // Tolerances differ by a common factor.
        let factor = tolerance[0] / self.judge.tolerance()[0];
        let mut share = self.first_point_share(structure_error);
        let adapts = self.adapts();
        let own;
        let seen = match seen {
            Some(seen) => seen,
            None => {
                own = Seen::all(&found)?;
                &own
            }
        };
        let mut last = f64::INFINITY;
        let mut room = ROOM_STEPS;
        let mut refinement = 0;
        let mut coarsening = Coarsening::default();
        while refinement <= REFINEMENTS {
            let grids = points::grids(&found, seen, self.options, share, finer)?;
            let draft = draft::draft(&found, &grids, seen, self.options)?;
            // What is made for a finer tolerance is to meet the one asked for.
            let wanted = factor.max(1.0);
            let target = &self.options.target;
            let judge = &self.judge;
            let measured = match coarsening.enough_so_far() {
                // Of fewer points only counts if they are enough.
                Some(enough) => {
                    let measured = judge.measure_first(&draft, target, GOOD * wanted);
                    if measured.is_none() {
                        share = coarsening.was_too_few(share, enough);
                        continue;
                    }
                    measured
                }
                None if adapts => judge.measure_first(&draft, target, f64::INFINITY),
                None => judge.measure(&draft, target),
            };
            let Some(mut verdict) = measured else {
                self.is_full = true;
                // More than the target holds: fewer points, unless they were enough before.
                if last.is_finite() || room == 0 {
                    return Ok(false);
                }
                room -= 1;
                share *= 2.0;
                continue;
            };
            let too_good = verdict.error < TOO_GOOD * wanted && verdict.harm <= HARMLESS;
            if adapts && too_good && coarsening.goes_on() {
                // Part of the error is the structure's, and does not grow with fewer points.
                let more = (JUST_GOOD * wanted / verdict.error).clamp(LEAST_COARSER, TOOL_SHARE);
                share = coarsening.was_enough(share, more);
                continue;
            }
            let mut good = verdict.error <= GOOD * wanted;
            if good {
                let confirmed = self.judge.confirm(&draft, wanted)?;
                verdict = confirmed.added_to(verdict);
                if !confirmed.is_kept {
                    good = false;
                    if let Some(best) = &mut self.best {
                        let known = self.judge.measure(&best.draft, &self.options.target);
                        best.verdict = known.unwrap_or(best.verdict);
                    }
                }
            }
            let better = match &self.best {
                // Of tables with more points or fewer, what is good counts, not what is best.
                Some(best) if adapts && good => best.verdict.error > GOOD * wanted,
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
                    is_fitted: false,
                    is_full: attempt.is_full,
                    left_out: attempt.left_out * factor,
                });
            }
            if good {
                return Ok(verdict.harm <= HARMLESS);
            }
            if let Some(enough) = coarsening.enough_so_far() {
                // It failed where it was confirmed: what was hardly finer would fail there too.
                let less = enough.min(LITTLE_LESS * share);
                share = coarsening.was_too_few(share, less);
                continue;
            }
            let blameless = share * factor < BLAMELESS * verdict.error;
            // What was enough fails by little.
            let stuck = verdict.error > 0.9 * last && !coarsening.is_last;
            if self.options.points.is_some() || stuck || blameless {
                break;
            }
            last = verdict.error;
            share *= if coarsening.is_last { LITTLE_LESS } else { 0.5 };
            refinement += 1;
        }
        Ok(false)
    }
}

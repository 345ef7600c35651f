//! Search for the best draft: structures first, then points, each measured.

use super::budget::{Budget, GOOD, Seen};
use super::candidate::{Candidate, Effort, HARMLESS, confirm};
use super::components::{Joint, Split};
use super::cover::{self, Attempt, Minimize, attempt};
use super::judge::{Judge, Verdict};
use super::points::{Resolved, STUCK};
use super::sampling::Sampler;
use super::structure::Decomposition;
use super::trials::Trials;
use super::{components, draft, points};
use crate::schemes::{Options, SchemeError};
use std::collections::BTreeMap;
use std::sync::Arc;
use trueaxis::Draft;
use trueaxis_model::kinematics::{Jacobian, NotConverged};
use trueaxis_model::machine::PerAxis;

/// Share of the tolerance that a structure may leave out at first, in each output (twice the root of the sum of
/// squares, because peaks rarely coincide): more than the tolerance, because fitted weights make up for a part of it.
const MOST_SHARE: f64 = 1.5;
/// A structure that may leave out less is the last one: more tables then change nothing that is measured.
const LEAST_SHARE: f64 = 0.02;
/// The error at which the next structure aims, in units of the tolerance; the rest is left to interpolation.
const AIM: f64 = 0.65;
/// The smallest and the largest factor from a share to the next one.
const STEP: [f64; 2] = [0.3, 0.7];
/// An error of more than this many times what was left out has another cause: joint effects.
const CUT: f64 = 2.0;
/// Most nodes of joint effects, each counted once for every subset of its switches: half a minute on one core. Weaker
/// effects are left out.
const MOST_WORK: usize = 600_000;
/// If a structure leaves more tolerances than this because the target is full, the tolerance is out of reach: fitting the weights
/// of its tables has at most halved an error. It never met a tolerance that the structure misses (487 fits on 300 machines, measured once), so
/// that a result that only counts if it meets the tolerance is not fitted then.
const MOST_FITTED: f64 = 2.0;
/// [`MOST_FITTED`] before the structure for a tolerance is known, from the error that a finer one leaves: functions chosen for
/// a coarser tolerance may halve it. Weights of a structure that leaves more are not fitted.
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

impl Tried {
    /// Its terms and its tables.
    fn size(&self) -> [usize; 2] {
        let structure = &self.attempt.structure;
        [structure.terms.len(), structure.count()]
    }
}

/// How far the search of a structure has come.
struct Walk {
    /// Share of the tolerance that the next structure may leave out.
    share: f64,
    /// True if it includes joint effects of motion pairs.
    pairs: bool,
    /// The error of the structure before.
    before: f64,
    /// Terms and tables of the last structure that was given points.
    finished: Option<[usize; 2]>,
    /// True once a draft was good.
    is_good: bool,
}

impl Walk {
    const START: Self = Self {
        share: MOST_SHARE,
        pairs: false,
        before: f64::INFINITY,
        finished: None,
        is_good: false,
    };
    const WITH_PAIRS: Self = Self {
        pairs: true,
        ..Self::START
    };
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
    with_pairs: Option<Arc<Split>>,
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
    pub fn is_worth_while(&mut self) -> Result<bool, SchemeError> {
        if self.effort == Effort::Best {
            return Ok(true);
        }
        let first = self.attempt(MOST_SHARE, false)?;
        self.is_full |= first.attempt.is_full;
        self.first = Some(first);
        Ok(match (self.left_by_target(), self.effort) {
            (Some(_), Effort::IfItFits) => false,
            (left, Effort::IfNearlyMet) => left.is_none_or(|left| left <= GOOD),
            (left, _) => left.is_none_or(|left| left <= MOST_FITTED),
        })
    }

    /// The error of the first structure that fills the target, as far as it is due to that, in units of the tolerance.
    pub fn left_by_target(&self) -> Option<f64> {
        let first = self.first.as_ref().filter(|first| first.attempt.is_full);
        first.map(|first| first.error.min(first.attempt.left_out))
    }

    /// Searches a draft that meets the tolerance; true if one was found. Structures leave out less and less. Those that
    /// leave little enough get points, until the result is good and the next structure is dearer.
    pub fn run(&mut self) -> Result<bool, SchemeError> {
        let mut walk = Walk::START;
        loop {
            let next = match self.first.take() {
                Some(first) => first,
                None => self.attempt(walk.share, walk.pairs)?,
            };
            let is_full = next.attempt.is_full;
            if is_full && walk.is_good {
                break;
            }
            self.is_full |= is_full;
            // It has another cause than what was left out.
            let is_other = next.error > GOOD.max(CUT * next.attempt.left_out);
            if is_other && self.effort == Effort::IfItFits {
                break;
            }
            let is_stuck = is_other && next.error > STUCK * walk.before;
            let is_last = is_full || is_stuck || walk.share < self.least_share();
            let size = next.size();
            // What a structure leaves, no tables of it make up for.
            let is_tried = next.error <= GOOD || self.effort != Effort::IfNearlyMet;
            if (is_last && is_tried || next.error <= GOOD) && walk.finished != Some(size) {
                walk.finished = Some(size);
                let is_better =
                    self.finish(&next, false)? || self.is_measured() && self.finish(&next, true)?;
                if walk.is_good && !is_better {
                    break;
                }
                walk.is_good |= is_better;
            }
            if is_other && !walk.pairs && !walk.is_good && self.joint()? > 0 {
                walk = Walk::WITH_PAIRS;
                continue;
            }
            if is_last {
                break;
            }
            walk.before = next.error;
            walk.share *= (AIM / next.error).clamp(STEP[0], STEP[1]);
        }
        // Positions at which a later draft failed count for the best one, too.
        let best = self.best.as_ref();
        Ok(walk.is_good && best.is_some_and(|best| best.verdict.error <= GOOD))
    }

    /// A structure that may leave out less is the last one. Where only a size is of interest, what is left out explains no
    /// error from the aim on.
    fn least_share(&self) -> f64 {
        match self.effort {
            Effort::IfItFits => AIM,
            _ => LEAST_SHARE,
        }
    }

    /// True if motions were measured somewhere; otherwise there are no measured points to go between.
    fn is_measured(&self) -> bool {
        let mut variables = self.sampled.sampler.variables.iter();
        variables.any(|v| v.kinks.len() > v.ends.len())
    }

    /// Fits the weights of the best candidate; true if it then meets the tolerance.
    pub fn fit(&mut self) -> Result<bool, SchemeError> {
        let Some(best) = self.best.as_mut().filter(|best| !best.is_fitted) else {
            return Ok(false);
        };
        best.fit(&mut self.judge, &self.options.target, self.effort)
    }

    /// Number of motion pairs whose joint effect is significant and fits into the given work.
    fn joint(&mut self) -> Result<usize, SchemeError> {
        if self.pairs.is_none() {
            let joint = components::second_order(
                &self.sampled.sampler,
                &self.sampled.joint,
                self.judge.tolerance(),
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
                self.with_pairs = Some(Arc::new(Split::new(sampler, all, *finest)));
            }
        }
        Ok(self.pairs.unwrap_or(0))
    }

    /// Tries a structure that leaves out no more than a share of the tolerance, with or without effects of motion
    /// pairs.
    fn attempt(&self, share: f64, pairs: bool) -> Result<Tried, SchemeError> {
        let tolerance = self.judge.tolerance();
        let Sampled {
            sampler, trials, ..
        } = self.sampled;
        let with = self.with_pairs.as_deref().filter(|_| pairs);
        let split = with.unwrap_or(&self.sampled.first);
        let components = &split.components;
        let bases = cover::bases(sampler, split, tolerance, self.minimize, share)?;
        let target = (self.minimize, &self.options.target);
        let leaves_out = self.effort != Effort::IfItFits;
        let mut attempt = attempt(
            sampler, components, bases, tolerance, target, share, leaves_out,
        )?;
        let found = attempt.found(sampler, components, tolerance);
        let mut left = trials.left(&found)?;
        let share_of = |d: &PerAxis, j: &Jacobian| self.judge.share(d, j);
        let mut error = trials.error(&left, tolerance, share_of);
        if error > GOOD && error <= FAR_OUT_OF_REACH {
            let structure = left.fitted(&attempt.structure);
            let fitted = trials.error(&left, tolerance, share_of);
            if fitted < error {
                (error, attempt.structure) = (fitted, structure);
            }
        }
        Ok(Tried {
            attempt,
            error,
            pairs,
        })
    }

    /// Gives the tables of an attempt as few points as are enough; true if the draft is good, and cheaper than the best one.
    /// Points go between measured positions of motions only if `finer`.
    fn finish(&mut self, tried: &Tried, finer: bool) -> Result<bool, SchemeError> {
        let tolerance = *self.judge.tolerance();
        let attempt = &tried.attempt;
        if attempt.structure.count() > usize::from(u8::MAX) {
            return Ok(false);
        }
        let sampled = self.sampled;
        let with = self.with_pairs.clone().filter(|_| tried.pairs);
        let components = &with.as_deref().unwrap_or(&sampled.first).components;
        let found = &attempt.found(&sampled.sampler, components, &tolerance);
        let pairs = self.pairs.filter(|_| tried.pairs).unwrap_or(0);
        let mut points = Points {
            found,
            resolved: Resolved::all(found)?,
            finer,
            budget: Budget::new(tried.error),
            own: f64::INFINITY,
        };
        let candidate = |draft, verdict| Candidate {
            draft,
            verdict,
            structure_error: tried.error,
            pairs,
            is_fitted: false,
        };
        let target = &self.options.target;
        while let Some((draft, mut verdict)) = self.fewest(&mut points, candidate)? {
            let best = self.best.as_mut();
            let is_kept = confirm(&mut self.judge, best, &draft, &mut verdict, target)?
                && verdict.harm <= HARMLESS;
            let next = candidate(draft, verdict);
            let best = self.best.as_ref();
            let is_better = match is_kept {
                true => best.is_none_or(|best| {
                    best.verdict.error > GOOD
                        || self.minimize.cost(&next.draft) < self.minimize.cost(&best.draft)
                }),
                // It is no good, but may leave less than all others.
                false => {
                    verdict.harm <= HARMLESS
                        && best.is_none_or(|best| verdict.error < best.verdict.error)
                }
            };
            if is_better {
                self.best = Some(next);
            }
            if is_kept {
                return Ok(is_better);
            }
            if !points.budget.next(Seen::Refused) {
                break;
            }
        }
        Ok(false)
    }

    /// The good draft with fewest points. If there is none, the best candidate may be the one that leaves least.
    fn fewest(
        &mut self,
        points: &mut Points<'_>,
        candidate: impl Fn(Draft, Verdict) -> Candidate,
    ) -> Result<Option<(Draft, Verdict)>, SchemeError> {
        let mut good: Option<(Draft, Verdict)> = None;
        loop {
            let draft = points.draft(self.options)?;
            let early = match good {
                Some(_) => GOOD,
                None => f64::INFINITY,
            };
            let target = &self.options.target;
            let seen = match self.judge.measure_first(&draft, target, early) {
                None if good.is_some() => Seen::Bad(f64::INFINITY),
                None => {
                    self.is_full = true;
                    Seen::TooLarge
                }
                Some(verdict) if verdict.error <= GOOD && verdict.harm <= HARMLESS => {
                    good = Some((draft, verdict));
                    Seen::Good
                }
                Some(verdict) => {
                    // More points must be worth their bytes.
                    let best = self.best.as_ref();
                    let best = best.map_or(f64::INFINITY, |b| b.verdict.error);
                    if verdict.harm <= HARMLESS {
                        if verdict.error < best.min(STUCK * points.own) {
                            self.best = Some(candidate(draft, verdict));
                        }
                        points.own = points.own.min(verdict.error);
                    }
                    Seen::Bad(verdict.error)
                }
            };
            if !points.budget.next(seen) {
                return Ok(good);
            }
        }
    }
}

/// A structure whose tables get points.
struct Points<'a> {
    found: &'a Decomposition<'a>,
    resolved: BTreeMap<usize, Resolved>,
    /// True if points may go between measured positions of motions.
    finer: bool,
    budget: Budget,
    /// The least that a harmless draft leaves that is not good.
    own: f64,
}

impl Points<'_> {
    /// The draft with the number of points that the budget wants.
    fn draft(&mut self, options: &Options) -> Result<Draft, NotConverged> {
        let Self {
            found, resolved, ..
        } = self;
        let grids = points::grids(found, resolved, options, self.budget.share, self.finer)?;
        if options.points.is_some() || grids.is_empty() {
            self.budget.ends();
        }
        draft::draft(found, &grids, options)
    }
}

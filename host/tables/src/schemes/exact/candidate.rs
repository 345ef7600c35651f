//! From a draft that does no harm to one that meets the tolerance: its weights are fitted, and it is confirmed.

use super::budget::GOOD;
use super::judge::{Judge, Verdict};
use crate::schemes::SchemeError;
use crate::target::Target;
use trueaxis::Draft;

/// Tables do no harm if no axis deviates by more than this fraction of the limit; other positions may be a little
/// worse.
pub const HARMLESS: f64 = 0.9;
/// How often weights are fitted, each time including the positions that failed before.
const FITS: usize = 8;
/// A draft that leaves more tolerances than this after a fit is not fitted again; eight rounds halve the error.
const OUT_OF_REACH: f64 = 30.0;

/// How much work a tolerance is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// The result that deviates least, even if it misses the tolerance.
    Best,
    /// A coarser tolerance will be tried next: no result if the target clearly is too small for this one.
    IfWithinReach,
    /// Like `IfWithinReach`, and no result that clearly misses the tolerance, nor one of a structure that misses it.
    IfNearlyMet,
    /// No result unless the target holds everything that the tolerance needs, without joint effects: only its size is of
    /// interest, and they take most of the time.
    IfItFits,
}

/// A draft that does no harm.
pub struct Candidate {
    pub draft: Draft,
    pub verdict: Verdict,
    /// Error of its structure before interpolation, in units of the requested tolerance.
    pub structure_error: f64,
    /// Number of motion pairs included.
    pub pairs: usize,
    /// True if its weights have been fitted as far as possible.
    pub is_fitted: bool,
}

impl Candidate {
    /// True if it meets the tolerance according to measurement.
    pub fn is_good(&self) -> bool {
        self.verdict.error <= GOOD
    }

    /// Fits its weights; true if it then meets the tolerance. If it nearly does, repeats the fit with the positions at
    /// which it fails.
    pub fn fit(
        &mut self,
        judge: &mut Judge<'_>,
        target: &Target,
        effort: Effort,
    ) -> Result<bool, SchemeError> {
        for round in 0..FITS {
            let Some(draft) = judge.fitted(&self.draft)? else {
                return Ok(false);
            };
            let Some(mut verdict) = judge.measure(&draft, target) else {
                return Ok(false);
            };
            let good = verdict.error <= GOOD;
            let is_confirmed = confirm(judge, Some(&mut *self), &draft, &mut verdict, target)?;
            // Of the same positions.
            let before = self.verdict.error;
            let keeps = is_confirmed || !self.is_good();
            let harmless = verdict.harm <= HARMLESS;
            if keeps && harmless && verdict.error < self.verdict.error {
                self.draft = draft;
                self.verdict = verdict;
            }
            if good && is_confirmed && harmless {
                return Ok(true);
            }
            // If all further rounds gained as much as this one, they would still miss the tolerance.
            let gain = verdict.error / before;
            let left = i32::try_from(FITS - 1 - round).unwrap_or(0);
            let is_missed = verdict.error * gain.min(1.0).powi(left) > GOOD;
            // A round that gains nothing and finds no further positions would be repeated.
            let is_done = gain >= 1.0 && !good;
            if verdict.error > OUT_OF_REACH || is_done || effort != Effort::Best && is_missed {
                break;
            }
        }
        self.is_fitted = true;
        Ok(false)
    }
}

/// Measures a draft at many more positions; true if it stays within the tolerance. Otherwise the best
/// so far is measured again, because positions were added.
pub fn confirm(
    judge: &mut Judge<'_>,
    best: Option<&mut Candidate>,
    draft: &Draft,
    verdict: &mut Verdict,
    target: &Target,
) -> Result<bool, SchemeError> {
    let confirmed = judge.confirm(draft, GOOD)?;
    *verdict = confirmed.added_to(*verdict);
    if let (false, Some(best)) = (confirmed.is_kept, best) {
        let known = judge.measure(&best.draft, target);
        best.verdict = known.unwrap_or(best.verdict);
    }
    Ok(confirmed.is_kept)
}

//! Which share of the tolerance interpolation may take: found from draft to draft.

use super::limits::{
    BLAMELESS, COARSENINGS, GOOD, JUST_GOOD, LEAST_COARSER, LITTLE_LESS, REFINEMENTS, ROOM_STEPS,
    TOO_GOOD, TOOL_SHARE,
};

/// The share, and what earlier drafts showed about it. A smaller share takes more points. Errors are in units of
/// the tolerance asked for.
pub struct Budget {
    /// The share for the next draft.
    pub share: f64,
    /// The error that a draft may leave is this many times the tolerance asked for.
    factor: f64,
    /// True if larger shares are tried after one that left little.
    adapts: bool,
    /// How often the share was halved, and may still be doubled because the target is full.
    refinements: usize,
    room: usize,
    /// The error after the last refinement.
    last: f64,
    /// How often a larger share was tried.
    coarsenings: usize,
    /// The largest share that was enough, and the smallest that was not.
    enough: Option<f64>,
    too_few: f64,
    /// True if no larger share is tried any more.
    is_settled: bool,
}

impl Budget {
    /// Starts with `share`, for drafts that may leave `factor` times the tolerance asked for.
    pub fn new(share: f64, factor: f64, adapts: bool) -> Self {
        Self {
            share,
            factor,
            adapts,
            refinements: 0,
            room: ROOM_STEPS,
            last: f64::INFINITY,
            coarsenings: 0,
            enough: None,
            too_few: f64::INFINITY,
            is_settled: false,
        }
    }

    /// True if another draft may be made.
    pub fn goes_on(&self) -> bool {
        self.refinements <= REFINEMENTS
    }

    /// The largest error that a draft with fewer points than were enough may have to be of use; infinite where
    /// positions of confirmation can wait; `None` where they cannot.
    pub fn most_error(&self) -> Option<f64> {
        match self.enough_so_far() {
            Some(_) => Some(GOOD * self.factor),
            None if self.adapts => Some(f64::INFINITY),
            None => None,
        }
    }

    /// After a draft that errs by more than [`Self::most_error`] or that the target cannot hold: true if another
    /// share is worth a try.
    pub fn after_unusable(&mut self) -> bool {
        if let Some(enough) = self.enough_so_far() {
            self.take_less(enough);
            return true;
        }
        // Fewer points, unless they were too few before.
        if self.last.is_finite() || self.room == 0 {
            return false;
        }
        self.room -= 1;
        self.share *= 2.0;
        true
    }

    /// After a draft without harm that leaves `error`: true if fewer points may do and are tried.
    pub fn takes_more(&mut self, error: f64) -> bool {
        let is_last = self.is_settled || self.coarsenings >= COARSENINGS;
        if !self.adapts || is_last || error >= TOO_GOOD * self.factor {
            return false;
        }
        self.coarsenings += 1;
        self.enough = Some(self.share);
        // Part of the error is the structure's, and does not grow with fewer points.
        let more = (JUST_GOOD * self.factor / error).clamp(LEAST_COARSER, TOOL_SHARE);
        self.share = (self.share * more).min((self.share * self.too_few).sqrt());
        true
    }

    /// After a draft that is not good: true if more points may help. `part` is the tolerance that the draft was made
    /// for, as a part of the one asked for; points that are `fixed` do not follow the share.
    pub fn after_bad(&mut self, error: f64, part: f64, is_fixed: bool) -> bool {
        if let Some(enough) = self.enough_so_far() {
            // It failed where it was confirmed: what was hardly finer would fail there too.
            self.take_less(enough.min(LITTLE_LESS * self.share));
            return true;
        }
        let is_blameless = self.share * part < BLAMELESS * error;
        // What was enough fails by little.
        let is_stuck = error > 0.9 * self.last && !self.is_settled;
        if is_fixed || is_stuck || is_blameless {
            return false;
        }
        self.last = error;
        self.share *= if self.is_settled { LITTLE_LESS } else { 0.5 };
        self.refinements += 1;
        true
    }

    /// True while larger shares are tried after one that was enough.
    pub fn is_coarsening(&self) -> bool {
        self.enough_so_far().is_some()
    }

    /// The share that was enough, while larger ones are tried.
    fn enough_so_far(&self) -> Option<f64> {
        self.enough.filter(|_| !self.is_settled)
    }

    /// The share was too large: one between it and what was enough, or in the end `enough`.
    fn take_less(&mut self, enough: f64) {
        self.coarsenings += 1;
        self.too_few = self.share;
        self.is_settled = self.coarsenings > COARSENINGS;
        self.share = match self.is_settled {
            true => enough,
            false => (enough * self.share).sqrt(),
        };
    }
}

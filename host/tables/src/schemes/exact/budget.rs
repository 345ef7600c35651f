//! From the errors of drafts to the share of the tolerance that interpolation may use.

/// A result is good if the tables, measured at some thousand positions, stay within this share of the tolerance; other
/// positions may be a little worse.
pub const GOOD: f64 = 0.95;
/// Number of refinements of the points.
const REFINEMENTS: usize = 4;
/// If the tip and the direction are measured: smallest factor by which the share grows when fewer points are tried;
/// initial factor of the share of each table; fraction of the tolerance below which fewer points are tried; fraction
/// they aim for; and number of such trials.
const LEAST_COARSER: f64 = 2.0;
pub const TOOL_SHARE: f64 = 8.0;
const TOO_GOOD: f64 = 0.85;
const JUST_GOOD: f64 = 0.9;
const COARSENINGS: usize = 5;
/// A draft that passes where it is measured and fails when confirmed fails by little: the share of interpolation
/// is multiplied by this.
pub const LITTLE_LESS: f64 = 0.7;
/// How often points are halved if the target cannot hold them.
const ROOM_STEPS: usize = 6;

/// The share, and what earlier drafts showed about it. A smaller share takes more points. Errors are in units of the
/// requested tolerance.
pub struct Budget {
    /// The share for the next draft.
    pub share: f64,
    /// A draft may leave an error of this many requested tolerances.
    factor: f64,
    /// True if larger shares are tried after one that left a small error.
    adapts: bool,
    /// How often the share was halved, and how often it may still be doubled because the target is full.
    refinements: usize,
    room: usize,
    /// The error after the last halving.
    last: f64,
    /// How often a larger share was tried.
    coarsenings: usize,
    /// The largest share that was small enough, and the smallest that was not.
    enough: Option<f64>,
    too_few: f64,
    /// True if no larger shares are tried any more.
    is_settled: bool,
}

impl Budget {
    /// Starts with `share`, for drafts that may leave `factor` times the requested tolerance.
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

    /// The largest error at which a draft with fewer points than the last good one is still useful. Infinite if the
    /// positions of confirmation can wait; `None` if they cannot.
    pub fn most_error(&self) -> Option<f64> {
        match self.enough_so_far() {
            Some(_) => Some(GOOD * self.factor),
            None if self.adapts => Some(f64::INFINITY),
            None => None,
        }
    }

    /// Called after a draft whose error exceeds [`Self::most_error`] or that does not fit into the target. True if
    /// another share is worth trying.
    pub fn after_unusable(&mut self) -> bool {
        if let Some(enough) = self.enough_so_far() {
            self.take_less(enough);
            return true;
        }
        // Use fewer points, unless they were too few before.
        if self.last.is_finite() || self.room == 0 {
            return false;
        }
        self.room -= 1;
        self.share *= 2.0;
        true
    }

    /// Called after a harmless draft that leaves `error`. True if fewer points may be enough and should be tried.
    pub fn takes_more(&mut self, error: f64) -> bool {
        let is_last = self.is_settled || self.coarsenings >= COARSENINGS;
        if !self.adapts || is_last || error >= TOO_GOOD * self.factor {
            return false;
        }
        self.coarsenings += 1;
        self.enough = Some(self.share);
        self.refinements = 0;
        // Part of the error is due to the structure and does not grow with fewer points.
        let more = (JUST_GOOD * self.factor / error).clamp(LEAST_COARSER, TOOL_SHARE);
        self.share = (self.share * more).min((self.share * self.too_few).sqrt());
        true
    }

    /// Called after a draft that is not good. True if more points may help. `is_fixed` points do not depend on the share.
    pub fn after_bad(&mut self, error: f64, is_fixed: bool) -> bool {
        if let Some(enough) = self.enough_so_far() {
            // It failed at the positions of confirmation, where a slightly finer share would fail too.
            self.take_less(enough.min(LITTLE_LESS * self.share));
            return true;
        }
        // The last halving brought almost nothing.
        let is_stuck = error > 0.9 * self.last && !self.is_settled;
        if is_fixed || is_stuck {
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

    /// The share that was small enough, while larger ones are being tried.
    fn enough_so_far(&self) -> Option<f64> {
        self.enough.filter(|_| !self.is_settled)
    }

    /// The share was too large: try one between it and the one that was enough, or finally `enough`.
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

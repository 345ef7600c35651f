//! From what drafts leave to the share of the tolerance that interpolation may use: a bisection.

/// A result is good if the tables, measured at some thousand positions, stay within this share of the tolerance; other
/// positions may be a little worse.
pub const GOOD: f64 = 0.95;
/// The share of the error of a structure, or of the tolerance if that is larger, with which the bisection starts.
const FIRST: f64 = 0.5;
/// The first larger share, and the first smaller one, relative to the share before.
const MORE: f64 = 4.0;
const LESS: f64 = 0.5;
/// The bisection ends when the smallest share that was too large is at most this many times the largest one that was
/// not: linear interpolation, with an error of the square of the step, then takes a tenth fewer points.
const CLOSE: f64 = 1.2;
/// Maximum number of drafts of a structure.
const DRAFTS: usize = 12;

/// What a draft has shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Seen {
    /// It leaves so little that fewer points may be enough.
    Good,
    /// It leaves too large an error, in units of the tolerance.
    Bad(f64),
    /// The target cannot hold it.
    TooLarge,
    /// It was good, but leaves too much at further positions.
    Refused,
}

/// The share, and what drafts have shown about it. A smaller share takes more points.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// The share for the next draft.
    pub share: f64,
    /// The largest share that was small enough, and the smallest that was not.
    enough: Option<f64>,
    too_much: Option<f64>,
    /// The error of the last draft that was not good.
    last: f64,
    /// True if a draft was too large for the target.
    is_full: bool,
    /// How many further drafts may be made.
    left: usize,
}

impl Budget {
    /// Starts for a structure that leaves `error` tolerances.
    pub fn new(error: f64) -> Self {
        Self {
            share: FIRST * error.max(1.0),
            enough: None,
            too_much: None,
            last: f64::INFINITY,
            is_full: false,
            left: DRAFTS,
        }
    }

    /// There are no points to choose: one draft is enough.
    pub fn ends(&mut self) {
        self.left = 1;
    }

    /// Takes in what the draft for [`Self::share`] has shown; true if another share is worth trying.
    pub fn next(&mut self, seen: Seen) -> bool {
        self.left = self.left.saturating_sub(1);
        let share = self.share;
        match seen {
            Seen::Good => self.enough = Some(share),
            Seen::Bad(error) => {
                // More points brought almost nothing, or there is no room for them.
                if self.enough.is_none() && (self.is_full || error > 0.9 * self.last) {
                    return false;
                }
                self.last = error;
                self.too_much = Some(share);
            }
            Seen::TooLarge => {
                if self.too_much.is_some() {
                    return false;
                }
                self.is_full = true;
            }
            Seen::Refused => {
                self.too_much = self.enough.take();
            }
        }
        self.share = match (self.enough, self.too_much) {
            (Some(enough), Some(too_much)) if too_much <= CLOSE * enough => return false,
            (Some(enough), Some(too_much)) => (enough * too_much).sqrt(),
            (Some(enough), None) => MORE * enough,
            (None, Some(too_much)) if seen == Seen::Refused => too_much / CLOSE,
            (None, Some(too_much)) => LESS * too_much,
            (None, None) => share / LESS,
        };
        self.left > 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The shares that are tried if drafts are good up to the share `good`, and fit the target from the share `fits` on; and the
    /// last good one.
    fn tried(good: f64, fits: f64) -> (Vec<f64>, Option<f64>) {
        let mut budget = Budget::new(0.5);
        let (mut shares, mut found) = (Vec::new(), None);
        loop {
            let share = budget.share;
            shares.push(share);
            let seen = match share {
                _ if share < fits => Seen::TooLarge,
                _ if share > good => Seen::Bad(share),
                _ => Seen::Good,
            };
            found = if seen == Seen::Good {
                Some(share)
            } else {
                found
            };
            if !budget.next(seen) {
                return (shares, found);
            }
        }
    }

    #[test]
    fn the_largest_good_share_is_enclosed() {
        for good in [0.02, 0.3, 0.6, 3.0, 40.0] {
            let (shares, found) = tried(good, 0.0);
            let found = found.unwrap();
            assert!(found <= good && good < CLOSE * found, "{good}: {shares:?}");
            assert!(shares.len() <= DRAFTS, "{good}: {shares:?}");
        }
    }

    #[test]
    fn what_does_not_fit_gets_fewer_points_and_ends_where_these_are_too_few() {
        let (shares, found) = tried(9.0, 3.0);
        assert_eq!(shares[..3], [0.5, 1.0, 2.0]);
        assert!(found.is_some_and(|found| found >= 3.0));
        let (shares, found) = tried(1.5, 3.0);
        assert_eq!((shares.len(), found), (4, None));
    }

    #[test]
    fn a_good_draft_that_is_refused_gets_a_few_more_points() {
        let mut budget = Budget::new(0.5);
        assert!(budget.next(Seen::Good));
        let share = 0.5;
        assert!(budget.next(Seen::Refused));
        assert_eq!(budget.share, share / CLOSE);
    }

    #[test]
    fn points_that_are_given_are_not_changed() {
        for seen in [Seen::Good, Seen::Bad(2.0), Seen::TooLarge] {
            let mut budget = Budget::new(0.5);
            budget.ends();
            assert!(!budget.next(seen));
        }
    }
}

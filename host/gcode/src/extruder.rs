//! The extruder of a printer: E is not an axis of the machine, it belongs to the length of a move.

use super::modal::Distance;

/// What is known of it, in units of the program.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extruder {
    /// M82 or M83.
    word: Option<Distance>,
    /// The last of M82, M83, G90 and G91.
    last: Option<Distance>,
    /// What an absolute E counts from; `None`: not known.
    pub at: Option<f64>,
    /// The sum of everything that was extruded, as far as it is known.
    pub total: f64,
}

impl Extruder {
    /// M82, M83.
    pub fn set(&mut self, distance: Distance) {
        self.word = Some(distance);
        self.last = Some(distance);
    }

    /// G90, G91, which change E in some firmwares.
    pub fn set_axes(&mut self, distance: Distance) {
        self.last = Some(distance);
    }

    /// Nothing is known any more.
    pub fn forget(&mut self) {
        (self.word, self.last, self.at) = (None, None, None);
    }

    /// Whether E is absolute or relative while the axes are so; `None` where firmwares differ: in Marlin the last word
    /// holds, in Klipper G91 is relative for E too, in RepRapFirmware and Prusa's M82 and M83 alone count.
    #[must_use]
    pub fn distance(&self, axes: Option<Distance>) -> Option<Distance> {
        let klipper = match axes {
            Some(Distance::Incremental) => axes,
            _ => self.word,
        };
        self.word
            .filter(|_| self.word == self.last && self.word == klipper)
    }

    /// A word E; how much it extrudes, if that is known.
    pub fn extrude(&mut self, value: f64, distance: Option<Distance>) -> Option<f64> {
        let by = match distance {
            Some(Distance::Absolute) => self.at.map(|at| value - at),
            Some(Distance::Incremental) => Some(value),
            None => None,
        };
        self.at = match distance {
            Some(Distance::Absolute) => Some(value),
            Some(Distance::Incremental) => self.at.map(|at| at + value),
            None => None,
        };
        self.total += by.unwrap_or(0.0);
        by
    }

    /// True if both have extruded the same and go on from the same place.
    #[must_use]
    pub fn agrees(&self, other: &Self) -> bool {
        /// What sums of rounded words differ by, where nothing is lost.
        const SAME: f64 = 1e-6;
        let places = match (self.at, other.at) {
            (Some(a), Some(b)) => (a - b).abs() < SAME,
            (a, b) => a == b,
        };
        places
            && (self.word, self.last) == (other.word, other.last)
            && (self.total - other.total).abs() < SAME
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn where_firmwares_differ_the_mode_is_not_known() {
        use Distance::{Absolute, Incremental};
        let mut extruder = Extruder::default();
        assert_eq!(extruder.distance(Some(Absolute)), None);
        extruder.set(Absolute);
        assert_eq!(extruder.distance(Some(Absolute)), Some(Absolute));
        extruder.set_axes(Incremental);
        assert_eq!(extruder.distance(Some(Incremental)), None);
        extruder.set_axes(Absolute);
        assert_eq!(extruder.distance(Some(Absolute)), Some(Absolute));
        extruder.set(Incremental);
        assert_eq!(extruder.distance(Some(Absolute)), Some(Incremental));
        extruder.set_axes(Incremental);
        assert_eq!(extruder.distance(Some(Incremental)), Some(Incremental));
        extruder.set_axes(Absolute);
        assert_eq!(extruder.distance(Some(Absolute)), None);
    }
}

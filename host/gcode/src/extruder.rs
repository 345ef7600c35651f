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
    at: Option<Length>,
    /// The sum of everything that was extruded, as far as it is known.
    total: Length,
}

/// Lengths of filament in billionths of the program's unit: sums of words are exact, however many there are.
type Length = i128;

/// Of a unit.
const PER_UNIT: f64 = 1e9;

fn length(value: f64) -> Length {
    (value * PER_UNIT).round() as Length
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

    /// What an absolute E counts from, in units of the program; `None`: not known.
    #[must_use]
    pub fn at(&self) -> Option<f64> {
        self.at.map(|at| at as f64 / PER_UNIT)
    }

    /// G92: what E counts from here on; `None`: not known.
    pub fn set_at(&mut self, at: Option<f64>) {
        self.at = at.map(length);
    }

    /// How much more this one has extruded, in units of the program.
    #[must_use]
    pub fn ahead_of(&self, other: &Self) -> f64 {
        (self.total - other.total) as f64 / PER_UNIT
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
        let value = length(value);
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
        self.total += by.unwrap_or(0);
        by.map(|by| by as f64 / PER_UNIT)
    }

    /// True if both have extruded the same and go on from the same place.
    #[must_use]
    pub fn agrees(&self, other: &Self) -> bool {
        /// Digits beyond those that are written, at most.
        const SAME: Length = 1000;
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
    fn a_million_words_extrude_what_one_does() {
        let [mut many, mut one] = [Extruder::default(); 2];
        one.set_at(Some(0.0));
        many.set_at(Some(0.0));
        for _ in 0..1_000_000 {
            many.extrude(0.1, Some(Distance::Incremental));
        }
        assert_eq!(one.extrude(1e5, Some(Distance::Absolute)), Some(1e5));
        assert_eq!(many.ahead_of(&one), 0.0);
        assert_eq!(many.at(), Some(1e5));
        assert!(many.agrees(&one));
    }

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

//! What a servo update reports.

use core::fmt;
use core::ops::{BitOr, BitOrAssign};

/// Set of conditions that hold in this period.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Conditions(pub u16);

impl Conditions {
    /// An input is NaN, infinite, beyond 2¹³ periods of an endless axis or a modulo table, or beyond the travel by more
    /// than [`OVERTRAVEL`](crate::OVERTRAVEL) times its length.
    pub const BAD_INPUT: Self = Self(1);
    /// The period is not a number from [`SHORTEST_PERIOD`](crate::SHORTEST_PERIOD) to
    /// [`LONGEST_PERIOD`](crate::LONGEST_PERIOD).
    pub const BAD_PERIOD: Self = Self(1 << 1);
    /// An input axis of an active term is not referenced.
    pub const UNREFERENCED: Self = Self(1 << 2);
    /// The computed correction is from an earlier period.
    pub const HELD: Self = Self(1 << 3);
    /// After a fault or the loss of a reference: held until the fade factor has reached 0.
    pub const FROZEN: Self = Self(1 << 4);
    /// The fade factor is moving to 0 or 1.
    pub const RAMPING: Self = Self(1 << 5);
    /// Another compensation or other weights are being faded in, or are waiting for that.
    pub const FADING: Self = Self(1 << 6);
    /// Corrections are not enabled.
    pub const DISABLED: Self = Self(1 << 7);
    /// A dry run: everything is computed, and the output is zero or ramping to zero.
    pub const DRY_RUN: Self = Self(1 << 8);
    /// An auxiliary input that matters is NaN (never set, or its sensor has failed), infinite or out of reach. A
    /// special case of [`BAD_INPUT`](Self::BAD_INPUT), which is set as well.
    pub const BAD_AUXILIARY: Self = Self(1 << 9);

    /// The compensation is empty: loading failed, or was forgotten. The fade factor stays 0.
    pub const NOTHING_LOADED: Self = Self(1 << 10);
    /// A temperature that matters is beyond its tables, so its effect stays what it is at the border.
    pub const BEYOND_RANGE: Self = Self(1 << 11);

    /// Each condition with its name.
    const NAMES: [(Self, &'static str); 12] = [
        (Self::NOTHING_LOADED, "nothing loaded"),
        (Self::BAD_INPUT, "bad input"),
        (Self::BAD_AUXILIARY, "bad auxiliary"),
        (Self::BAD_PERIOD, "bad period"),
        (Self::UNREFERENCED, "not referenced"),
        (Self::BEYOND_RANGE, "beyond range"),
        (Self::HELD, "held"),
        (Self::FROZEN, "frozen"),
        (Self::RAMPING, "ramping"),
        (Self::FADING, "fading"),
        (Self::DISABLED, "disabled"),
        (Self::DRY_RUN, "dry run"),
    ];

    /// Names of the conditions that hold, faults first.
    ///
    /// ```
    /// use trueaxis::Conditions;
    ///
    /// let conditions = Conditions::HELD | Conditions::BAD_INPUT;
    /// assert!(conditions.names().eq(["bad input", "held"]));
    /// assert_eq!(format!("{conditions:?}"), "{bad input, held}");
    /// ```
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        let named = Self::NAMES.into_iter();
        named.filter_map(move |(condition, name)| self.contains(condition).then_some(name))
    }

    /// Whether all conditions of `other` hold.
    #[must_use]
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    pub(crate) fn set(&mut self, condition: Self, holds: bool) {
        if holds {
            *self |= condition;
        }
    }
}

/// Prints the names of the conditions that hold.
impl fmt::Debug for Conditions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("{")?;
        for (place, name) in self.names().enumerate() {
            f.write_str(if place == 0 { "" } else { ", " })?;
            f.write_str(name)?;
        }
        f.write_str("}")
    }
}

impl BitOr for Conditions {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl BitOrAssign for Conditions {
    fn bitor_assign(&mut self, other: Self) {
        self.0 |= other.0;
    }
}

/// Conditions, and the axes on which a limit acts (bit 0 is the first axis).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Status {
    /// Conditions that hold in this period.
    pub conditions: Conditions,
    /// Axes whose computed correction reached the value bound.
    pub saturated: u16,
    /// Axes whose correction lags because of the rate bound.
    pub rate_limited: u16,
    /// Axes whose correction would leave the travel.
    pub travel_limited: u16,
}

impl Status {
    /// Whether all conditions of `condition` hold.
    #[must_use]
    pub const fn is(&self, condition: Conditions) -> bool {
        self.conditions.contains(condition)
    }
}

/// The result of a servo update; `A` is `[f32; AXES]`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Correction<A> {
    /// Correction to add to the commands, mm or degrees.
    pub dq: A,
    /// Computed correction within the value bounds, before the fade factor, travel and rate bounds.
    pub computed: A,
    /// Conditions and active limits.
    pub status: Status,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_condition_has_a_bit_of_its_own() {
        let bits = Conditions::NAMES.map(|(condition, _)| condition.0);
        let all = bits.iter().fold(0, |all, bit| all | bit);
        assert!(bits.iter().all(|bit| bit.count_ones() == 1));
        assert_eq!(all.count_ones() as usize, bits.len());
    }

    #[test]
    fn conditions_say_which_of_them_hold() {
        let both = Conditions::HELD | Conditions::BAD_INPUT;
        assert_eq!(both | Conditions::HELD, both);
        assert_eq!(std::format!("{both:?}"), "{bad input, held}");
        assert!(both.names().eq(["bad input", "held"]));
        for condition in [Conditions::HELD, Conditions::BAD_INPUT, both] {
            assert!(both.contains(condition));
        }
        assert!(!both.contains(Conditions::FROZEN));
        assert!(!both.contains(both | Conditions::FROZEN));
    }
}

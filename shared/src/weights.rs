//! Weights of the adjustable terms.

use core::fmt;

use crate::description::ADJUSTABLE;

/// Current weights of the adjustable terms of one compensation, with their limits.
///
/// Obtained from [`Compensation::weights`](crate::Compensation::weights); every weight it holds
/// is within its limits.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Weights {
    values: [f32; ADJUSTABLE],
    limits: [[f32; 2]; ADJUSTABLE],
    terms: [u16; ADJUSTABLE],
    count: u8,
}

impl Weights {
    pub(crate) const fn empty() -> Self {
        Self {
            values: [0.0; ADJUSTABLE],
            limits: [[0.0; 2]; ADJUSTABLE],
            terms: [0; ADJUSTABLE],
            count: 0,
        }
    }

    /// Whether the list is full.
    pub(crate) fn is_full(&self) -> bool {
        usize::from(self.count) == ADJUSTABLE
    }

    /// Appends a term; returns its index, or `None` when the list is full.
    pub(crate) fn push(&mut self, term: u16, value: f32, limits: [f32; 2]) -> Option<u8> {
        let place = self.count;
        *self.values.get_mut(usize::from(place))? = value;
        self.limits[usize::from(place)] = limits;
        self.terms[usize::from(place)] = term;
        self.count += 1;
        Some(place)
    }

    /// Limits at an index returned by [`Weights::push`].
    pub(crate) fn limits_at(&self, place: u8) -> Option<[f32; 2]> {
        let limits = self.limits.get(usize::from(place));
        limits.filter(|_| place < self.count).copied()
    }

    /// The weight at each index.
    #[inline(always)]
    pub(crate) fn values(&self) -> &[f32; ADJUSTABLE] {
        &self.values
    }

    /// The weights of the adjustable terms, in order.
    #[must_use]
    pub fn as_slice(&self) -> &[f32] {
        let count = usize::from(self.count);
        self.values.get(..count).unwrap_or_default()
    }

    /// Copies the values of `other`, which belongs to the same compensation or to one that replaces it.
    pub(crate) fn take_values(&mut self, other: &Self) {
        self.values = other.values;
    }

    /// Indices of the adjustable terms, in order.
    fn taken(&self) -> &[u16] {
        self.terms
            .get(..usize::from(self.count))
            .unwrap_or_default()
    }

    fn place(&self, term: usize) -> Option<usize> {
        self.taken().iter().position(|&t| usize::from(t) == term)
    }

    /// Sets the weight of adjustable term `term` (its index in the compensation).
    ///
    /// # Errors
    /// The term is not adjustable, or the weight is outside its limits or NaN: nothing changes.
    pub fn set(&mut self, term: usize, value: f32) -> Result<(), WeightError> {
        let place = self.place(term).ok_or(WeightError::NotAdjustable)?;
        let (weight, limits) = (self.values.get_mut(place), self.limits.get(place));
        let (Some(weight), Some(&[low, high])) = (weight, limits) else {
            return Err(WeightError::NotAdjustable);
        };
        if value >= low && value <= high {
            *weight = value;
            Ok(())
        } else {
            Err(WeightError::OutsideLimits { low, high })
        }
    }

    /// The weight of adjustable term `term`.
    #[must_use]
    pub fn get(&self, term: usize) -> Option<f32> {
        self.values.get(self.place(term)?).copied()
    }

    /// Index and weight of every adjustable term, in order.
    pub fn iter(&self) -> impl Iterator<Item = (usize, f32)> + '_ {
        self.taken()
            .iter()
            .zip(&self.values)
            .map(|(&term, &value)| (usize::from(term), value))
    }
}

/// Why a weight was refused.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "link", derive(serde::Serialize, serde::Deserialize))]
pub enum WeightError {
    /// There is no such term, or its weight is fixed.
    NotAdjustable,
    /// The weight is NaN or outside the limits of the term.
    OutsideLimits {
        /// Lowest accepted weight.
        low: f32,
        /// Highest accepted weight.
        high: f32,
    },
}

impl fmt::Display for WeightError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotAdjustable => f.write_str("this term does not exist or has a fixed weight"),
            Self::OutsideLimits { low, high } => {
                write!(f, "the weight must be a number from {low} to {high}")
            }
        }
    }
}

impl core::error::Error for WeightError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_was_put_in_has_limits_and_a_refusal_names_them() {
        let mut weights = Weights::empty();
        for (term, value) in [(3, 0.5), (7, 0.75)] {
            let place = weights.push(term, value, [0.25, 1.0]).unwrap();
            assert_eq!(weights.limits_at(place), Some([0.25, 1.0]));
            assert_eq!(weights.limits_at(place + 1), None);
        }
        assert!(weights.iter().eq([(3, 0.5), (7, 0.75)]));
        let refused = weights.set(3, 1.5).unwrap_err();
        let expected = "the weight must be a number from 0.25 to 1";
        assert_eq!(std::format!("{refused}"), expected);
    }
}

//! Finds observations that were copied: they repeat another one to the last digit more often than noise would.

use crate::Identified;
use crate::formats::observations::{Observation, Observations};
use crate::instrument::Kind;
use crate::noise::NoiseSource;
use crate::set_up_priors::CHANCE;
use std::collections::BTreeMap;

/// Observations of one kind that repeat others.
#[derive(Clone, Debug, PartialEq)]
pub struct Repeated {
    /// What they read.
    pub kind: Kind,
    /// Pairs of rows (by index) at the same positions that are equal to the last digit: the first one, and its copy.
    pub pairs: Vec<[usize; 2]>,
    /// Number of pairs at the same positions.
    pub of: usize,
    /// How often noise makes so many equal.
    pub probability: f64,
}

/// The finest digit (mm) that is looked for.
const DIGITS: i32 = 10;
/// A reading is a multiple of a digit if it is off by less than this part of it: binary fractions.
const ROUNDING: f64 = 1e-3;
/// Largest number of copies that a sentence names.
const NAMED: usize = 3;

/// Copied observations of each kind.
#[must_use]
pub fn repeated(observations: &Observations, identified: &Identified) -> Vec<Repeated> {
    let of_kind = |kind: Kind| {
        let rows = observations.rows.iter().enumerate();
        let rows = rows.filter(|(_, row)| observations.setups[row.setup].kind == kind);
        let rows: Vec<(usize, &Observation)> = rows.collect();
        let mut components = identified.components.iter();
        let component = components.find(|one| one.source == NoiseSource::Observations(kind))?;
        let stated = rows.iter().filter_map(|(_, row)| row.sigma);
        let noise = stated.fold(component.noise, f64::min);
        let dimension = kind.dimension();
        // Two normally distributed readings are equal to a digit q with a probability of q/(2·√π·σ).
        let digit = digit(rows.iter().flat_map(|(_, row)| row.value.iter().copied()));
        let one = digit / (2.0 * std::f64::consts::PI.sqrt() * noise);
        let chance = libm::pow(one.min(1.0), dimension as f64);
        let mut places: BTreeMap<String, Vec<usize>> = BTreeMap::new();
        for (number, row) in &rows {
            places.entry(place(row)).or_default().push(*number);
        }
        let all = places.values().flat_map(|own| own.windows(2));
        let all: Vec<[usize; 2]> = all.map(|pair| [pair[0], pair[1]]).collect();
        let is_equal =
            |[a, b]: &[usize; 2]| observations.rows[*a].value == observations.rows[*b].value;
        let pairs: Vec<[usize; 2]> = all.iter().copied().filter(is_equal).collect();
        let probability = at_least(pairs.len(), all.len(), chance);
        (!pairs.is_empty() && probability < CHANCE).then_some(Repeated {
            kind,
            pairs,
            of: all.len(),
            probability,
        })
    };
    Kind::ALL.into_iter().filter_map(of_kind).collect()
}

/// What is equal where something was read again.
fn place(row: &Observation) -> String {
    let place = (
        row.position,
        row.direction,
        row.spindle,
        row.reads,
        row.normal,
        row.time,
    );
    format!("{place:?}")
}

/// The last digit of readings (mm), as a power of ten.
fn digit(readings: impl Iterator<Item = f64> + Clone) -> f64 {
    let is_multiple = |size: &f64| {
        let mut parts = readings.clone().map(|read| read / size);
        parts.all(|part| (part - part.round()).abs() < ROUNDING)
    };
    let sizes = (0..DIGITS).map(|n| libm::pow(10.0, -f64::from(n)));
    let mut sizes = sizes.filter(is_multiple);
    sizes.next().unwrap_or(libm::pow(10.0, -f64::from(DIGITS)))
}

/// The probability of at least some successes out of so many.
fn at_least(some: usize, of: usize, chance: f64) -> f64 {
    if some == 0 || chance >= 1.0 {
        return 1.0;
    }
    let factorial = |n: usize| libm::lgamma(n as f64 + 1.0);
    let exactly = |k: usize| {
        let ways = factorial(of) - factorial(k) - factorial(of - k);
        libm::exp(ways + k as f64 * libm::log(chance) + (of - k) as f64 * libm::log1p(-chance))
    };
    (some..=of).map(exactly).sum::<f64>().min(1.0)
}

impl Repeated {
    /// A sentence about them.
    #[must_use]
    pub fn sentence(&self, observations: &Observations) -> String {
        let line = |row: usize| {
            let row = &observations.rows[row];
            format!("{} line {}", observations.files[row.file], row.line)
        };
        let copies = self.pairs.iter().take(NAMED);
        let mut copies: Vec<String> = copies
            .map(|[first, copy]| format!("{} and {}", line(*first), line(*copy)))
            .collect();
        if self.pairs.len() > NAMED {
            copies.push(format!("{} more", self.pairs.len() - NAMED));
        }
        format!(
            "{} of {} pairs of {}s at the same positions are equal to the last digit ({}), which noise gives with a probability of {:.0e}: if these rows were copied, remove them, because they make uncertainties too small",
            self.pairs.len(),
            self.of,
            self.kind.name(),
            copies.join("; "),
            self.probability.max(1e-300)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_digit_is_found_in_binary_fractions() {
        let digit = |all: &[f64]| digit(all.iter().copied());
        assert_eq!(digit(&[100.0021, 99.9, -3.0]), libm::pow(10.0, -4.0));
        assert_eq!(digit(&[2.0, 4.0]), 1.0);
        // µm with one decimal.
        assert_eq!(digit(&[1.2e-3, -0.7e-3]), libm::pow(10.0, -4.0));
    }

    #[test]
    fn probabilities_are_those_of_coins() {
        assert!((at_least(2, 3, 0.5) - 0.5).abs() < 1e-12);
        assert!((at_least(1, 10, 0.1) - (1.0 - 0.9f64.powi(10))).abs() < 1e-12);
        assert_eq!(at_least(0, 5, 0.1), 1.0);
        assert_eq!(at_least(3, 5, 1.0), 1.0);
    }
}

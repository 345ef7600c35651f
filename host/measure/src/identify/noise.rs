//! Estimates the noise, and how far each row can be trusted.

use super::root_mean_square;
use super::rows::{Problem, Weights};
use nalgebra::Vector3;

/// Initial assumption for the noise (mm): probes repeat to 1 µm.
const FIRST_NOISE: f64 = 1e-3;
/// Smallest noise (mm): files have no more digits.
const LEAST_NOISE: f64 = 1e-6;
/// Weights and noise have settled if they change by less than this fraction between rounds.
const SETTLED: f64 = 1e-3;
/// Median distance in three dimensions with a standard deviation of 1 in each.
const MEDIAN: f64 = 1.538;
/// Distance, in standard deviations of a coordinate, from which a row gets less weight; exceeded by one good row in
/// twenty.
const HUBER: f64 = 2.8;
/// Distance from which a row is reported; exceeded by one good row in 60 000.
const DISTRUSTED: f64 = 5.0;
/// After this many rounds, reported rows are excluded; otherwise they would still have a small influence and add to
/// the noise.
const HUBER_ROUNDS: usize = 4;
/// Weight of excluded rows; a weight of 0 would have no uncertainty.
const REJECTED: f64 = 1e-6;

/// Current knowledge of the noise.
pub(super) struct Noise {
    /// Standard uncertainty of a coordinate of each row, as stated (mm), or 1.
    stated: Vec<f64>,
    pub is_stated: bool,
    /// Standard deviation in units of `stated`.
    deviation: f64,
    /// Relative weight of each row: 1, or less.
    pub trust: Vec<f64>,
}

impl Noise {
    pub fn new(problem: &Problem<'_>) -> Self {
        let places = &problem.places;
        let is_stated = places.iter().all(|place| place.sigma.is_some());
        let stated = places
            .iter()
            .map(|p| p.sigma.filter(|_| is_stated).unwrap_or(1.0));
        Self {
            stated: stated.collect(),
            is_stated,
            deviation: if is_stated { 1.0 } else { FIRST_NOISE },
            trust: vec![1.0; places.len()],
        }
    }

    /// Factors for the residuals of each row (mm).
    pub fn weights(&self, least: f64) -> Weights {
        let rows = self.trust.iter().zip(&self.stated);
        let rows = rows.map(|(trust, stated)| trust / (self.deviation * stated));
        Weights {
            rows: rows.collect(),
            least,
        }
    }

    /// Distances in units of the stated uncertainty.
    fn distances(&self, misses: &[Vector3<f64>]) -> Vec<f64> {
        let rows = misses.iter().zip(&self.stated);
        rows.map(|(miss, stated)| miss.norm() / stated).collect()
    }

    /// Standard deviation of a coordinate in units of the stated uncertainty, from the median row, corrected for the
    /// share of it that remains after the fit.
    fn spread(&self, misses: &[Vector3<f64>], freedom: usize) -> f64 {
        let mut distances = self.distances(misses);
        distances.sort_by(f64::total_cmp);
        let left = (freedom as f64 / (3 * distances.len()) as f64).sqrt();
        distances[distances.len() / 2] / MEDIAN / left
    }

    /// Standard deviation of a coordinate in units of the stated uncertainty.
    pub fn factor(&self, misses: &[Vector3<f64>], freedom: usize) -> f64 {
        let counted = self.distances(misses).into_iter().zip(&self.trust);
        let squares: f64 = counted.map(|(d, trust)| (d * trust).powi(2)).sum();
        let rejected = self.trust.iter().filter(|t| **t <= REJECTED).count();
        (squares / freedom.saturating_sub(3 * rejected).max(1) as f64).sqrt()
    }

    /// The same in mm, for a row of average weight.
    pub fn left(&self, misses: &[Vector3<f64>], freedom: usize) -> f64 {
        let weights = self.stated.iter().map(|stated| stated.recip());
        self.factor(misses, freedom) / root_mean_square(weights)
    }

    pub fn trusted(&self, misses: &[Vector3<f64>], freedom: usize) -> Vec<bool> {
        let most = DISTRUSTED * self.spread(misses, freedom).max(LEAST_NOISE);
        self.distances(misses).iter().map(|d| *d <= most).collect()
    }

    /// Updates the estimate with new residuals; true if hardly anything changes.
    pub(crate) fn learn(
        &mut self,
        misses: &[Vector3<f64>],
        freedom: usize,
        robust: bool,
        round: usize,
    ) -> bool {
        let mut change: f64 = 0.0;
        let spread = self.spread(misses, freedom);
        if robust {
            let most = HUBER * spread;
            let distances = self.distances(misses);
            for (trust, distance) in self.trust.iter_mut().zip(distances) {
                let next = if round >= HUBER_ROUNDS && distance > DISTRUSTED * spread {
                    REJECTED
                } else {
                    (most / distance).sqrt().min(1.0)
                };
                change = change.max((next - *trust).abs());
                *trust = next;
            }
        }
        if !self.is_stated {
            let found = if robust && round < HUBER_ROUNDS {
                spread
            } else {
                self.factor(misses, freedom)
            };
            let next = if freedom == 0 {
                self.deviation
            } else {
                found.max(LEAST_NOISE)
            };
            change = change.max((next / self.deviation - 1.0).abs());
            self.deviation = next;
        }
        change < SETTLED && (!robust || round > HUBER_ROUNDS)
    }
}

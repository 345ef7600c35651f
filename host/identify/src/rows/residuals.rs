//! What an estimate leaves of the equations.

use super::by_row;
use super::{EquationWeights, ProbingRow, Problem};
use crate::estimate::{Estimate, RowResult};
use crate::observed::{ObservedRow, moved};
use nalgebra::{DVector, Vector3};
use trueaxis_model::errors::{ErrorModel, Switches};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::parallel;

impl Problem<'_> {
    /// The ball of each probing, and the tip position of the machine there (mm, workpiece frame).
    pub(crate) fn tips(
        &self,
        errors: &ErrorModel,
        stylus: &Vector3<f64>,
    ) -> Vec<(usize, Vector3<f64>)> {
        let kinematics = Kinematics::new(self.machine, errors);
        let own = Vector3::from(self.machine.tip);
        let tip = |place: &ProbingRow| {
            let pose = kinematics.actual(&place.q, &place.situation, &Switches::ALL);
            pose.r * (place.turned * stylus - own) + pose.t
        };
        parallel::map(&self.places, |place| (place.ball, tip(place)))
    }

    /// Vector from ball to tip in each probing (mm, workpiece frame), then the reading of each observation less the
    /// actual one (mm; the components that it lacks are 0).
    pub(crate) fn misses(&self, estimate: &Estimate) -> Vec<Vector3<f64>> {
        let mut tips = self.tips(&estimate.errors, &estimate.stylus);
        if let Some(drift) = estimate.drift_of(None) {
            for (place, (_, tip)) in self.places.iter().zip(&mut tips) {
                *tip = moved(*tip, &drift, &place.hours);
            }
        }
        let probed = tips.into_iter();
        let probed = probed.map(|(ball, tip)| tip - estimate.balls[ball]);
        let kinematics = Kinematics::new(self.machine, &estimate.errors);
        let miss = |row: &ObservedRow| row.miss(self.machine, &kinematics, estimate);
        let observed = parallel::map(&self.observed.rows, miss);
        probed.chain(observed).collect()
    }

    /// Residuals of all equations that are neither probings nor observations, in units of their standard uncertainties.
    fn others(&self, estimate: &Estimate, weights: &EquationWeights) -> Vec<f64> {
        let bars = self.bars.iter().map(|bar| {
            let [a, b] = bar.balls.map(|i| estimate.balls[i]);
            ((a - b).norm() - bar.length) / bar.sigma.max(weights.least)
        });
        let known = self.known_coordinates();
        let setups = self.observed.known.iter();
        let setups = setups.map(|(unknown, value, sigma)| {
            let (found, _) = self.observed.value(*unknown, estimate);
            (found - value) / sigma.max(weights.least)
        });
        bars.chain(
            known.map(|(i, sigma)| {
                (estimate.stylus[i] - self.stylus.tip[i]) / sigma.max(weights.least)
            }),
        )
        .chain(setups)
        .collect()
    }

    /// Residuals of all equations in units of their standard uncertainties; for probings and observations these
    /// are the inverse of `weights`.
    pub(crate) fn residuals(&self, estimate: &Estimate, weights: &EquationWeights) -> DVector<f64> {
        let misses = self.misses(estimate);
        let mut all = Vec::with_capacity(self.equations());
        for ((block, miss), w) in self.blocks().zip(&misses).zip(&weights.rows) {
            all.extend((miss * *w).iter().take(block.len()));
        }
        all.extend(self.others(estimate, weights));
        DVector::from_vec(all)
    }

    /// The line of the row with the largest distance, and that distance (mm).
    pub(crate) fn worst(&self, misses: &[Vector3<f64>]) -> (usize, f64) {
        let rows = self.places.iter().zip(misses.iter().map(Vector3::norm));
        let worst = rows.max_by(|a, b| a.1.total_cmp(&b.1));
        worst.map_or((0, 0.0), |(place, miss)| (place.line, miss))
    }

    /// Lengths (mm) that are known beforehand, each with its name and its value in an estimate: of bars, or else
    /// between nominal positions of balls, or else of the stylus.
    pub(crate) fn lengths(&self, estimate: &Estimate) -> Vec<(String, f64, f64)> {
        let one = |[a, b]: [usize; 2], known: f64| {
            let found = (estimate.balls[a] - estimate.balls[b]).norm();
            let what = format!(
                "the distance of balls {} and {}",
                self.balls[a], self.balls[b]
            );
            (what, known, found)
        };
        if !self.bars.is_empty() {
            return (self.bars.iter())
                .map(|bar| one(bar.balls, bar.length))
                .collect();
        }
        let all = 0..self.balls.len();
        let pairs = all.clone().flat_map(|a| (0..a).map(move |b| [a, b]));
        let mut lengths: Vec<(String, f64, f64)> = pairs
            .filter_map(|[a, b]| {
                let known = (self.nominal[a]? - self.nominal[b]?).norm();
                (known > 0.0).then(|| one([a, b], known))
            })
            .collect();
        if lengths.is_empty() {
            // If it cannot be identified, it has its stated value.
            let [known, found] = [self.stylus.tip, estimate.stylus].map(|tip| tip.norm());
            if known > 0.0 {
                lengths.push(("the stylus".to_owned(), known, found));
            }
        }
        lengths
    }

    /// The residuals of probings, in the order of their file, and of observations.
    pub(crate) fn rows(
        &self,
        before: &[Vector3<f64>],
        after: &[Vector3<f64>],
        trusted: &[bool],
    ) -> [Vec<RowResult>; 2] {
        let row = |i: usize| RowResult {
            before: before[i],
            after: after[i],
            is_trusted: trusted[i],
        };
        let order = by_row(&self.places);
        let observed = self.places.len()..after.len();
        [
            order.into_iter().map(row).collect(),
            observed.map(row).collect(),
        ]
    }
}

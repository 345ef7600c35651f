//! Estimates the noise of each kind of observation, and how far each row can be trusted.

use crate::factor::ScaledFactor;
use crate::instrument::Kind;
use crate::root_mean_square;
use crate::rows::{EquationWeights, Problem};
use nalgebra::{DMatrix, Vector3};
use trueaxis_model::numbers::ascending;

/// Initial assumption for the noise (mm): probes and instruments repeat to 1 µm.
const FIRST_NOISE: f64 = 1e-3;
/// Smallest noise (mm): files have no more digits.
const LEAST_NOISE: f64 = 1e-6;
/// Weights and noise have settled if they change by less than this fraction between rounds.
const SETTLED: f64 = 1e-3;
/// Median distance in one and three dimensions with a standard deviation of 1 in each.
const MEDIAN: [f64; 2] = [0.6745, 1.538];
/// Distance, in standard deviations of a coordinate, from which a row gets less weight; exceeded by one good row in
/// twenty, in one and three dimensions.
const HUBER: [f64; 2] = [1.96, 2.8];
/// Distance from which a row is reported; exceeded by one good row in 60 000, in one and three dimensions.
const DISTRUSTED: [f64; 2] = [4.3, 5.0];
/// After this many rounds, reported rows are excluded; otherwise they would still have a small influence and add to
/// the noise.
const HUBER_ROUNDS: usize = 4;
/// With fewer degrees of freedom, the residuals of a source say nothing about its noise.
const LEAST_FREEDOM: f64 = 0.5;
/// Weight of excluded rows; a weight of 0 would have no uncertainty.
const REJECTED: f64 = 1e-6;

/// What was measured in one way, so that one factor applies to its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum NoiseSource {
    /// Probings of balls.
    Probings,
    /// Observations of one kind.
    Observations(Kind),
}

impl NoiseSource {
    /// Name in the plural.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Probings => "probings",
            Self::Observations(Kind::Length) => "lengths",
            Self::Observations(Kind::Point) => "points",
            Self::Observations(Kind::Displacement) => "displacements",
            Self::Observations(Kind::Angle) => "angles",
            Self::Observations(Kind::Surface) => "surfaces",
        }
    }

    /// Unit of its noise: µm, or µrad for angles.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::Probings => "µm",
            Self::Observations(kind) => kind.unit(),
        }
    }
}

/// The noise of one source: a variance component.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VarianceComponent {
    /// What.
    pub source: NoiseSource,
    /// Number of rows.
    pub rows: usize,
    /// Standard deviation of a coordinate of an average row, from the residuals (mm; angles over
    /// [`LEVER`](crate::instrument::LEVER)).
    pub noise: f64,
    /// Like `noise`, in units of the stated uncertainty of each row, if all rows of the source state it; then the stated
    /// values are used, unless the residuals refute them.
    pub of_stated: Option<f64>,
    /// True if the residuals of most rows exceed the stated uncertainty, beyond chance: it is too small, or the machine
    /// has errors that the model lacks. Uncertainties then rest on the residuals, if there is no other source.
    pub is_refuted: bool,
    /// Share of the degrees of freedom.
    pub freedom: f64,
    /// The noise (mm, or in units of the stated uncertainty) of the median row, which wrong rows hardly change; `None`
    /// if there are too few degrees of freedom.
    pub(crate) typical: Option<f64>,
}

impl VarianceComponent {
    /// True if chance gives a factor as far from 1 less than once in a thousand.
    #[must_use]
    pub fn is_misstated(&self) -> bool {
        self.of_stated
            .is_some_and(|factor| deviations(factor, self.freedom).abs() > CHANCE)
    }
}

/// Less than once in a thousand: standard deviations of a normal distribution, two-sided.
const CHANCE: f64 = 3.29;
/// Degrees of freedom below which the logarithm of a standard deviation is not normally distributed.
const LEAST_TO_JUDGE: f64 = 3.0;
/// Efficiency of the standard deviation from a median, for a normal distribution: 1/n of it varies as much as 0.37/n of
/// that from the mean square.
const OF_MEDIAN: f64 = 0.37;

/// How far a ratio of standard deviations is above 1, in standard deviations of chance (Wilson and Hilferty: the cube
/// root of χ² over its degrees of freedom is normally distributed).
fn deviations(factor: f64, freedom: f64) -> f64 {
    if freedom < LEAST_TO_JUDGE || !factor.is_finite() {
        return 0.0;
    }
    let part = 2.0 / (9.0 * freedom);
    (libm::pow(factor, 2.0 / 3.0) - (1.0 - part)) / part.sqrt()
}

/// True if residuals are larger than stated, beyond chance: in the mean square (`factor`), and those of most rows
/// (`spread`, of the median row), not those of a few wrong ones.
fn refute(factor: f64, spread: f64, freedom: f64) -> bool {
    deviations(factor, freedom) > CHANCE && deviations(spread, OF_MEDIAN * freedom) > CHANCE
}

/// The rows of one source.
struct SourceRows {
    source: NoiseSource,
    /// Rows among those of [`EquationWeights::rows`].
    rows: Vec<usize>,
    /// 0 in one dimension, 1 in three: index of the constants above.
    dimension: usize,
    is_stated: bool,
    /// Standard deviation in units of the stated uncertainty.
    deviation: f64,
}

/// Current knowledge of the noise.
pub(crate) struct Noise {
    /// Standard uncertainty of a coordinate of each row, as stated (mm), or 1.
    stated: Vec<f64>,
    /// The sources, probings first.
    parts: Vec<SourceRows>,
    /// Relative weight of each row: 1, or less.
    pub trust: Vec<f64>,
}

/// The source of noise of each probing, then of each observation.
pub(crate) fn sources(problem: &Problem<'_>) -> impl Iterator<Item = NoiseSource> {
    let probed = problem.places.iter().map(|_| NoiseSource::Probings);
    let observed = problem.observed.rows.iter();
    probed.chain(observed.map(|row| NoiseSource::Observations(row.kind)))
}

impl Noise {
    pub fn new(problem: &Problem<'_>) -> Self {
        let sigmas: Vec<Option<f64>> = (problem.places.iter().map(|row| row.sigma))
            .chain(problem.observed.rows.iter().map(|row| row.sigma))
            .collect();
        let count = problem.places.len();
        let mut stated = vec![1.0; sigmas.len()];
        let sources: Vec<NoiseSource> = sources(problem).collect();
        let mut names = sources.clone();
        names.sort_unstable();
        names.dedup();
        let parts = names.into_iter().map(|source| {
            let rows: Vec<usize> = (0..sources.len())
                .filter(|i| sources[*i] == source)
                .collect();
            let is_stated = rows.iter().all(|i| sigmas[*i].is_some());
            for i in &rows {
                stated[*i] = sigmas[*i].filter(|_| is_stated).unwrap_or(1.0);
            }
            let dimension = match rows[0].checked_sub(count) {
                None => 3,
                Some(i) => problem.observed.rows[i].kind.dimension(),
            };
            SourceRows {
                source,
                rows,
                dimension: usize::from(dimension == 3),
                is_stated,
                deviation: if is_stated { 1.0 } else { FIRST_NOISE },
            }
        });
        let parts = parts.collect();
        Self {
            trust: vec![1.0; stated.len()],
            stated,
            parts,
        }
    }

    /// Factors for the residuals of each row (mm).
    pub fn weights(&self, least: f64) -> EquationWeights {
        let mut rows = vec![0.0; self.stated.len()];
        for part in &self.parts {
            for i in &part.rows {
                rows[*i] = self.trust[*i] / (part.deviation * self.stated[*i]);
            }
        }
        EquationWeights { rows, least }
    }

    /// Degrees of freedom of each source: its equations in excess of the unknowns that they determine. Together with
    /// bars and other knowledge these are `freedom`. `None` if the factor is singular.
    pub fn shares(
        &self,
        problem: &Problem<'_>,
        jacobian: &DMatrix<f64>,
        factor: &ScaledFactor,
    ) -> Option<Vec<f64>> {
        let freedom = (problem.equations() - factor.unknowns().len()) as f64;
        if let [_] = self.parts[..] {
            return Some(vec![freedom]);
        }
        let leverages = factor.leverages(jacobian)?;
        let blocks: Vec<_> = problem.blocks().collect();
        let share = |part: &SourceRows| {
            let equations = part.rows.iter().flat_map(|i| blocks[*i].clone());
            equations.map(|i| 1.0 - leverages[i]).sum::<f64>()
        };
        Some(self.parts.iter().map(share).collect())
    }

    /// True if shares matter before the noise has been found.
    pub fn needs_shares(&self) -> bool {
        self.parts.iter().any(|part| !part.is_stated)
    }

    /// What each row says (mm) in units of the stated uncertainty.
    fn distances<'s>(
        &'s self,
        part: &'s SourceRows,
        misses: &'s [Vector3<f64>],
    ) -> impl Iterator<Item = f64> + 's {
        (part.rows.iter()).map(|i| misses[*i].norm() / self.stated[*i])
    }

    /// Standard deviation of a coordinate in units of the stated uncertainty, from the median row, corrected for the
    /// share of it that remains after the fit. Infinite if nothing is known about it, so that all rows are trusted.
    fn spread(&self, part: &SourceRows, misses: &[Vector3<f64>], freedom: f64) -> f64 {
        if freedom < LEAST_FREEDOM {
            return f64::INFINITY;
        }
        let mut distances: Vec<f64> = self.distances(part, misses).collect();
        ascending(&mut distances);
        let dimension = [1, 3][part.dimension];
        let left = (freedom / (dimension * distances.len()) as f64).sqrt();
        distances[distances.len() / 2] / MEDIAN[part.dimension] / left
    }

    /// Standard deviation of a coordinate in units of the stated uncertainty.
    fn factor(&self, part: &SourceRows, misses: &[Vector3<f64>], freedom: f64) -> f64 {
        let trust = || part.rows.iter().map(|i| self.trust[*i]);
        let counted = self.distances(part, misses).zip(trust());
        let squares: f64 = counted.map(|(d, trust)| (d * trust).powi(2)).sum();
        let rejected = trust().filter(|t| *t <= REJECTED).count();
        let rejected = ([1, 3][part.dimension] * rejected) as f64;
        // With less than one degree of freedom, nothing is known.
        (squares / (freedom - rejected).max(1.0)).sqrt()
    }

    /// The noise of each source.
    pub fn components(&self, misses: &[Vector3<f64>], shares: &[f64]) -> Vec<VarianceComponent> {
        let of = |(part, freedom): (&SourceRows, &f64)| {
            let factor = self.factor(part, misses, *freedom);
            let weights: Vec<f64> = part.rows.iter().map(|i| self.stated[*i].recip()).collect();
            VarianceComponent {
                source: part.source,
                rows: part.rows.len(),
                noise: factor / root_mean_square(weights.into_iter()),
                of_stated: part.is_stated.then_some(factor),
                is_refuted: part.is_stated
                    && (part.deviation > 1.0
                        || refute(factor, self.spread(part, misses, *freedom), *freedom)),
                freedom: *freedom,
                typical: Some(self.spread(part, misses, *freedom)).filter(|s| s.is_finite()),
            }
        };
        self.parts.iter().zip(shares).map(of).collect()
    }

    /// Which rows do not fit so badly that they should be checked.
    pub fn trusted(&self, misses: &[Vector3<f64>], shares: &[f64]) -> Vec<bool> {
        let mut trusted = vec![true; self.stated.len()];
        for (part, freedom) in self.parts.iter().zip(shares) {
            let spread = self.spread(part, misses, *freedom).max(LEAST_NOISE);
            let most = DISTRUSTED[part.dimension] * spread;
            for (i, distance) in part.rows.iter().zip(self.distances(part, misses)) {
                trusted[*i] = distance <= most;
            }
        }
        trusted
    }

    /// Updates the estimate with new residuals; true if hardly anything changes.
    pub(crate) fn learn(
        &mut self,
        misses: &[Vector3<f64>],
        shares: &[f64],
        robust: bool,
        round: usize,
    ) -> bool {
        let mut change: f64 = 0.0;
        let mut trust = self.trust.clone();
        let spreads: Vec<f64> = (self.parts.iter().zip(shares))
            .map(|(part, freedom)| self.spread(part, misses, *freedom))
            .collect();
        if robust {
            for (part, spread) in self.parts.iter().zip(&spreads) {
                let [most, distrusted] =
                    [HUBER, DISTRUSTED].map(|limit| limit[part.dimension] * spread);
                for (i, distance) in part.rows.iter().zip(self.distances(part, misses)) {
                    let next = if round >= HUBER_ROUNDS && distance > distrusted {
                        REJECTED
                    } else {
                        (most / distance).sqrt().min(1.0)
                    };
                    change = change.max((next - trust[*i]).abs());
                    trust[*i] = next;
                }
            }
        }
        self.trust = trust;
        let is_one_of_several = self.parts.len() > 1;
        let next: Vec<f64> = (self.parts.iter().zip(shares).zip(spreads))
            .map(|((part, freedom), spread)| {
                // Less weight for one of several sources would hide the slip of its instrument from the search for
                // mistakes.
                if *freedom < LEAST_FREEDOM || part.is_stated && is_one_of_several {
                    return part.deviation;
                }
                let factor = self.factor(part, misses, *freedom);
                if part.is_stated {
                    // Once refuted it stays so, or rounds might alternate.
                    let is_refuted = part.deviation > 1.0 || refute(factor, spread, *freedom);
                    return if is_refuted { factor.max(1.0) } else { 1.0 };
                }
                let found = match robust && round < HUBER_ROUNDS {
                    true => spread,
                    false => factor,
                };
                found.max(LEAST_NOISE)
            })
            .collect();
        for (part, next) in self.parts.iter_mut().zip(next) {
            change = change.max((next / part.deviation - 1.0).abs());
            part.deviation = next;
        }
        change < SETTLED && (!robust || round > HUBER_ROUNDS)
    }
}

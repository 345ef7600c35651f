//! Finds rows, balls, set-ups, indexed positions and styli that do not fit the others: data snooping as in geodesy (Baarda),
//! one outlier at a time, each with the hypothesis that explains it.

mod groups;
mod reading;
mod sentence;

use crate::Unknown;
use crate::gram::scaled;
use crate::identified::Identified;
use crate::noise::{NoiseSource, sources};
use crate::rows::{EquationWeights, Problem};
use groups::{DisplacementGroup, groups};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
pub use reading::Misread;
use reading::OTHER_SIGN;
use std::ops::Range;

/// An outlier deviation from the file.
#[derive(Clone, Debug, PartialEq)]
pub enum OutlierKind {
    /// One probing or observation.
    Row,
    /// A set-up of an instrument that has moved or slipped.
    Setup(String),
    /// A set-up whose readings are in another unit, or count the other way.
    Reading(String, Misread),
    /// A ball that has moved.
    Ball(String),
    /// A stylus that was bent or changed.
    Stylus,
    /// A position (deg) at which this rotary axis was not where it reported.
    Index(char, f64),
    /// A reported angle (deg) at which the spindle was not.
    Spindle(f64),
}

/// An outlier, and the displacement with which it would fit the others.
#[derive(Clone, Debug, PartialEq)]
pub struct Outlier {
    /// The kind.
    pub kind: OutlierKind,
    /// The probings concerned, by index in their file.
    pub rows: Vec<usize>,
    /// The observations concerned, by index.
    pub observations: Vec<usize>,
    /// Displacement (mm): of the tip from the ball in the workpiece frame, or of the stylus in the spindle frame.
    /// For an indexed position, the angle about its axis (rad) in the first component; for an observation or a
    /// set-up, how much too large the reading is (mm; angles over [`LEVER`](crate::instrument::LEVER)); for readings in
    /// another unit, how many times itself each is too large.
    pub off: Vector3<f64>,
    /// Standard uncertainty of its length (mm or rad).
    pub uncertainty: f64,
    /// Another ball that the row would fit, if any.
    pub other_ball: Option<String>,
}

/// Hypotheses are accepted beyond this many standard deviations of a normal distribution: one wrong one in ten
/// million. A thousand good files with ten thousand hypotheses each give one false alarm.
const CRITICAL: f64 = 5.2;
/// A hypothesis about a group must explain this fraction of the residuals (sums of squares) of the same sources of
/// noise. A model that lacks something also makes groups significant, but they explain little.
const EXPLAINS: f64 = 0.5;
/// The fraction of a hypothesis' effect that the unknowns must not be able to absorb.
const TESTABLE: f64 = 1e-3;
/// Like `TESTABLE`, of readings of an instrument: a small stated uncertainty makes the unknowns follow them, and what is left is in
/// the residuals of everything else.
const TESTABLE_READINGS: f64 = 1e-5;
/// A row belongs to another ball if it fits it this well (mm).
const OTHER_BALL: f64 = 1.0;
/// Largest fraction of the rows that count as outliers one by one; more are not exceptions.
const MOST: f64 = 0.2;
/// Rotary positions (deg) that differ by less are equal.
const SAME: f64 = 1e-3;
/// Smallest noise of a source: in units of what it states, and in mm.
const LEAST_FACTOR: f64 = 0.1;
const LEAST_NOISE: f64 = 1e-6;

/// Finds what does not fit the others.
///
/// A row is tested by the F-test of its three coordinates (the counterpart of the w-test of one), a group by that of
/// its unknowns. The hypothesis with the largest likelihood, penalized by its number of unknowns (Schwarz), is
/// accepted; then the next one is searched.
#[must_use]
pub fn snoop(problem: &Problem<'_>, identified: &Identified) -> Vec<Outlier> {
    let mut adjusted = Adjusted::new(problem, identified);
    let groups = groups(problem, &adjusted.stylus);
    let mut found = Vec::new();
    let most = (problem.commands().count() as f64 * MOST).ceil() as usize;
    while found.len() < most {
        let Some(best) = adjusted.best(problem, &groups) else {
            break;
        };
        adjusted.take(problem, &best, &groups);
        // Everything was fitted to those readings.
        let is_misread = matches!(best.kind, OutlierKind::Reading(..));
        found.push(best.outlier(problem, identified));
        if is_misread {
            return found;
        }
    }
    // A single wrong position of a rotary axis explains little of the noise of many rows. Errors that the model lacks make
    // several positions significant; a wrong position leaves nothing behind once it is left out.
    let positions: Vec<DisplacementGroup> = (groups.into_iter())
        .filter(|group| matches!(group.kind, OutlierKind::Index(..)))
        .collect();
    if found.len() < most
        && let Some(best) = adjusted.best_group(&positions, 0.0)
    {
        adjusted.take(problem, &best, &positions);
        if adjusted.best_group(&positions, 0.0).is_none() {
            found.push(best.outlier(problem, identified));
        }
    }
    found
}

/// The hypothesis that explains most.
struct BestHypothesis {
    kind: OutlierKind,
    places: Vec<usize>,
    change: DVector<f64>,
    uncertainty: f64,
    gain: f64,
}

impl BestHypothesis {
    fn outlier(self, problem: &Problem<'_>, identified: &Identified) -> Outlier {
        let off = Vector3::from_fn(|k, _| self.change.get(k).copied().unwrap_or(0.0));
        let probed = problem.places.len();
        let rows = self.places.iter().filter_map(|i| problem.places.get(*i));
        let mut rows: Vec<usize> = rows.map(|place| place.row).collect();
        rows.sort_unstable();
        let observations = self.places.iter().filter_map(|i| i.checked_sub(probed));
        let mut observations: Vec<usize> = observations.collect();
        observations.sort_unstable();
        let other_ball = match (&self.kind, &self.places[..]) {
            (OutlierKind::Row, [place]) if *place < probed => {
                let own = problem.places[*place].ball;
                let tip = identified.balls[own] + off;
                let mut others = identified.balls.iter().zip(&problem.balls).enumerate();
                let other =
                    others.find(|(i, (ball, _))| *i != own && (tip - *ball).norm() < OTHER_BALL);
                other.map(|(_, (_, name))| name.clone())
            }
            _ => None,
        };
        Outlier {
            kind: self.kind,
            rows,
            observations,
            off,
            uncertainty: self.uncertainty,
            other_ball,
        }
    }
}

/// The one of two hypotheses that explains more.
fn better(best: Option<BestHypothesis>, next: BestHypothesis) -> Option<BestHypothesis> {
    match best {
        Some(best) if best.gain >= next.gain => Some(best),
        _ => Some(next),
    }
}

/// An adjustment and its residuals.
struct Adjusted {
    /// Orthonormal columns: the space that the unknowns can absorb.
    basis: DMatrix<f64>,
    /// Residuals in units of stated standard uncertainties (or mm).
    left: DVector<f64>,
    freedom: usize,
    /// Inverse standard uncertainty of each place (1/mm).
    weights: Vec<f64>,
    /// The equations of each place.
    blocks: Vec<Range<usize>>,
    /// The source of noise of each place.
    sources: Vec<NoiseSource>,
    /// Derivative of the tip by the stylus in each place.
    stylus: Vec<Matrix3<f64>>,
    equations: usize,
}

impl Adjusted {
    /// With all rows weighted as stated, without robust weights.
    fn new(problem: &Problem<'_>, identified: &Identified) -> Self {
        let rows = stated(problem, identified);
        let weights = EquationWeights {
            rows,
            least: identified.place.weights.least,
        };
        let estimate = &identified.place.estimate;
        let unknowns = identified.place.factor.unknowns();
        let unknowns: Vec<Unknown> = unknowns.iter().map(|i| problem.unknowns[*i]).collect();
        // Columns of very different lengths would be taken for dependent.
        let (jacobian, _) = scaled(problem.derivatives(&unknowns, estimate, &weights));
        let basis = jacobian.qr().q();
        let residuals = problem.residuals(estimate, &weights);
        let left = &residuals - &basis * basis.tr_mul(&residuals);
        let unit = EquationWeights {
            least: weights.least,
            ..problem.unweighted(0.0)
        };
        let stylus = problem.derivatives(&[0, 1, 2].map(Unknown::Stylus), estimate, &unit);
        let stylus = (0..problem.places.len()).map(|i| stylus.fixed_view::<3, 3>(3 * i, 0).into());
        Self {
            freedom: left.len().saturating_sub(basis.ncols()),
            equations: left.len(),
            basis,
            left,
            weights: weights.rows,
            blocks: problem.blocks().collect(),
            sources: sources(problem).collect(),
            stylus: stylus.collect(),
        }
    }

    /// The hypothesis that explains most, if it is significant.
    fn best(&self, problem: &Problem<'_>, groups: &[DisplacementGroup]) -> Option<BestHypothesis> {
        let mut best: Option<BestHypothesis> = None;
        for place in 0..self.blocks.len() {
            let effect = self.of_row(problem, place);
            let mut sums = HypothesisSums::new(self, effect.ncols());
            sums.add(self, place, &effect);
            if let Some(tested) = sums.tested(self, None, TESTABLE) {
                best = better(best, tested.about(OutlierKind::Row, &[place]));
            }
        }
        match self.best_group(groups, EXPLAINS) {
            Some(group) => better(best, group),
            None => best,
        }
    }

    /// The best hypothesis about groups that explains this fraction of the residuals of their sources.
    fn best_group(&self, groups: &[DisplacementGroup], explains: f64) -> Option<BestHypothesis> {
        let mut best: Option<BestHypothesis> = None;
        for group in groups {
            let least = explains * self.squares(&group.places);
            let mut sums = HypothesisSums::new(self, group.effects[0].ncols());
            for (k, place) in group.places.iter().enumerate().rev() {
                sums.add(self, *place, &group.effects[k]);
                // A single row is tested as a row, and all rows of a ball or stylus are just its position.
                let is_hypothesis = match group.is_from {
                    true => k > 0 && group.places.len() - k > 1,
                    false => k == 0,
                };
                if !is_hypothesis {
                    continue;
                }
                let testable = match group.kind {
                    OutlierKind::Reading(..) => TESTABLE_READINGS,
                    _ => TESTABLE,
                };
                let Some(tested) = sums.tested(self, Some(least), testable) else {
                    continue;
                };
                let kind = match (&group.kind, self.sources[*place]) {
                    (OutlierKind::Reading(name, _), NoiseSource::Observations(kind)) => {
                        let factor = 1.0 - tested.change[0];
                        match Misread::of(kind, factor, tested.uncertainty) {
                            Some(one) => OutlierKind::Reading(name.clone(), one),
                            None => continue,
                        }
                    }
                    (kind, _) => kind.clone(),
                };
                best = better(best, tested.about(kind, &group.places[k..]));
            }
        }
        best
    }

    /// Sum of the squared residuals of all that has the same sources of noise as some places.
    fn squares(&self, places: &[usize]) -> f64 {
        let mut own: Vec<NoiseSource> = places.iter().map(|i| self.sources[*i]).collect();
        own.sort_unstable();
        own.dedup();
        let is_own = |source: &NoiseSource| own.contains(source);
        if self.sources.iter().all(is_own) {
            return self.left.norm_squared();
        }
        let blocks = self.blocks.iter().zip(&self.sources);
        let blocks = blocks.filter(|(_, source)| is_own(source));
        blocks
            .map(|(block, _)| self.left.rows_range(block.clone()).norm_squared())
            .sum()
    }

    /// The effect of a wrong row on its residual: a displacement of the tip, or a reading that is too large.
    fn of_row(&self, problem: &Problem<'_>, place: usize) -> DMatrix<f64> {
        let size = self.blocks[place].len();
        let effect = DMatrix::identity(size, size);
        match place < problem.places.len() {
            true => effect,
            false => -effect,
        }
    }

    /// The columns of a hypothesis, in units of standard uncertainties.
    fn columns(
        &self,
        problem: &Problem<'_>,
        best: &BestHypothesis,
        groups: &[DisplacementGroup],
    ) -> DMatrix<f64> {
        let mut columns = DMatrix::zeros(self.left.len(), best.change.len());
        let group = (groups.iter()).find(|group| match (&group.kind, &best.kind) {
            (OutlierKind::Reading(a, _), OutlierKind::Reading(b, _)) => a == b,
            (a, b) => a == b,
        });
        for place in &best.places {
            let effect = group.and_then(|group| {
                let k = group.places.iter().position(|p| p == place)?;
                Some(group.effects[k].clone())
            });
            let effect = effect.unwrap_or_else(|| self.of_row(problem, *place));
            let block = self.blocks[*place].clone();
            columns
                .rows_range_mut(block)
                .copy_from(&(effect * self.weights[*place]));
        }
        columns
    }

    /// Accepts a hypothesis.
    fn take(&mut self, problem: &Problem<'_>, best: &BestHypothesis, groups: &[DisplacementGroup]) {
        let mut columns = self.columns(problem, best, groups);
        columns -= &self.basis * self.basis.tr_mul(&columns);
        // Twice is enough: the first pass leaves rounding.
        columns -= &self.basis * self.basis.tr_mul(&columns);
        let new = columns.qr().q();
        self.left -= &new * new.tr_mul(&self.left);
        self.freedom = self.freedom.saturating_sub(new.ncols());
        let (old, count) = (self.basis.ncols(), new.ncols());
        let basis = std::mem::replace(&mut self.basis, DMatrix::zeros(0, 0));
        self.basis = basis.insert_columns(old, count, 0.0);
        self.basis.columns_mut(old, count).copy_from(&new);
    }
}

/// The sums that a test of a hypothesis needs, over its places.
struct HypothesisSums {
    /// The columns in the basis, the products of the columns with each other, and with the residuals.
    in_basis: DMatrix<f64>,
    normal: DMatrix<f64>,
    gradient: DVector<f64>,
}

/// A significant hypothesis.
struct Tested {
    change: DVector<f64>,
    uncertainty: f64,
    /// Logarithm of its likelihood, minus the penalty for its unknowns.
    gain: f64,
}

impl Tested {
    fn about(self, kind: OutlierKind, places: &[usize]) -> BestHypothesis {
        BestHypothesis {
            kind,
            places: places.to_vec(),
            change: self.change,
            uncertainty: self.uncertainty,
            gain: self.gain,
        }
    }
}

impl HypothesisSums {
    fn new(adjusted: &Adjusted, count: usize) -> Self {
        Self {
            in_basis: DMatrix::zeros(adjusted.basis.ncols(), count),
            normal: DMatrix::zeros(count, count),
            gradient: DVector::zeros(count),
        }
    }

    fn add(&mut self, adjusted: &Adjusted, place: usize, effect: &DMatrix<f64>) {
        let effect = effect * adjusted.weights[place];
        let block = adjusted.blocks[place].clone();
        self.in_basis += adjusted.basis.rows_range(block.clone()).tr_mul(&effect);
        self.normal += effect.tr_mul(&effect);
        self.gradient += effect.tr_mul(&adjusted.left.rows_range(block));
    }

    /// For a group, `least` is the sum of squares that it must explain. `testable` is the part of it that the unknowns must
    /// not absorb.
    fn tested(&self, adjusted: &Adjusted, least: Option<f64>, testable: f64) -> Option<Tested> {
        let count = self.gradient.len();
        if adjusted.freedom <= count {
            return None;
        }
        let free = &self.normal - self.in_basis.tr_mul(&self.in_basis);
        // The part that the unknowns absorb cannot be tested.
        let whole = self.normal.trace() / count as f64;
        let smallest = free.symmetric_eigenvalues().min();
        if smallest.is_nan() || smallest < testable * whole {
            return None;
        }
        let inverse = free.try_inverse()?;
        let change = &inverse * &self.gradient;
        let explained = change.dot(&self.gradient);
        let all = adjusted.left.norm_squared();
        let rest = (all - explained).max(f64::MIN_POSITIVE);
        let freedom = adjusted.freedom - count;
        let ratio = explained / count as f64 / (rest / freedom as f64);
        let is_explained = least.is_none_or(|least| explained > least);
        if !is_explained || deviations(ratio, count, freedom) < CRITICAL {
            return None;
        }
        let equations = adjusted.equations as f64;
        let unit = &change / change.norm();
        Some(Tested {
            uncertainty: ((unit.transpose() * &inverse * &unit)[0] * rest / freedom as f64).sqrt(),
            gain: 0.5 * freedom as f64 * libm::log(all / rest)
                - 0.5 * count as f64 * libm::log(equations),
            change,
        })
    }
}

/// The number of standard deviations of a normal distribution that are as unlikely as this F (Paulson).
pub fn deviations(f: f64, count: usize, freedom: usize) -> f64 {
    let [one, other] = [count, freedom].map(|n| 2.0 / (9.0 * n as f64));
    let root = libm::cbrt(f);
    ((1.0 - other) * root - (1.0 - one)) / (other * root * root + one).sqrt()
}

/// The inverse standard uncertainty of each probing and observation (1/mm): as stated, or else from the residuals.
/// With several sources of noise, each has that of its median row, so that a wrong row does not hide among the others
/// of its source.
fn stated(problem: &Problem<'_>, identified: &Identified) -> Vec<f64> {
    let is_alone = identified.components.len() == 1;
    let weight = |source: NoiseSource, sigma: Option<f64>| {
        let mut components = identified.components.iter();
        let sigma = components.find(|c| c.source == source).map(|component| {
            match (sigma, component.of_stated) {
                (Some(sigma), Some(_)) if is_alone => sigma,
                (Some(sigma), Some(_)) => {
                    sigma * component.typical.unwrap_or(1.0).max(LEAST_FACTOR)
                }
                _ if is_alone => component.noise,
                _ => component
                    .typical
                    .unwrap_or(component.noise)
                    .max(LEAST_NOISE),
            }
        });
        sigma.unwrap_or(identified.noise).recip()
    };
    let probed = problem.places.iter().map(|row| row.sigma);
    let sigmas = probed.chain(problem.observed.rows.iter().map(|row| row.sigma));
    let rows = sources(problem).zip(sigmas);
    rows.map(|(source, sigma)| weight(source, sigma)).collect()
}

impl Outlier {
    /// True if it concerns more than one row.
    #[must_use]
    pub fn is_group(&self) -> bool {
        self.kind != OutlierKind::Row
    }
}

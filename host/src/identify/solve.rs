//! Gauss–Newton with the rank from the noise.

use super::Unknown;
use super::factor::Factor;
use super::rows::{Estimate, Problem, Weights};
use super::unseen::{GivenUp, Unseen, given_up};
use crate::errors::{ErrorModel, Parameter};
use nalgebra::{DMatrix, DVector, Vector3};

/// How to identify.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Options {
    /// Rows that fit badly count less (Huber).
    pub robust: bool,
}

/// Why nothing could be identified.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IdentifyError {
    /// Too little was probed.
    #[error(
        "{equations} equations, three of each probing, for {unknowns} unknowns: {parameters} parameters, stylus and balls"
    )]
    TooFew {
        /// How many equations there are.
        equations: usize,
        /// How many unknowns.
        unknowns: usize,
        /// How many of these are error parameters.
        parameters: usize,
    },
    /// The iteration does not come to an end.
    #[error("the probings fit no machine of this model: {rms:.3} mm are left on average")]
    NotConverged {
        /// Root of the mean square of the distance from tip to ball (mm).
        rms: f64,
    },
    /// No parameter stands out of what the rows miss.
    #[error(
        "no parameter can be told from these probings: they miss by {rms:.3} mm on average, that of line {line} by {worst:.3} mm"
    )]
    NothingSeen {
        /// Root of the mean square of the distance from tip to ball (mm).
        rms: f64,
        /// Line of the row that misses most.
        line: usize,
        /// By how much (mm).
        worst: f64,
    },
}

/// A parameter with its standard uncertainty (mm, rad, per mmᵏ or radᵏ).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimated {
    /// Which.
    pub parameter: Parameter,
    /// Its value.
    pub value: f64,
    /// Its standard uncertainty.
    pub uncertainty: f64,
}

/// What a row of probings says in the end: from the ball to the tip (mm, workpiece frame).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// With the nominal machine, and balls and stylus fitted to that.
    pub before: Vector3<f64>,
    /// With the machine as identified.
    pub after: Vector3<f64>,
    /// False if it fits so badly that it should be looked at.
    pub is_trusted: bool,
}

/// What was identified.
#[derive(Clone, Debug)]
pub struct Identified {
    /// The parameters that can be seen, in the order of the model.
    pub parameters: Vec<Estimated>,
    /// Their covariance, in this order.
    pub covariance: DMatrix<f64>,
    /// What cannot be seen.
    pub unseen: Vec<Unseen>,
    /// The machine with these parameters.
    pub errors: ErrorModel,
    /// Where the balls are (mm, workpiece frame).
    pub balls: Vec<Vector3<f64>>,
    /// Where the stylus tip is (mm, spindle frame).
    pub stylus: Vector3<f64>,
    /// Standard deviation of one coordinate of a probing, from what is left (mm).
    pub noise: f64,
    /// The same in what the file states for each row, if it states it for all; what is stated counts then.
    pub of_stated: Option<f64>,
    /// Equations beyond those that it takes.
    pub freedom: usize,
    /// Condition number of the Jacobian, with columns of one length, of what is seen.
    pub condition: f64,
    /// Every probing, in the order of the file.
    pub rows: Vec<Row>,
}

/// Largest change of any residual (mm) by the last step: three orders below the 0.001 µm that are asked for,
/// two above the rounding of positions of 1 m.
const STEP: f64 = 1e-9;
/// Steps with one Jacobian: each gains the relative size of the errors, 1e-2 or better, less where parameters
/// are hardly told apart. A step must be this part of the last one, or it takes another Jacobian; if it makes
/// things worse, half of it is tried, and so on.
const STEPS: usize = 20;
const SHRINKS: f64 = 0.5;
const HALVINGS: usize = 20;
/// Nor do steps count that make the sum of squares less by so small a part: of a thousand rows, they move no
/// parameter by more than a twentieth of its uncertainty.
const STILL: f64 = 1e-6;
/// Rounds, each with a Jacobian: the first has that of the nominal machine, the second knows the noise. More
/// are made only as long as what is seen changes, or what is trusted.
const ROUNDS: usize = 20;
/// From this round on what was not seen before is not seen: on the limit, the choice could go round in circles.
const FREE: usize = 4;
/// Weights and noise that change less than this part from round to round stay.
const SETTLED: f64 = 1e-3;
/// A combination is not seen if its standard uncertainty is more than this many times what all errors
/// together do at the probings: single coefficients, which make up for each other, are larger than what they
/// do together, but not by so much.
const PLAUSIBLE: f64 = 5.0;
/// Nor is it seen if its singular value is not above this many times what the rows miss, by how far they
/// are apart: by so much the derivatives themselves are uncertain. A common scale of all axes would else be
/// seen, for it makes all misses smaller: none is left if everything is in one point.
const VAGUE: f64 = 3.0;
/// Singular values that are no more than rounding: of columns of length 1, and positions with nine digits.
const ROUNDING: f64 = 1e-10;
/// Bars and stylus are known no better than this part of what the rows miss: a hundredth, of which second-order
/// effects are a part again.
pub(super) const STIFF: f64 = 0.01;
/// Where nothing is known of the noise yet (mm): probes repeat to 1 µm.
const FIRST_NOISE: f64 = 1e-3;
/// Noise is never less (mm): files have no more digits.
const LEAST_NOISE: f64 = 1e-6;
/// Distances, in standard deviations of a coordinate, from which a row counts less: one good row of twenty
/// has more; and from which it is named: one of 60 000.
const HUBER: f64 = 2.8;
/// After so many rounds what is named no longer counts: it would go on to pull a little, and add to the noise.
const HUBER_ROUNDS: usize = 4;
const REJECTED: f64 = 1e-6;
const DISTRUSTED: f64 = 5.0;
/// Median distance in three dimensions with a standard deviation of 1 in each.
const MEDIAN: f64 = 1.538;

/// Identifies what a problem looks for.
///
/// # Errors
/// [`IdentifyError`]: fewer equations than unknowns, or no convergence.
pub fn identify(problem: &Problem<'_>, options: Options) -> Result<Identified, IdentifyError> {
    let unknowns = &problem.unknowns;
    let equations = problem.equations();
    let is_parameter = |i: &usize| matches!(unknowns[*i], Unknown::Parameter(_));
    let parameters = (0..unknowns.len()).filter(is_parameter).count();
    // One equation more, or nothing would be known of the noise.
    if equations <= unknowns.len() {
        return Err(IdentifyError::TooFew {
            equations,
            unknowns: unknowns.len(),
            parameters,
        });
    }
    let mut noise = Noise::new(problem);
    let mut estimate = problem.start();
    let setup: Vec<usize> = (parameters..unknowns.len()).collect();
    setup_alone(
        problem,
        &mut estimate,
        &noise.weights(f64::INFINITY),
        &setup,
    );
    let before = problem.misses(&estimate);
    let mut left = root_mean_square(before.iter().map(Vector3::norm));
    let mut last: Vec<GivenUp> = Vec::new();
    let mut last_numbers: Option<Vec<usize>> = None;
    let mut rounds = 0;
    loop {
        let weights = noise.weights(STIFF * left);
        let jacobian = problem.jacobian(&estimate, &weights);
        let factor = Factor::new(jacobian.clone());
        let idle = problem.idle(&factor, &weights);
        let known = root_mean_square(weights.rows.iter().copied()).recip();
        let size = root_mean_square(before.iter().map(Vector3::norm)).max(known);
        let least = threshold(problem, known, size, left);
        let mut gone = if rounds < FREE { Vec::new() } else { last };
        let is_new = |i: &usize| gone.iter().all(|g: &GivenUp| g.number != *i);
        let idle: Vec<usize> = idle.into_iter().filter(is_new).collect();
        gone.extend(idle.into_iter().map(|i| GivenUp::idle(i, unknowns[i])));
        let (factor, given_up) = seen(unknowns, factor, gone, least);
        for one in &given_up {
            problem.give_up(&mut estimate, one);
        }
        let arrived = descend(problem, &mut estimate, &jacobian, &factor, &weights);
        let misses = problem.misses(&estimate);
        let kept = factor.unknowns();
        let freedom = equations - kept.len();
        let settled = noise.learn(&misses, freedom, options.robust, rounds);
        let trusted = misses.iter().zip(&noise.trust);
        left = root_mean_square(trusted.map(|(miss, trust)| miss.norm() * trust));
        let numbers: Vec<usize> = given_up.iter().map(|g| g.number).collect();
        let same = last_numbers.as_ref() == Some(&numbers);
        last_numbers = Some(numbers);
        rounds += 1;
        if rounds == ROUNDS && !arrived {
            return Err(not_converged(&misses));
        }
        if (arrived && same && settled) || rounds == ROUNDS {
            // Stiff bars and steps in between can end in another place; that is no result.
            let most = root_mean_square(before.iter().map(Vector3::norm)) * (1.0 + STILL);
            if !options.robust && (left.is_nan() || left > most) {
                return Err(not_converged(&misses));
            }
            if parameters > 0 && !kept.iter().any(is_parameter) {
                return Err(problem.nothing_seen(&misses));
            }
            let seen: Vec<Parameter> = (kept.iter())
                .filter_map(|i| match unknowns[*i] {
                    Unknown::Parameter(parameter) => Some(parameter),
                    _ => None,
                })
                .collect();
            let covariance = factor.covariance(seen.len());
            let covariance = covariance.ok_or_else(|| not_converged(&misses))?;
            let value = |p: &Parameter| estimate.errors.parameters.get(p).copied().unwrap_or(0.0);
            return Ok(Identified {
                parameters: (seen.iter().enumerate())
                    .map(|(i, parameter)| Estimated {
                        parameter: *parameter,
                        value: value(parameter),
                        uncertainty: covariance[(i, i)].sqrt(),
                    })
                    .collect(),
                covariance,
                unseen: given_up.into_iter().map(|g| g.unseen).collect(),
                noise: noise.left(&misses, freedom),
                of_stated: noise.is_stated.then(|| noise.factor(&misses, freedom)),
                freedom,
                condition: factor.spectrum(0.0).condition,
                rows: problem.rows(&before, &misses, &noise.trusted(&misses, freedom)),
                errors: estimate.errors,
                balls: estimate.balls,
                stylus: estimate.stylus,
            });
        }
        last = given_up;
    }
}

/// The largest singular value of combinations that are not seen: with probings that are `known` so well, errors
/// that do so much (`size`) at them, and what is `left` of them in the end (mm, roots of the mean squares).
pub(super) fn threshold(problem: &Problem<'_>, known: f64, size: f64, left: f64) -> f64 {
    // The standard uncertainty of a combination with the singular value s is that of a weight of 1 by s,
    // if it is told by what it does at the probings (root of the mean square).
    let noisy = known / (PLAUSIBLE * size * (problem.equations() as f64).sqrt());
    let vague = VAGUE * left / problem.lever();
    noisy.max(vague).max(ROUNDING)
}

fn not_converged(misses: &[Vector3<f64>]) -> IdentifyError {
    IdentifyError::NotConverged {
        rms: root_mean_square(misses.iter().map(Vector3::norm)),
    }
}

pub(super) fn root_mean_square(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len();
    (values.map(|v| v * v).sum::<f64>() / count as f64).sqrt()
}

/// Gives up, beside what is `gone`, unknowns until no combination has a singular value that is not above
/// `least`; the factor of those that are left.
pub(super) fn seen(
    unknowns: &[Unknown],
    factor: Factor,
    gone: Vec<GivenUp>,
    least: f64,
) -> (Factor, Vec<GivenUp>) {
    let mut all = gone;
    let is_left = |i: &usize| all.iter().all(|g| g.number != *i);
    let left: Vec<usize> = factor.unknowns().iter().copied().filter(is_left).collect();
    let mut factor = factor.of(&left);
    loop {
        let hidden = factor.spectrum(least).hidden;
        if hidden.ncols() == 0 {
            return (factor, all);
        }
        let numbers = factor.unknowns();
        let left: Vec<Unknown> = numbers.iter().map(|i| unknowns[*i]).collect();
        let more = given_up(&left, &hidden, &factor.units());
        let is_left = |place: &usize| more.iter().all(|g| g.number != *place);
        let kept: Vec<usize> = (0..left.len())
            .filter(is_left)
            .map(|i| numbers[i])
            .collect();
        all.extend(more.into_iter().map(|g| {
            GivenUp {
                number: numbers[g.number],
                others: g
                    .others
                    .iter()
                    .map(|(i, part)| (numbers[*i], *part))
                    .collect(),
                unseen: g.unseen,
            }
        }));
        factor = factor.of(&kept);
    }
}

/// Fits balls and stylus to the nominal machine: what is left is what its errors do.
pub(super) fn setup_alone(
    problem: &Problem<'_>,
    estimate: &mut Estimate,
    weights: &Weights,
    setup: &[usize],
) {
    let jacobian = problem.jacobian(estimate, weights);
    let factor = Factor::new(jacobian.clone()).of(setup);
    let factor = seen(&problem.unknowns, factor, Vec::new(), ROUNDING).0;
    descend(problem, estimate, &jacobian, &factor, weights);
}

/// Steps with one Jacobian until nothing moves any more; false if that takes another one.
fn descend(
    problem: &Problem<'_>,
    estimate: &mut Estimate,
    jacobian: &DMatrix<f64>,
    factor: &Factor,
    weights: &Weights,
) -> bool {
    let mut residuals = problem.residuals(estimate, weights);
    let start = residuals.norm_squared();
    let is_still = |residuals: &DVector<f64>| start - residuals.norm_squared() < STILL * start;
    let mut last = f64::INFINITY;
    for _ in 0..STEPS {
        let Some(mut step) = factor.step(&jacobian.tr_mul(&residuals)) else {
            return false;
        };
        let change = jacobian * &step;
        let moved = weights.rows.iter().enumerate();
        let moved = moved.map(|(i, w)| change.fixed_rows::<3>(3 * i).norm() / w);
        let most = moved.fold(0.0, f64::max);
        if most > SHRINKS * last {
            return is_still(&residuals);
        }
        // Far away the derivatives at the nominal machine may lead too far.
        let before = residuals.norm_squared();
        let next = (0..HALVINGS).find_map(|_| {
            let next = problem.moved(estimate, &step);
            let residuals = problem.residuals(&next, weights);
            let is_no_worse = residuals.norm_squared() <= before * (1.0 + ROUNDING);
            step *= 0.5;
            is_no_worse.then_some((next, residuals))
        });
        let Some(next) = next else {
            return is_still(&residuals);
        };
        (*estimate, residuals) = next;
        if most < STEP {
            return true;
        }
        last = most;
    }
    is_still(&residuals)
}

/// What is known of how well rows can be trusted.
struct Noise {
    /// Standard uncertainty of a coordinate of each row, as stated (mm), or 1.
    stated: Vec<f64>,
    is_stated: bool,
    /// In these.
    deviation: f64,
    /// How much each row counts: 1, or less.
    trust: Vec<f64>,
}

impl Noise {
    fn new(problem: &Problem<'_>) -> Self {
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

    /// What the residuals of each row (mm) are multiplied by.
    fn weights(&self, least: f64) -> Weights {
        let rows = self.trust.iter().zip(&self.stated);
        let rows = rows.map(|(trust, stated)| trust / (self.deviation * stated));
        Weights {
            rows: rows.collect(),
            least,
        }
    }

    /// Distances in what is stated.
    fn distances(&self, misses: &[Vector3<f64>]) -> Vec<f64> {
        let rows = misses.iter().zip(&self.stated);
        rows.map(|(miss, stated)| miss.norm() / stated).collect()
    }

    /// Standard deviation of a coordinate in what is stated, from the median row: `share` of it is left after
    /// the fit.
    fn spread(&self, misses: &[Vector3<f64>], freedom: usize) -> f64 {
        let mut distances = self.distances(misses);
        distances.sort_by(f64::total_cmp);
        let left = (freedom as f64 / (3 * distances.len()) as f64).sqrt();
        distances[distances.len() / 2] / MEDIAN / left
    }

    /// Standard deviation of a coordinate in what is stated.
    fn factor(&self, misses: &[Vector3<f64>], freedom: usize) -> f64 {
        let counted = self.distances(misses).into_iter().zip(&self.trust);
        let squares: f64 = counted.map(|(d, trust)| (d * trust).powi(2)).sum();
        let rejected = self.trust.iter().filter(|t| **t <= REJECTED).count();
        (squares / freedom.saturating_sub(3 * rejected).max(1) as f64).sqrt()
    }

    /// The same in mm.
    fn left(&self, misses: &[Vector3<f64>], freedom: usize) -> f64 {
        let stated = root_mean_square(self.stated.iter().copied());
        self.factor(misses, freedom) * stated
    }

    fn trusted(&self, misses: &[Vector3<f64>], freedom: usize) -> Vec<bool> {
        let most = DISTRUSTED * self.spread(misses, freedom).max(LEAST_NOISE);
        self.distances(misses).iter().map(|d| *d <= most).collect()
    }

    /// Takes in what is left; true if that hardly changes anything.
    fn learn(
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

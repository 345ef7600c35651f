//! Gauss–Newton with the rank from the noise.

use super::factor::Factor;
use super::identified::{Estimated, Identified, Place};
use super::noise::Noise;
use super::rows::{Estimate, Problem, Weights};
use super::unseen::{GivenUp, given_up};
use super::{IdentifyError, Unknown, bars, root_mean_square, units};
use crate::errors::Parameter;
use nalgebra::{DMatrix, DVector, Vector3};

/// How to identify.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Options {
    /// Rows that fit badly count less (Huber).
    pub robust: bool,
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
/// A machine that leaves more than this part of what the nominal one does is none.
const FAR: f64 = 0.5;
/// If another choice makes what is left of the rows larger by this, the one before it stays.
const WORSE: f64 = 1.01;
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
/// Derivatives change by how far the tip moves over the lever, and uncertainties by that times the condition: less than
/// this is not looked at.
const ELSEWHERE: f64 = 1e-3;
/// Bars and stylus are known no better than this part of what the rows miss: a hundredth, of which second-order
/// effects are a part again.
pub(super) const STIFF: f64 = 0.01;

/// Identifies what a problem looks for.
///
/// # Errors
/// [`IdentifyError`]: fewer equations than unknowns, no convergence, numbers that cannot be.
pub fn identify(problem: &Problem<'_>, options: Options) -> Result<Identified, IdentifyError> {
    let found = solve(problem, options);
    let is_misfit = matches!(
        found,
        Err(IdentifyError::NotConverged { .. } | IdentifyError::NothingSeen { .. })
    );
    let has_bars = !problem.bars.is_empty();
    if is_misfit
        && has_bars
        && let Ok(without) = solve(&problem.without_bars(), options)
    {
        return Err(bars::disagree(problem, &without.balls));
    }
    found
}

fn solve(problem: &Problem<'_>, options: Options) -> Result<Identified, IdentifyError> {
    let unknowns = &problem.unknowns;
    let equations = problem.equations();
    let is_parameter = |i: &usize| matches!(unknowns[*i], Unknown::Parameter(_));
    problem.can_be_solved()?;
    let has_parameters = (0..unknowns.len()).any(|i| is_parameter(&i));
    let alone = problem.alone();
    let mut noise = Noise::new(problem);
    bars::have_directions(problem, &problem.start())?;
    let mut estimate = setup_alone(problem, &noise.weights(f64::INFINITY))?;
    units::are_mm(problem, &estimate)?;
    let before = problem.misses(&estimate);
    let at_start = root_mean_square(before.iter().map(Vector3::norm));
    let mut left = at_start;
    let mut last: Option<Round> = None;
    let mut is_free = true;
    let mut rounds = 0;
    loop {
        let weights = noise.weights(STIFF * left);
        let jacobian = problem.jacobian(&estimate, &weights);
        let factor = Factor::new(&jacobian, (0..unknowns.len()).collect(), &alone);
        let factor = factor.ok_or(IdentifyError::NotFinite)?;
        let idle = problem.idle(&factor, &weights);
        let known = root_mean_square(weights.rows.iter().copied()).recip();
        let size = at_start.max(known);
        let least = threshold(problem, known, size, left);
        is_free &= rounds < FREE;
        let before_this = last.as_ref().filter(|_| !is_free);
        let mut gone = before_this.map_or(Vec::new(), |last| last.given_up.clone());
        let is_new = |i: &usize| gone.iter().all(|g: &GivenUp| g.number != *i);
        let idle: Vec<usize> = idle.into_iter().filter(is_new).collect();
        gone.extend(
            idle.into_iter()
                .map(|i| GivenUp::idle(i, unknowns[i], problem.spindle)),
        );
        let (factor, given_up) = seen(problem, factor, gone, least);
        for one in &given_up {
            problem.give_up(&mut estimate, one);
        }
        let arrived = descend(problem, &mut estimate, &jacobian, &factor, &weights);
        let misses = problem.misses(&estimate);
        let trusted = |misses: &[Vector3<f64>], noise: &Noise| {
            let rows = misses.iter().zip(&noise.trust);
            root_mean_square(rows.map(|(miss, trust)| miss.norm() * trust))
        };
        let same = (last.as_ref()).is_some_and(|last| last.numbers() == numbers(&given_up));
        rounds += 1;
        // What is seen only by second-order effects can lead astray: then what was seen before is all.
        if let Some(round) = &last
            && is_free
            && !same
            && trusted(&misses, &noise) > WORSE * trusted(&round.misses, &noise)
        {
            estimate = round.estimate.clone();
            is_free = false;
            continue;
        }
        let freedom = equations - factor.unknowns().len();
        let settled = noise.learn(&misses, freedom, options.robust, rounds - 1);
        left = trusted(&misses, &noise);
        if arrived && same && settled {
            // Stiff bars and steps in between can end in another place; that is no result.
            if left.is_nan() || left > trusted(&before, &noise) * (1.0 + STILL) {
                return Err(not_converged(&misses));
            }
            if has_parameters && !factor.unknowns().iter().any(is_parameter) {
                let (line, worst) = problem.worst(&misses);
                return Err(IdentifyError::NothingSeen {
                    rms: root_mean_square(misses.iter().map(Vector3::norm)),
                    line,
                    worst,
                });
            }
            // What is stated holds where it ends, not where its last step began.
            let moved = last.iter().flat_map(|last| last.misses.iter().zip(&misses));
            let moved = moved.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            let is_elsewhere = moved * factor.condition() > ELSEWHERE * problem.lever();
            let (jacobian, factor) = if is_elsewhere {
                let jacobian = problem.jacobian(&estimate, &weights);
                let factor = Factor::new(&jacobian, factor.unknowns().to_vec(), &alone);
                (jacobian, factor.ok_or(IdentifyError::NotFinite)?)
            } else {
                (jacobian, factor)
            };
            let place = Place {
                estimate,
                weights,
                factor,
            };
            let end = End {
                before,
                misses,
                noise,
                given_up,
            };
            return identified(problem, place, end, &jacobian);
        }
        if rounds == ROUNDS {
            return Err(match arrived {
                false if left > FAR * at_start => not_converged(&misses),
                _ => IdentifyError::Unsettled {
                    rounds,
                    what: match (arrived, same) {
                        (true, true) => "how much rows count",
                        (true, false) => "which parameters can be seen",
                        (false, _) => "what parameters are that can hardly be told from each other",
                    },
                    rms: root_mean_square(misses.iter().map(Vector3::norm)),
                    line: problem.worst(&misses).0,
                },
            });
        }
        last = Some(Round {
            estimate: estimate.clone(),
            given_up,
            misses,
        });
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

/// What a round comes to.
struct Round {
    estimate: Estimate,
    given_up: Vec<GivenUp>,
    misses: Vec<Vector3<f64>>,
}

impl Round {
    fn numbers(&self) -> Vec<usize> {
        numbers(&self.given_up)
    }
}

fn numbers(given_up: &[GivenUp]) -> Vec<usize> {
    given_up.iter().map(|g| g.number).collect()
}

/// What the last round leaves, beside the solution.
struct End {
    before: Vec<Vector3<f64>>,
    misses: Vec<Vector3<f64>>,
    noise: Noise,
    given_up: Vec<GivenUp>,
}

/// Puts together what is known in the end.
fn identified(
    problem: &Problem<'_>,
    place: Place,
    end: End,
    jacobian: &DMatrix<f64>,
) -> Result<Identified, IdentifyError> {
    let End {
        before,
        misses,
        noise,
        given_up,
    } = end;
    let Place {
        estimate,
        weights,
        factor,
    } = &place;
    let kept = factor.unknowns();
    let freedom = problem.equations() - kept.len();
    let seen: Vec<Parameter> = (kept.iter())
        .filter_map(|i| match problem.unknowns[*i] {
            Unknown::Parameter(parameter) => Some(parameter),
            _ => None,
        })
        .collect();
    let of_rows = factor.covariance(seen.len());
    let of_rows = of_rows.ok_or_else(|| not_converged(&misses))?;
    let before_that = problem.base.covariance().without(&seen);
    let others = before_that.parameters.iter();
    let others: Vec<Unknown> = others.map(|p| Unknown::Parameter(*p)).collect();
    let others = problem.derivatives(&others, estimate, weights);
    // What was known before pulls those that are found with it, as far as they can make up for it.
    let mut pull = DMatrix::zeros(seen.len(), others.ncols());
    for (mut pull, column) in pull.column_iter_mut().zip(others.column_iter()) {
        let step = factor.step(&jacobian.tr_mul(&column));
        let step = step.ok_or(IdentifyError::NotFinite)?;
        for (pull, i) in pull.iter_mut().zip(kept) {
            *pull = step[*i];
        }
    }
    let known = before_that.joined(&seen, &of_rows, &pull);
    let covariance = known.matrix.view((0, 0), (seen.len(), seen.len()));
    let value = |p: &Parameter| estimate.errors.parameters.get(p).copied().unwrap_or(0.0);
    let looked_for = problem.unknowns.iter().filter_map(|unknown| match unknown {
        Unknown::Parameter(parameter) => Some(*parameter),
        _ => None,
    });
    Ok(Identified {
        looked_for: looked_for.collect(),
        parameters: (seen.iter().enumerate())
            .map(|(i, parameter)| Estimated {
                parameter: *parameter,
                value: value(parameter),
                uncertainty: covariance[(i, i)].sqrt(),
            })
            .collect(),
        covariance: covariance.into_owned(),
        unseen: given_up.into_iter().map(|g| g.unseen).collect(),
        noise: noise.left(&misses, freedom),
        of_stated: noise.is_stated.then(|| noise.factor(&misses, freedom)),
        freedom,
        condition: factor.condition(),
        bars: bars::checked(problem, &place, jacobian),
        rows: problem.rows(&before, &misses, &noise.trusted(&misses, freedom)),
        errors: place.estimate.errors.clone(),
        balls: place.estimate.balls.clone(),
        stylus: place.estimate.stylus,
        known,
        place,
    })
}

fn not_converged(misses: &[Vector3<f64>]) -> IdentifyError {
    IdentifyError::NotConverged {
        rms: root_mean_square(misses.iter().map(Vector3::norm)),
    }
}

/// Gives up, beside what is `gone`, unknowns until no combination has a singular value that is not above
/// `least`; the factor of those that are left.
pub(super) fn seen(
    problem: &Problem<'_>,
    factor: Factor,
    gone: Vec<GivenUp>,
    least: f64,
) -> (Factor, Vec<GivenUp>) {
    let mut all = gone;
    let is_left = |i: &usize| all.iter().all(|g| g.number != *i);
    let left: Vec<usize> = factor.unknowns().iter().copied().filter(is_left).collect();
    let mut factor = factor.of(&left);
    loop {
        let hidden = factor.hidden(least);
        if hidden.ncols() == 0 {
            return (factor, all);
        }
        let numbers = factor.unknowns();
        let left: Vec<Unknown> = numbers.iter().map(|i| problem.unknowns[*i]).collect();
        let more = given_up(&left, &hidden, &factor.units(), problem.spindle);
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
    weights: &Weights,
) -> Result<Estimate, IdentifyError> {
    let problem = &problem.of_setup();
    let mut estimate = problem.start();
    let jacobian = problem.jacobian(&estimate, weights);
    let all = (0..problem.unknowns.len()).collect();
    let factor = Factor::new(&jacobian, all, &problem.alone()).ok_or(IdentifyError::NotFinite)?;
    let factor = seen(problem, factor, Vec::new(), ROUNDING).0;
    descend(problem, &mut estimate, &jacobian, &factor, weights);
    Ok(estimate)
}

/// Steps with one Jacobian until nothing moves any more; false if that takes another one.
pub(super) fn descend(
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
            let is_no_worse = residuals.norm_squared() <= before * (1.0 + STILL);
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

//! Gauss–Newton.

use super::descent::{STILL, descend, setup_alone};
use super::factor::Factor;
use super::identified::{Estimated, Identified, Solution};
use super::noise::Noise;
use super::rows::{LARGEST_LENGTH, Problem};
use super::structure::Structure;
use super::unidentifiable::GivenUp;
use super::{IdentifyError, Unknown, bars, mistakes, root_mean_square, snoop, units};
use nalgebra::{DMatrix, Vector3};
use trueaxis_model::errors::Parameter;

/// How to identify.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Options {
    /// Rows that fit badly count less (Huber).
    pub robust: bool,
    /// Combinations of unknowns are left out that do no more than this part of what their parts do at the probings,
    /// even if they can be seen.
    pub least: f64,
}

/// Rounds, each with a Jacobian: the first has that of the nominal machine, the second knows the noise. More
/// are made only as long as what is trusted changes.
const ROUNDS: usize = 20;
/// A machine that leaves more than this part of what the nominal one does is none.
const FAR: f64 = 0.5;
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
        Err(IdentifyError::NotConverged { .. } | IdentifyError::Unsettled { .. })
    );
    match is_misfit {
        true => misfit(problem, options).map_or(found, Err),
        false => found,
    }
}

/// Why nothing fits: what is stated of bars or the stylus, or some of the rows.
fn misfit(problem: &Problem<'_>, options: Options) -> Option<IdentifyError> {
    if !problem.bars.is_empty()
        && let Ok(without) = solve(&problem.without_bars(), options)
    {
        return Some(bars::disagree(problem, &without.balls));
    }
    if problem.known_coordinates().next().is_some()
        && let Ok(without) = solve(&problem.without_stylus(), options)
    {
        return mistakes::stylus(problem, &without.stylus);
    }
    if options.robust {
        return None;
    }
    let robust = Options {
        robust: true,
        ..options
    };
    let without = solve(problem, robust).ok()?;
    let suspicions = snoop(problem, &without);
    let sentences = suspicions
        .iter()
        .map(|suspicion| suspicion.sentence(problem));
    let sentences: Vec<String> = sentences.collect();
    (!sentences.is_empty()).then_some(IdentifyError::Suspected { sentences })
}

fn solve(problem: &Problem<'_>, options: Options) -> Result<Identified, IdentifyError> {
    let unknowns = &problem.unknowns;
    let is_parameter = |i: &usize| matches!(unknowns[*i], Unknown::Parameter(_));
    problem.can_be_solved()?;
    let has_parameters = (0..unknowns.len()).any(|i| is_parameter(&i));
    let alone = problem.alone();
    let mut noise = Noise::new(problem);
    bars::have_directions(problem, &problem.start())?;
    let mut estimate = setup_alone(problem, &noise.weights(f64::INFINITY))?;
    units::are_mm(problem, &estimate)?;
    mistakes::refuse(problem)?;
    let Structure { kept, given_up } = Structure::of(problem, options.least)?;
    let before = problem.misses(&estimate);
    let at_start = root_mean_square(before.iter().map(Vector3::norm));
    if has_parameters && !kept.iter().any(is_parameter) {
        return Err(IdentifyError::NothingSeen);
    }
    let freedom = problem.equations() - kept.len();
    let trusted = |misses: &[Vector3<f64>], noise: &Noise| {
        let rows = misses.iter().zip(&noise.trust);
        root_mean_square(rows.map(|(miss, trust)| miss.norm() * trust))
    };
    let mut left = at_start;
    let mut arrived = false;
    let mut misses = before.clone();
    for round in 0..ROUNDS {
        let weights = noise.weights(STIFF * left);
        let jacobian = problem.jacobian(&estimate, &weights);
        let factor = Factor::new(&jacobian, kept.clone(), &alone);
        let factor = factor.ok_or(IdentifyError::NotFinite)?;
        arrived = descend(problem, &mut estimate, &jacobian, &factor, &weights);
        let last = std::mem::replace(&mut misses, problem.misses(&estimate));
        let settled = noise.learn(&misses, freedom, options.robust, round);
        left = trusted(&misses, &noise);
        if !arrived || !settled || round == 0 {
            continue;
        }
        // Stiff bars and steps in between can end in another place; and what is farther off than any error is no
        // error. That is not a result.
        if left.is_nan() || left > trusted(&before, &noise) * (1.0 + STILL) || left > LARGEST_LENGTH
        {
            return Err(not_converged(&misses));
        }
        // What is stated holds where it ends, not where its last step began.
        let moved = last.iter().zip(&misses).map(|(a, b)| (a - b).norm());
        let moved = moved.fold(0.0, f64::max);
        let is_elsewhere = moved * factor.condition() > ELSEWHERE * problem.lever();
        let (jacobian, factor) = if is_elsewhere {
            let jacobian = problem.jacobian(&estimate, &weights);
            let factor = Factor::new(&jacobian, kept, &alone);
            (jacobian, factor.ok_or(IdentifyError::NotFinite)?)
        } else {
            (jacobian, factor)
        };
        let place = Solution {
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
    if !arrived && left > FAR * at_start {
        return Err(not_converged(&misses));
    }
    Err(IdentifyError::Unsettled {
        rounds: ROUNDS,
        what: if arrived {
            "how much rows count"
        } else {
            "what parameters are that can hardly be told from each other"
        },
        rms: root_mean_square(misses.iter().map(Vector3::norm)),
        line: problem.worst(&misses).0,
    })
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
    place: Solution,
    end: End,
    jacobian: &DMatrix<f64>,
) -> Result<Identified, IdentifyError> {
    let End {
        before,
        misses,
        noise,
        given_up,
    } = end;
    let Solution {
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
        bars: bars::checked(problem, (estimate, weights, factor), jacobian),
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

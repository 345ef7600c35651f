//! Gauss–Newton.

use crate::descent::{STILL, descend, setup_alone};
use crate::estimate::Estimate;
use crate::factor::{Alone, ScaledFactor};
use crate::identified::{Estimated, FoundChange, Identified, Solution};
use crate::noise::Noise;
use crate::rows::{EquationWeights, LARGEST_LENGTH, Problem};
use crate::structure::Identifiability;
use crate::unidentifiable::GivenUp;
use crate::{
    IdentifyError, Outlier, Unknown, bars, misread, mistakes, root_mean_square, snoop, units,
};
use nalgebra::{DMatrix, Vector3};
use trueaxis_model::errors::{Covariance, Parameter};
use trueaxis_model::numbers::student;

/// Options of an identification.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct IdentifyOptions {
    /// Give rows that fit badly less weight (Huber).
    pub robust: bool,
    /// Leave out combinations of unknowns whose effect at the probings is no more than this fraction of the effects
    /// of their parts, even if they can be identified.
    pub least: f64,
}

/// Largest number of rounds, each with a new Jacobian: the first uses that of the nominal machine, the second knows
/// the noise. More are made only as long as the set of trusted rows changes.
const ROUNDS: usize = 20;
/// Reject a fit whose residual exceeds this fraction of the nominal machine's.
const FAR: f64 = 0.5;
/// Derivatives change by the tip displacement divided by the lever, and uncertainties by that times the condition
/// number; smaller changes are ignored.
const ELSEWHERE: f64 = 1e-3;
/// Lower limit of the uncertainty of bars and stylus, as a fraction of the rows' residuals: a hundredth, of which
/// second-order effects are again a fraction.
pub(crate) const STIFF: f64 = 0.01;

/// Solves an identification problem.
///
/// # Errors
/// [`IdentifyError`]: fewer equations than unknowns, no convergence, impossible numbers.
pub fn identify(
    problem: &Problem<'_>,
    options: IdentifyOptions,
) -> Result<Identified, IdentifyError> {
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

/// Explains why nothing fits: stated bars or stylus, or some of the rows.
fn misfit(problem: &Problem<'_>, options: IdentifyOptions) -> Option<IdentifyError> {
    if !problem.bars.is_empty()
        && let Ok(without) = solve(&problem.without_bars(), options)
    {
        // A ball that has moved makes a right bar disagree.
        return Some(
            moved(&problem.without_bars(), &without)
                .unwrap_or_else(|| bars::disagree(problem, &without.balls)),
        );
    }
    if problem.known_coordinates().next().is_some()
        && let Ok(without) = solve(&problem.without_stylus(), options)
    {
        return mistakes::stylus(problem, &without.stylus);
    }
    if options.robust {
        return None;
    }
    let robust = IdentifyOptions {
        robust: true,
        ..options
    };
    let without = solve(problem, robust).ok()?;
    refused(problem, &snoop(problem, &without))
}

/// A ball, a stylus or a set-up that has moved among the rows.
fn moved(problem: &Problem<'_>, found: &Identified) -> Option<IdentifyError> {
    let outliers = snoop(problem, found);
    let groups: Vec<Outlier> = outliers.into_iter().filter(Outlier::is_group).collect();
    refused(problem, &groups)
}

fn refused(problem: &Problem<'_>, outliers: &[Outlier]) -> Option<IdentifyError> {
    let sentences = outliers.iter().map(|outlier| outlier.sentence(problem));
    let sentences: Vec<String> = sentences.collect();
    (!sentences.is_empty()).then_some(IdentifyError::Outliers { sentences })
}

fn solve(problem: &Problem<'_>, options: IdentifyOptions) -> Result<Identified, IdentifyError> {
    problem.can_be_solved()?;
    let noise = Noise::new(problem);
    bars::have_directions(problem, &problem.start())?;
    let estimate = setup_alone(problem, &noise.weights(f64::INFINITY))?;
    units::are_mm(problem, &estimate)?;
    mistakes::refuse(problem)?;
    misread::refuse(problem)?;
    let Identifiability { kept, given_up } = Identifiability::of(problem, options.least)?;
    let before = problem.misses(&estimate);
    let at_start = root_mean_square(before.iter().map(Vector3::norm));
    if !sees_parameters(problem, &kept) {
        return Err(IdentifyError::NothingSeen);
    }
    let mut iteration = GaussNewton {
        problem,
        is_robust: options.robust,
        kept,
        alone: problem.alone(),
        noise,
        estimate,
        misses: before.clone(),
        shares: Vec::new(),
        left: at_start,
    };
    let mut arrived = false;
    for number in 0..ROUNDS {
        let round = iteration.round(number)?;
        arrived = round.arrived;
        if arrived && round.settled && number > 0 {
            return iteration.identified(round, &before, given_up);
        }
    }
    if !arrived && iteration.left > FAR * at_start {
        return Err(not_converged(&iteration.misses));
    }
    Err(iteration.unsettled(arrived))
}

/// False if parameters are looked for and the measurements show none.
fn sees_parameters(problem: &Problem<'_>, kept: &[usize]) -> bool {
    let is_parameter = |unknown: &Unknown| unknown.parameter().is_some();
    !problem.unknowns.iter().any(is_parameter)
        || kept.iter().any(|i| is_parameter(&problem.unknowns[*i]))
}

/// The iteration, as far as it has come.
struct GaussNewton<'a> {
    problem: &'a Problem<'a>,
    is_robust: bool,
    /// The unknowns that can be identified.
    kept: Vec<usize>,
    alone: Vec<Alone>,
    noise: Noise,
    estimate: Estimate,
    misses: Vec<Vector3<f64>>,
    /// Degrees of freedom of each source of noise.
    shares: Vec<f64>,
    /// What is left of trusted rows (mm, root mean square).
    left: f64,
}

/// One round with one Jacobian.
struct NewtonRound {
    weights: EquationWeights,
    jacobian: DMatrix<f64>,
    factor: ScaledFactor,
    arrived: bool,
    /// True if rows count as much as before.
    settled: bool,
    /// How far (mm) a tip has moved.
    moved: f64,
}

impl GaussNewton<'_> {
    fn round(&mut self, number: usize) -> Result<NewtonRound, IdentifyError> {
        let problem = self.problem;
        let weights = self.noise.weights(STIFF * self.left);
        let (jacobian, factor) = self.factored(&weights)?;
        let arrived = descend(problem, &mut self.estimate, &jacobian, &factor, &weights);
        let last = std::mem::replace(&mut self.misses, problem.misses(&self.estimate));
        if number == 0 || self.is_robust || self.noise.needs_shares() {
            let found = self.noise.shares(problem, &jacobian, &factor);
            self.shares = found.ok_or_else(|| not_converged(&self.misses))?;
        }
        let (misses, shares) = (&self.misses, &self.shares);
        let settled = self.noise.learn(misses, shares, self.is_robust, number);
        self.left = self.trusted(misses);
        let moved = last.iter().zip(misses).map(|(a, b)| (a - b).norm());
        Ok(NewtonRound {
            weights,
            jacobian,
            factor,
            arrived,
            settled,
            moved: moved.fold(0.0, f64::max),
        })
    }

    fn factored(
        &self,
        weights: &EquationWeights,
    ) -> Result<(DMatrix<f64>, ScaledFactor), IdentifyError> {
        let jacobian = self.problem.jacobian(&self.estimate, weights);
        let factor = ScaledFactor::new(&jacobian, self.kept.clone(), &self.alone);
        Ok((jacobian, factor.ok_or(IdentifyError::NotFinite)?))
    }

    fn trusted(&self, misses: &[Vector3<f64>]) -> f64 {
        let rows = misses.iter().zip(&self.noise.trust);
        root_mean_square(rows.map(|(miss, trust)| miss.norm() * trust))
    }

    /// With stiff bars and intermediate steps, the iteration can end at another minimum; and distances larger than any
    /// machine error are not machine errors. Neither is a result.
    fn is_lost(&self, before: &[Vector3<f64>]) -> bool {
        let left = self.left;
        left.is_nan() || left > self.trusted(before) * (1.0 + STILL) || left > LARGEST_LENGTH
    }

    /// Assembles the final result.
    fn identified(
        self,
        last: NewtonRound,
        before: &[Vector3<f64>],
        given_up: Vec<GivenUp>,
    ) -> Result<Identified, IdentifyError> {
        let (problem, misses) = (self.problem, &self.misses);
        if self.is_lost(before) {
            return Err(not_converged(misses));
        }
        let (place, jacobian) = self.solution(last)?;
        let Solution {
            estimate,
            weights,
            factor,
        } = &place;
        let kept = factor.unknowns();
        let seen = problem.parameters(kept.iter().copied());
        let of_rows = factor.covariance(seen.len());
        let of_rows = of_rows.ok_or_else(|| not_converged(misses))?;
        // A noise that few residuals show may be larger: its standard deviation becomes that of Student's distribution
        // (JCGM 101, 6.4.9), of which twice covers 95 %. That of stated uncertainties is known.
        let freedom = problem.equations() - kept.len();
        let components = self.noise.components(misses, &self.shares);
        let is_stated = components.iter().all(|one| one.of_stated.is_some());
        let of_few = match is_stated || freedom == 0 {
            true => 1.0,
            false => (student(freedom) / student(usize::MAX)).powi(2),
        };
        let of_rows = of_rows * of_few;
        let known = joined(problem, &place, &jacobian, &seen, of_rows)?;
        let covariance = known.matrix.view((0, 0), (seen.len(), seen.len()));
        let trusted = self.noise.trusted(misses, &self.shares);
        let [rows, observed] = problem.rows(before, misses, &trusted);
        let variances = factor.variances().unwrap_or_default();
        let variance = |unknown: Unknown| {
            let i = kept.iter().position(|i| problem.unknowns[*i] == unknown)?;
            variances.get(i).map(|variance| variance * of_few)
        };
        let value = |p: &Parameter| estimate.errors.parameters.get(p).copied().unwrap_or(0.0);
        Ok(Identified {
            looked_for: problem.parameters(0..problem.unknowns.len()),
            parameters: (seen.iter().enumerate())
                .map(|(i, parameter)| Estimated {
                    parameter: *parameter,
                    value: value(parameter),
                    uncertainty: covariance[(i, i)].sqrt(),
                })
                .collect(),
            covariance: covariance.into_owned(),
            unseen: given_up.into_iter().map(|g| g.unseen).collect(),
            noise: components[0].noise,
            of_stated: components[0].of_stated,
            freedom,
            condition: factor.condition(),
            bars: bars::checked(problem, (estimate, weights, factor), &jacobian),
            rows,
            observed,
            setups: problem.observed.set_up(estimate, weights.least, &variance),
            drift: problem.observed.drifts(&problem.drift, estimate, &variance),
            thermal: changes(problem, estimate, &variance),
            components,
            errors: (*estimate.errors).clone(),
            balls: estimate.balls.clone(),
            stylus: estimate.stylus,
            known,
            place,
        })
    }

    /// The solution, and the Jacobian there, not where its last step began.
    fn solution(&self, last: NewtonRound) -> Result<(Solution, DMatrix<f64>), IdentifyError> {
        let is_elsewhere = last.moved * last.factor.condition() > ELSEWHERE * self.problem.lever();
        let (jacobian, factor) = match is_elsewhere {
            true => self.factored(&last.weights)?,
            false => (last.jacobian, last.factor),
        };
        let place = Solution {
            estimate: self.estimate.clone(),
            weights: last.weights,
            factor,
        };
        Ok((place, jacobian))
    }

    fn unsettled(&self, arrived: bool) -> IdentifyError {
        IdentifyError::Unsettled {
            rounds: ROUNDS,
            what: match arrived {
                true => "how much rows count",
                false => "what parameters are that can hardly be told from each other",
            },
            rms: root_mean_square(self.misses.iter().map(Vector3::norm)),
            line: self.problem.worst(&self.misses).0,
        }
    }
}

/// The covariance of all that is known, given that of the parameters `seen` by the measurements alone.
fn joined(
    problem: &Problem<'_>,
    place: &Solution,
    jacobian: &DMatrix<f64>,
    seen: &[Parameter],
    of_rows: DMatrix<f64>,
) -> Result<Covariance, IdentifyError> {
    let Solution {
        estimate,
        weights,
        factor,
    } = place;
    let before = problem.base.covariance().without(seen);
    let others = before.parameters.iter();
    let others: Vec<Unknown> = others.map(|p| Unknown::Parameter(*p)).collect();
    let others = problem.derivatives(&others, estimate, weights);
    // Errors of previously known parameters shift those identified with them, as far as they can absorb them.
    let pull = factor.absorbed(jacobian, others.column_iter());
    let pull = pull.ok_or(IdentifyError::NotFinite)?;
    let pull = pull.rows(0, seen.len()).into_owned();
    // So do the values of tables, which are no parameters: their part is in the covariance of what was found.
    let by_tables = problem.by_tables((estimate, weights, factor), jacobian);
    let by_tables = by_tables.ok_or(IdentifyError::NotFinite)?;
    let by_tables = by_tables.rows(0, seen.len());
    let of_rows = of_rows + by_tables * by_tables.transpose();
    Ok(before.joined(seen, &of_rows, &pull))
}

/// The changes with temperature, as found.
fn changes(
    problem: &Problem<'_>,
    estimate: &Estimate,
    variance: &dyn Fn(Unknown) -> Option<f64>,
) -> Vec<FoundChange> {
    let found = |unknown: &Unknown| {
        let (parameter, input) = unknown.parameter()?;
        let choice = problem.choice.iter().find(|(of, _)| of == unknown);
        let choice = choice.map_or(0.0, |(_, choice)| *choice);
        Some(FoundChange {
            parameter,
            input: input?,
            per_kelvin: (estimate.errors).per_kelvin(problem.machine, parameter, input?),
            uncertainty: libm::hypot(variance(*unknown)?.sqrt(), choice),
        })
    };
    problem.unknowns.iter().filter_map(found).collect()
}

fn not_converged(misses: &[Vector3<f64>]) -> IdentifyError {
    IdentifyError::NotConverged {
        rms: root_mean_square(misses.iter().map(Vector3::norm)),
    }
}

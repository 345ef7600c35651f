//! Repeated identification of simulated probings, each with different noise, and with lengths of bars and stylus
//! that are off within their uncertainty.
//!
//! Machine and balls do not change, so one Jacobian and one factorisation serve all repetitions. The residuals are
//! those of the exact machine, and the iteration runs until it converges.

use crate::descent::descend;
use crate::estimate::Estimate;
use crate::formats::artefact::Artefact;
use crate::formats::observations::Observations;
use crate::formats::probings::Probings;
use crate::simulate::{self, Disturbances, SimulateError};
use crate::{
    Identified, IdentifyError, IdentifyOptions, Measured, Model, Problem, automatic, identify,
};
use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use trueaxis_model::errors::{ErrorModel, Parameter, Situation, Switches};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_model::numbers::extremes;
use trueaxis_model::parallel;
use trueaxis_model::uncertainty;

/// The simulation, and the model to identify.
#[derive(Clone, Copy, Debug)]
pub struct Trial<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// Errors. Parameters that these probings cannot identify are set to zero.
    pub errors: &'a ErrorModel,
    /// The balls.
    pub artefact: &'a Artefact,
    /// The probings.
    pub plan: &'a Probings,
    /// The model to identify.
    pub model: &'a Model,
    /// Standard deviation of a coordinate (mm).
    pub noise: f64,
}

/// Statistics of one parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Normalised {
    /// The parameter.
    pub parameter: Parameter,
    /// Standard uncertainty for the simulated noise.
    pub uncertainty: f64,
    /// Mean of its errors, each divided by the standard uncertainty that the identification states; 0 if there is no
    /// bias.
    pub mean: f64,
    /// Standard deviation of the same; 1 if the stated uncertainties are right.
    pub deviation: f64,
}

/// Statistics of all identifications.
#[derive(Clone, Debug, PartialEq)]
pub struct MonteCarloOutcome {
    /// Number of identifications.
    pub seeds: usize,
    /// Each parameter that can be identified.
    pub parameters: Vec<Normalised>,
    /// Mean of the estimated noise (mm).
    pub noise: f64,
    /// Number of positions in the probed range at which the volumetric error was evaluated, over all
    /// identifications.
    pub positions: usize,
    /// Number of these at which the remaining tip error is within its 95 % interval.
    pub tips_inside: usize,
    /// Like `tips_inside`, for the tool direction.
    pub directions_inside: usize,
    /// The smallest fraction of positions inside the coverage interval in any one identification; the errors of one
    /// identification are correlated.
    pub least_inside: f64,
}

/// Why there is no result.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TrialError {
    /// The probings cannot be simulated.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// The model cannot be identified.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The machine does not support the model.
    #[error(transparent)]
    Model(#[from] super::ModelError),
    /// One factorisation does not serve all repetitions.
    #[error("the noise of seed {seed} leads so far that it takes another factorisation")]
    Far {
        /// The seed for which it fails.
        seed: u64,
    },
}

/// Number of positions at which the volumetric error is evaluated.
const POSITIONS: usize = 100;
/// Makes errors of lengths independent of the noise of probings.
const OWN: u64 = 0x00ba_4500;

/// Result of one identification.
struct OneTrial {
    /// Errors of parameters divided by their stated uncertainties.
    normalised: Vec<f64>,
    noise: f64,
    /// Numbers of tips and directions inside their coverage intervals.
    inside: [usize; 2],
}

/// Identifies `seeds` times, with the seeds from 1. `step` is called after each.
///
/// # Errors
/// [`TrialError`]: the probings cannot be simulated, the model cannot be identified, or not with one factorisation.
pub fn monte_carlo(
    trial: &Trial<'_>,
    seeds: usize,
    step: &(dyn Fn() + Sync),
) -> Result<MonteCarloOutcome, TrialError> {
    let Trial { machine, .. } = *trial;
    let first = trial.first(trial.errors)?;
    // Parameters that cannot be identified have no true value either.
    let mut truth = trial.errors.clone();
    for unseen in &first.unseen {
        if let super::Unknown::Parameter(parameter) = unseen.unknown {
            truth.set(machine, parameter, 0.0);
        }
    }
    let first = trial.first(&truth)?;
    let clean = trial.probed(&truth, 0.0, 0)?;
    let perfect = ErrorModel::perfect(machine);
    let problem = Problem::new(machine, &clean, trial.artefact, &first.looked_for, &perfect);
    let positions = positions(machine, &clean);
    let leaves = uncertainty::leaves(machine, &first.errors, &first.known, &positions);
    let repetition = Repetition {
        trial,
        first: &first,
        truth: &truth,
        clean: &clean,
        jacobian: problem.jacobian(&first.place.estimate, &first.place.weights),
        problem,
        bands: parallel::map(&leaves, |at| [at.tip_band(), at.direction_band()]),
        positions,
    };
    let once = |seed: &u64| -> Result<OneTrial, TrialError> {
        let found = repetition.once(*seed)?;
        step();
        Ok(found)
    };
    let all: Vec<OneTrial> = parallel::try_map(&Vec::from_iter(1..=seeds as u64), once)?;
    Ok(trial.outcome(&first, &all))
}

/// What all repetitions have in common.
struct Repetition<'a> {
    trial: &'a Trial<'a>,
    first: &'a Identified,
    truth: &'a ErrorModel,
    /// The probings without noise.
    clean: &'a Probings,
    problem: Problem<'a>,
    jacobian: DMatrix<f64>,
    positions: Vec<(PerAxis, Situation)>,
    /// The 95 % intervals of tip and tool direction at each position.
    bands: Vec<[f64; 2]>,
}

impl Repetition<'_> {
    fn once(&self, seed: u64) -> Result<OneTrial, TrialError> {
        let (trial, place) = (self.trial, &self.first.place);
        let disturbances = trial.disturbances(trial.noise, seed);
        let measured = simulate::disturbed(trial.machine, self.clean, &disturbances);
        let mut random = Pcg64Mcg::seed_from_u64(seed ^ OWN);
        let problem = self.problem.with_positions(&measured);
        let problem = problem.with_chance_lengths(&mut random);
        let mut estimate: Estimate = place.estimate.clone();
        let (factor, weights) = (&place.factor, &place.weights);
        if !descend(&problem, &mut estimate, &self.jacobian, factor, weights) {
            return Err(TrialError::Far { seed });
        }
        let square = problem.residuals(&estimate, weights).norm_squared();
        // In the deviation on which the factor's weights are based.
        let scale = (square / self.first.freedom as f64).sqrt();
        let off = |e: &super::Estimated| {
            let [found, real] = [&*estimate.errors, self.truth]
                .map(|errors| errors.parameters.get(&e.parameter).copied().unwrap_or(0.0));
            (found - real) / (e.uncertainty * scale)
        };
        Ok(OneTrial {
            normalised: self.first.parameters.iter().map(off).collect(),
            noise: self.first.noise * scale,
            inside: self.inside(&estimate.errors, scale),
        })
    }

    /// At how many positions tip and tool direction are inside their intervals, times `scale`.
    fn inside(&self, found: &ErrorModel, scale: f64) -> [usize; 2] {
        let machine = self.trial.machine;
        let [found, real] = [found, self.truth].map(|errors| Kinematics::new(machine, errors));
        let mut inside = [0; 2];
        for ((q, situation), band) in self.positions.iter().zip(&self.bands) {
            let [found, real] = [&found, &real].map(|k| k.actual(q, situation, &Switches::ALL));
            let tip = (found.t - real.t).norm();
            let along = machine.tool_axis;
            let turned = (found.r.column(along) - real.r.column(along)).norm();
            inside[0] += usize::from(tip <= band[0] * scale);
            inside[1] += usize::from(turned <= band[1] * scale);
        }
        inside
    }
}

impl Trial<'_> {
    fn outcome(&self, first: &Identified, all: &[OneTrial]) -> MonteCarloOutcome {
        let seeds = all.len();
        let count = seeds as f64;
        let normalised = |(i, e): (usize, &super::Estimated)| {
            let mean = all.iter().map(|once| once.normalised[i]).sum::<f64>() / count;
            let squares = all.iter().map(|once| (once.normalised[i] - mean).powi(2));
            Normalised {
                parameter: e.parameter,
                uncertainty: e.uncertainty * self.noise / first.noise,
                mean,
                deviation: (squares.sum::<f64>() / (count - 1.0)).sqrt(),
            }
        };
        let least = all.iter().map(|once| once.inside[0]).min();
        MonteCarloOutcome {
            seeds,
            parameters: (first.parameters.iter().enumerate())
                .map(normalised)
                .collect(),
            noise: all.iter().map(|once| once.noise).sum::<f64>() / count,
            positions: seeds * POSITIONS,
            tips_inside: all.iter().map(|once| once.inside[0]).sum(),
            directions_inside: all.iter().map(|once| once.inside[1]).sum(),
            least_inside: least.map_or(0.0, |least| least as f64 / POSITIONS as f64),
        }
    }

    fn disturbances(&self, noise: f64, seed: u64) -> Disturbances {
        Disturbances {
            noise,
            seed,
            ..Disturbances::default()
        }
    }

    fn probed(&self, errors: &ErrorModel, noise: f64, seed: u64) -> Result<Probings, TrialError> {
        let kinematics = Kinematics::new(self.machine, errors);
        let disturbances = self.disturbances(noise, seed);
        let probed = simulate::probings(&kinematics, self.artefact, self.plan, &disturbances)?;
        Ok(probed)
    }

    /// A complete identification from probings with noise.
    fn first(&self, errors: &ErrorModel) -> Result<Identified, TrialError> {
        let measured = self.probed(errors, self.noise, 0)?;
        let perfect = ErrorModel::perfect(self.machine);
        let measured = Measured {
            machine: self.machine,
            probings: &measured,
            artefact: self.artefact,
            observations: &Observations::default(),
            base: &perfect,
        };
        let options = IdentifyOptions::default();
        if *self.model == Model::Auto {
            return Ok(automatic(&measured, options)?.identified);
        }
        let parameters = self.model.parameters(self.machine, 0, &[])?;
        Ok(identify(&measured.problem(&parameters), options)?)
    }
}

/// Random positions in the probed range.
fn positions(machine: &Machine, probed: &Probings) -> Vec<(PerAxis, Situation)> {
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let ranges: Vec<[f64; 2]> = (0..machine.axes.len())
        .map(|i| extremes(probed.rows.iter().map(|row| row.position[i])))
        .collect();
    let mut position = || -> (PerAxis, Situation) {
        let drawn = (ranges.iter()).map(|[low, high]| low + (high - low) * random.random::<f64>());
        let drawn: Vec<f64> = drawn.collect();
        (machine.to_kinematic(&drawn), Situation::default())
    };
    (0..POSITIONS).map(|_| position()).collect()
}

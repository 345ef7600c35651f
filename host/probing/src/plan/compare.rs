//! Finds a plan that is as good as a given one, with fewer probings.

use super::candidates::{Allowed, Setup};
use super::design::{Criterion, DesignCandidates, DesignError, clear, repeats, root};
use super::exchange::{Measure, RowExchange};
use super::judge::{Judgement, judge_alone};
use nalgebra::DMatrix;
use trueaxis_identify::formats::probings::Probings;
use trueaxis_model::errors::{ErrorModel, Parameter};

/// Uncertainties of one plan divided by those of another; 1 or less where it is at least as good.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ratios {
    /// The parameter with the largest ratio, among those that both identify.
    pub parameter: Option<(Parameter, f64)>,
    /// Mean of the tip over the travel.
    pub tip: f64,
    /// Mean of the tool direction.
    pub direction: f64,
}

impl Ratios {
    /// The ratios of one plan to another.
    #[must_use]
    pub fn of(one: &Judgement, other: &Judgement) -> Self {
        let known = |parameters: &[Parameter], uncertainties: Vec<f64>| {
            let pairs = parameters.iter().copied().zip(uncertainties);
            pairs.collect::<Vec<(Parameter, f64)>>()
        };
        let [one_known, other_known] =
            [one, other].map(|j| known(&j.foreseen.parameters, j.foreseen.uncertainties()));
        let ratios = one_known.iter().filter_map(|(parameter, uncertainty)| {
            let (_, other) = other_known.iter().find(|(p, _)| p == parameter)?;
            Some((*parameter, uncertainty / other))
        });
        Self {
            parameter: ratios.max_by(|a, b| a.1.total_cmp(&b.1)),
            tip: one.tip.mean / other.tip.mean,
            direction: one.direction.mean / other.direction.mean,
        }
    }

    /// True if nothing that the criterion requires is known less well.
    #[must_use]
    pub fn is_no_worse(&self, criterion: Criterion) -> bool {
        let parameter = match criterion {
            Criterion::Parameters => self.parameter.map_or(0.0, |(_, ratio)| ratio),
            Criterion::Volume => 0.0,
        };
        [parameter, self.tip, self.direction]
            .iter()
            .all(|r| *r <= 1.0)
    }
}

/// The result.
#[derive(Clone, Debug)]
pub struct AsGood {
    /// The plan with the fewest probings; `None` if there is none.
    pub plan: Option<Probings>,
    /// False if the search was stopped early, so that a smaller one may exist.
    pub is_whole: bool,
}

/// Finds the plan with the fewest probings that knows tip and tool direction over the travel on average at least
/// as well as `other`, and identifies everything that it identifies. Under [`Criterion::Parameters`] every parameter
/// must be known as well, too. `None` if not even the same number of probings is enough. The search stops after a
/// few seconds' work, the same amount on every computer.
///
/// # Errors
/// [`DesignError`]: nothing can be reached.
pub fn as_good_as(
    setup: &Setup<'_>,
    allowed: &Allowed,
    parameters: &[Parameter],
    assumed: &ErrorModel,
    other: &Judgement,
    criterion: Criterion,
) -> Result<AsGood, DesignError> {
    let allowed = setup.clear_of_collisions(allowed);
    let choice = DesignCandidates::new(setup, &allowed, parameters, assumed)?;
    let Some(goals) = goals(&choice.foreseen.parameters, other, criterion) else {
        return Ok(AsGood {
            plan: None,
            is_whole: true,
        });
    };
    let mut search = FewerRowsSearch::new(&choice, other, goals);
    let most = other.plan.rows.len();
    let judged = |exchange: &RowExchange| {
        let chosen = exchange.chosen();
        let total = (chosen.len()..=most).find(|n| n - repeats(*n) >= chosen.len());
        let plan = choice.plan(setup, &chosen, repeats(total.unwrap_or(most)));
        let plan = clear(setup, plan);
        let judgement = judge_alone(setup, parameters, &plan, assumed).ok()?;
        let seen = |p: &Parameter| judgement.foreseen.parameters.contains(p);
        let all = other.foreseen.parameters.iter().all(seen);
        (all && Ratios::of(&judgement, other).is_no_worse(criterion)).then_some(plan)
    };
    let mut exchange = choice.exchange(&search.effect()).limited_to(MOST_WORK);
    let count = (most - repeats(most)).min(choice.candidates.rows.len());
    exchange.choose(count, Measure::Effect);
    let plan = search.fewest(count, &choice, &mut exchange, &judged);
    Ok(AsGood {
        plan,
        is_whole: !exchange.is_done(),
    })
}

/// The place of each parameter whose uncertainty counts among those `seen`, and its goal. `None` if one is not seen.
fn goals(seen: &[Parameter], other: &Judgement, criterion: Criterion) -> Option<Vec<(usize, f64)>> {
    let wanted = &other.foreseen;
    let places =
        (wanted.parameters.iter()).map(|parameter| seen.iter().position(|p| p == parameter));
    let goals: Option<Vec<(usize, f64)>> = (places.zip(wanted.uncertainties()))
        .map(|(place, uncertainty)| Some((place?, uncertainty)))
        .collect();
    match criterion {
        Criterion::Parameters => goals,
        Criterion::Volume => goals.map(|_| Vec::new()),
    }
}

/// Limit of the search: 9 seconds on one core at 3 GHz. The document's largest model needs 0.8e9.
const MOST_WORK: u64 = 900_000_000;

/// The first step reduces the number of probings by this fraction; then the step is halved.
const STEPS: usize = 6;
/// How often goals that are missed get more weight before the number of probings counts as too small.
const ROUNDS: usize = 8;
/// Beyond this ratio no weights help.
const HOPELESS: f64 = 1.5;
/// Up to this ratio, repeated probings, which add a little information, may make the difference.
const NEAR: f64 = 1.05;

/// Search for a design in which nothing is worse than before.
#[derive(Clone)]
struct FewerRowsSearch {
    /// Weight of each goal, then of tip and direction.
    weights: Vec<f64>,
    /// Matrices of the volumetric error of tip and direction, relative to their goals.
    volume: [DMatrix<f64>; 2],
    /// Indices of the parameters, and the goal of each.
    goals: Vec<(usize, f64)>,
}

impl FewerRowsSearch {
    fn new(choice: &DesignCandidates, other: &Judgement, goals: Vec<(usize, f64)>) -> Self {
        let [tip, direction] = choice.band.mean_squares();
        Self {
            weights: vec![1.0; goals.len() + 2],
            volume: [
                root(&tip) / other.tip.root_mean_square,
                root(&direction) / other.direction.root_mean_square,
            ],
            goals,
        }
    }

    /// The plan with the fewest probings: fewer by a step that is halved where it goes too far.
    fn fewest(
        &mut self,
        mut count: usize,
        choice: &DesignCandidates,
        exchange: &mut RowExchange,
        judged: &impl Fn(&RowExchange) -> Option<Probings>,
    ) -> Option<Probings> {
        let mut best: Option<(Probings, RowExchange, Self, usize)> = None;
        let mut step = (count / STEPS).max(1);
        loop {
            match self.settle(choice, exchange, judged) {
                Some(plan) => best = Some((plan, exchange.clone(), self.clone(), count)),
                None if best.is_none() || step == 1 || exchange.is_done() => break,
                None => step /= 2,
            }
            if let Some((_, last, weights, number)) = &best {
                exchange.back_to(last);
                (*self, count) = (weights.clone(), *number);
            }
            if count < choice.least() + step {
                break;
            }
            for _ in 0..step {
                exchange.shrink(Measure::Effect);
            }
            count -= step;
        }
        best.map(|(plan, ..)| plan)
    }

    /// The weighted quantities, relative to their goals.
    fn effect(&self) -> DMatrix<f64> {
        let [tip, direction] = &self.volume;
        let columns = tip.ncols();
        let (first, second) = (self.goals.len(), self.goals.len() + tip.nrows());
        let mut effect = DMatrix::zeros(second + direction.nrows(), columns);
        for (i, (place, goal)) in self.goals.iter().enumerate() {
            effect[(i, *place)] = self.weights[i].sqrt() / goal;
        }
        for (start, matrix, weight) in [(first, tip, first), (second, direction, first + 1)] {
            let scaled = matrix * self.weights[weight].sqrt();
            effect.rows_mut(start, matrix.nrows()).copy_from(&scaled);
        }
        // As many rows as parameters have the same effect.
        root(&effect.tr_mul(&effect))
    }

    /// The ratio of each to its goal.
    fn ratios(&self, exchange: &RowExchange) -> Vec<f64> {
        let covariance = exchange.covariance(self.volume[0].ncols());
        let parameters = self.goals.iter();
        let parameters = parameters.map(|(i, goal)| covariance[(*i, *i)].sqrt() / goal);
        let volume = self.volume.iter();
        let volume = volume.map(|v| (v * &covariance * v.transpose()).trace().sqrt());
        parameters.chain(volume).collect()
    }

    /// Increases the weights of missed goals until all are met.
    fn settle(
        &mut self,
        choice: &DesignCandidates,
        exchange: &mut RowExchange,
        judged: &impl Fn(&RowExchange) -> Option<Probings>,
    ) -> Option<Probings> {
        for _ in 0..ROUNDS {
            let ratios = self.ratios(exchange);
            let most = ratios.iter().copied().fold(0.0, f64::max);
            if most > HOPELESS {
                return None;
            }
            if most <= NEAR
                && let Some(plan) = judged(exchange)
            {
                return Some(plan);
            }
            if exchange.is_done() {
                return None;
            }
            for (weight, ratio) in self.weights.iter_mut().zip(&ratios) {
                *weight *= (ratio / most).powi(4);
            }
            exchange.set_effect(&choice.with_setup(&self.effect()));
            exchange.improve(Measure::Effect);
        }
        None
    }
}

//! A strategy that is as good as another one, with fewer probings.

use super::candidates::{Allowed, Setup};
use super::design::{Choice, Criterion, DesignError, repeats, root};
use super::exchange::{Exchange, Measure};
use super::judge::{Judgement, judge_alone};
use crate::formats::probings::Probings;
use nalgebra::DMatrix;
use trueaxis_model::errors::{ErrorModel, Parameter};

/// How much less is known by one strategy than by another: uncertainties by uncertainties, 1 or less where it is
/// no worse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ratios {
    /// Of the parameter that fares worst, of those that both see.
    pub parameter: Option<(Parameter, f64)>,
    /// Mean of the tip over the travel.
    pub tip: f64,
    /// Mean of the tool direction.
    pub direction: f64,
}

impl Ratios {
    /// Of one strategy to another.
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

    /// True if nothing that is asked for is known less.
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

/// What was found.
#[derive(Clone, Debug)]
pub struct AsGood {
    /// The strategy of fewest probings; `None` if there is none.
    pub strategy: Option<Probings>,
    /// False if the search was ended early: one with fewer may exist.
    pub is_whole: bool,
}

/// The strategy of fewest probings found that knows tip and tool direction over the travel on average no less well
/// than `other` does, by [`Criterion::Parameters`] every parameter too, and sees all that it sees; none if not even
/// as many probings as that has do. The search ends after some seconds' work, the same on every computer.
///
/// # Errors
/// [`DesignError`]: nothing that can be reached.
pub fn as_good_as(
    setup: &Setup<'_>,
    allowed: &Allowed,
    parameters: &[Parameter],
    assumed: &ErrorModel,
    other: &Judgement,
    criterion: Criterion,
) -> Result<AsGood, DesignError> {
    let choice = Choice::new(setup, allowed, parameters, assumed)?;
    let seen = &choice.foreseen.parameters;
    let wanted = other
        .foreseen
        .parameters
        .iter()
        .zip(other.foreseen.uncertainties());
    let mut goals: Vec<(usize, f64)> = Vec::new();
    for (parameter, uncertainty) in wanted {
        match seen.iter().position(|p| p == parameter) {
            Some(place) if criterion == Criterion::Parameters => goals.push((place, uncertainty)),
            Some(_) => {}
            None => {
                return Ok(AsGood {
                    strategy: None,
                    is_whole: true,
                });
            }
        }
    }
    let [tip, direction] = choice.band.mean_squares();
    let mut search = Search {
        weights: vec![1.0; goals.len() + 2],
        volume: [
            root(&tip) / other.tip.root_mean_square,
            root(&direction) / other.direction.root_mean_square,
        ],
        goals,
    };
    let most = other.strategy.rows.len();
    let judged = |exchange: &Exchange| {
        let chosen = exchange.chosen();
        let total = (chosen.len()..=most).find(|n| n - repeats(*n) >= chosen.len());
        let strategy = choice.strategy(setup, &chosen, repeats(total.unwrap_or(most)));
        let judgement = judge_alone(setup, parameters, &strategy, assumed).ok()?;
        let seen = |p: &Parameter| judgement.foreseen.parameters.contains(p);
        let all = other.foreseen.parameters.iter().all(seen);
        (all && Ratios::of(&judgement, other).is_no_worse(criterion)).then_some(strategy)
    };
    let mut exchange = choice.exchange(&search.effect()).limited_to(MOST_WORK);
    let mut count = (most - repeats(most)).min(choice.candidates.rows.len());
    exchange.choose(count, Measure::Effect);
    let mut best: Option<(Probings, Exchange, Search, usize)> = None;
    let mut step = (count / STEPS).max(1);
    loop {
        match search.settle(&choice, &mut exchange, &judged) {
            Some(strategy) => best = Some((strategy, exchange.clone(), search.clone(), count)),
            None if best.is_none() || step == 1 || exchange.is_done() => break,
            None => step /= 2,
        }
        if let Some((_, last, weights, number)) = &best {
            exchange.back_to(last);
            (search, count) = (weights.clone(), *number);
        }
        if count < choice.least() + step {
            break;
        }
        for _ in 0..step {
            exchange.shrink(Measure::Effect);
        }
        count -= step;
    }
    Ok(AsGood {
        strategy: best.map(|(strategy, ..)| strategy),
        is_whole: !exchange.is_done(),
    })
}

/// What the search may go through: 9 seconds on one core at 3 GHz. The document's largest model needs 0.8e9.
const MOST_WORK: u64 = 900_000_000;

/// The first step to fewer probings is this part of them; then halves of it.
const STEPS: usize = 6;
/// How often what is not good enough gets more weight before there are too few probings.
const ROUNDS: usize = 8;
/// Beyond this ratio no weights will help.
const HOPELESS: f64 = 1.5;
/// Up to this ratio repeated probings, which tell a little more, may make the difference.
const NEAR: f64 = 1.05;

/// The search for a design in which nothing is worse than it was.
#[derive(Clone)]
struct Search {
    /// How much each of the goals matters, then tip and direction.
    weights: Vec<f64>,
    /// The volumetric error of both, by what it has to be.
    volume: [DMatrix<f64>; 2],
    /// Which parameters there are, and what each has to be.
    goals: Vec<(usize, f64)>,
}

impl Search {
    /// What matters, each by what it has to be.
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
        // As many rows as parameters do the same.
        root(&effect.tr_mul(&effect))
    }

    /// The ratio of each to what it has to be.
    fn ratios(&self, exchange: &Exchange) -> Vec<f64> {
        let covariance = exchange.covariance(self.volume[0].ncols());
        let parameters = self.goals.iter();
        let parameters = parameters.map(|(i, goal)| covariance[(*i, *i)].sqrt() / goal);
        let volume = self.volume.iter();
        let volume = volume.map(|v| (v * &covariance * v.transpose()).trace().sqrt());
        parameters.chain(volume).collect()
    }

    /// Gives what is not good enough more weight until all is.
    fn settle(
        &mut self,
        choice: &Choice,
        exchange: &mut Exchange,
        judged: &impl Fn(&Exchange) -> Option<Probings>,
    ) -> Option<Probings> {
        for _ in 0..ROUNDS {
            let ratios = self.ratios(exchange);
            let most = ratios.iter().copied().fold(0.0, f64::max);
            if most > HOPELESS {
                return None;
            }
            if most <= NEAR
                && let Some(strategy) = judged(exchange)
            {
                return Some(strategy);
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

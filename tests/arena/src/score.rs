//! Scores of an answer for one machine.

use crate::answer::{Answer, Cost};
use crate::effect::effects;
use crate::interval::{one_sided, two_sided};
use crate::left::{Left, left};
use crate::task::Hidden;

/// From mm to µm, and from rad to µrad.
const UNITS: [f64; 2] = [1e3, 1e6];
/// A direction that is worse by less than this (µrad, root mean square), and a tip that is worse by less than this (µm),
/// count as unchanged.
const WORSE: f64 = 0.01;

/// Scores of an answer for one machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Score {
    /// Error of the tip that is left (µm, root mean square over the positions).
    pub tip: f64,
    /// Error of the tool direction that is left (µrad, root mean square).
    pub direction: f64,
    /// The errors of all parameters that were asked for, by their effect at the tip, as a part of the parameters
    /// themselves: 1 if none was found. `None` if none was asked for.
    pub parameters: Option<f64>,
    /// The interval score of the parameters (µm at the tip, mean).
    pub parameter_interval: Option<f64>,
    /// Part of the positions at which the error of the tip is within its band, and that of the direction.
    pub within: [f64; 2],
    /// The interval score of the tip (µm, mean over the positions), and of the direction (µrad).
    pub interval: [f64; 2],
    /// Instructions and bytes, if known.
    pub cost: Option<Cost>,
    /// True if tip or direction are worse than without any correction.
    pub is_worse: bool,
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

fn rms(errors: &[Left], value: fn(&Left) -> f64) -> f64 {
    mean(errors.iter().map(|e| value(e).powi(2))).sqrt()
}

impl Score {
    /// Compares an answer with the truth. It has one correction and one band for each position.
    #[must_use]
    pub fn of(hidden: &Hidden, answer: &Answer) -> Self {
        let task = &hidden.task;
        let commands: Vec<_> = task.positions.iter().map(|p| p.command).collect();
        let none = Answer::none(commands.len());
        let left =
            |answer: &Answer| left(task, &commands, |i| hidden.truth_at(i), &answer.corrections);
        let [before, after] = [&none, answer].map(left);
        let values: [fn(&Left) -> f64; 2] = [|left| left.tip, |left| left.direction];
        let banded = |k: usize| {
            let each = after.iter().zip(&answer.bands);
            each.map(move |(left, band)| (values[k](left), band[k]))
        };
        let within = [0, 1].map(|k| {
            let inside = banded(k).filter(|(error, band)| error <= band);
            inside.count() as f64 / after.len() as f64
        });
        let interval =
            [0, 1].map(|k| UNITS[k] * mean(banded(k).map(|(error, band)| one_sided(band, error))));
        let [tip_before, direction_before] = [0, 1].map(|k| UNITS[k] * rms(&before, values[k]));
        let [tip, direction] = [0, 1].map(|k| UNITS[k] * rms(&after, values[k]));
        let parameters = parameters(hidden, answer);
        Self {
            tip,
            direction,
            parameters: parameters.map(|[left, _]| left),
            parameter_interval: parameters.map(|[_, interval]| interval),
            within,
            interval,
            cost: answer.cost,
            is_worse: tip > tip_before + WORSE || direction > direction_before + WORSE,
        }
    }
}

/// What is left of the parameters, and their interval score (µm).
fn parameters(hidden: &Hidden, answer: &Answer) -> Option<[f64; 2]> {
    let task = &hidden.task;
    if task.asked.is_empty() {
        return None;
    }
    let commands: Vec<_> = task.positions.iter().map(|p| p.command).collect();
    let effects = effects(&task.machine, &task.asked, &commands);
    let (mut wrong, mut all, mut interval) = (0.0, 0.0, 0.0);
    for (parameter, effect) in task.asked.iter().zip(effects) {
        let truth = hidden.truth_at(0).parameters.get(parameter).copied();
        let truth = truth.unwrap_or_default() * effect;
        let stated = answer.parameters.get(parameter).copied();
        let stated = stated.unwrap_or_default();
        let (value, band) = (stated.value * effect, stated.band * effect);
        wrong += (value - truth).powi(2);
        all += truth * truth;
        interval += two_sided(value, band, truth) * 1e3;
    }
    Some([(wrong / all).sqrt(), interval / task.asked.len() as f64])
}

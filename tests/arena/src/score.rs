//! Scores of an answer for one machine.

use crate::answer::{Answer, Cost};
use crate::effect::effects;
use crate::interval::{one_sided, two_sided};
use crate::left::{Left, left};
use crate::task::Hidden;

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
    /// Part of the positions at which the error of the tip is within its band.
    pub within: f64,
    /// The interval score of the tip (µm, mean over the positions).
    pub interval: f64,
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
        let tip_and_band = after.iter().zip(&answer.bands);
        let inside = tip_and_band.clone().filter(|(e, band)| e.tip <= band[0]);
        let within = inside.count() as f64 / after.len() as f64;
        let interval = mean(tip_and_band.map(|(e, band)| one_sided(band[0], e.tip) * 1e3));
        let [tip_before, tip] = [&before, &after].map(|e| rms(e, |e| e.tip) * 1e3);
        let [direction_before, direction] =
            [&before, &after].map(|e| rms(e, |e| e.direction) * 1e6);
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

//! Which positions of each axis were measured: their range, and what is between them.

use super::Probed;
use crate::StudyOutcome;
use trueaxis_direct::MeasuredRuns;
use trueaxis_model::numbers::{ascending, extremes};

/// Positions (mm, deg) closer than this are the same: files round to 1 µm, so distances are off by up to 1 µm, and multiples
/// of them by some more.
const SAME: f64 = 5e-3;
/// A common step (mm, deg) up to this is none: pitches of screws and teeth of worm wheels are longer.
const FINE: f64 = 1.0;
/// A few positions beside a grid show no more of what repeats within it: this part of all is on it.
const ON_GRID: f64 = 0.9;
/// A stretch without positions is named if it is more than this part of the range.
const WIDE: f64 = 0.2;

impl Probed {
    /// What was measured of each axis.
    #[must_use]
    pub fn of(found: &StudyOutcome<'_>) -> Vec<Self> {
        let axes = found.machine.axes.iter().enumerate();
        let one = |(index, axis): (usize, &trueaxis_model::machine::Axis)| {
            let mut at = positions(found, index);
            ascending(&mut at);
            at.dedup_by(|a, b| (*a - *b).abs() < SAME);
            Self {
                axis: axis.letter.char(),
                range: extremes(at.iter().copied()),
                step: common_step(&at),
                gap: widest_gap(&at),
            }
        };
        axes.map(one).collect()
    }

    /// What an error that varies quickly along the axis can hide behind, if anything.
    #[must_use]
    pub fn blind_to(&self) -> Option<String> {
        let axis = self.axis;
        let unit = if "XYZUVW".contains(axis) { " mm" } else { "°" };
        let number = |x: f64| format!("{}", (x * 1e3).round() / 1e3).replace('-', "−");
        if let Some(step) = self.step {
            return Some(format!(
                "all positions of {axis} are on a grid of {}{unit}, so errors that repeat within it are not seen",
                number(step)
            ));
        }
        let [from, to] = self.gap?.map(number);
        Some(format!(
            "nothing was measured between {axis} {from} and {to}{unit}, where errors are only those of the model"
        ))
    }
}

/// Commanded positions (mm, deg) of an axis in all measurements. Where it stood while another one was run counts only if it
/// was nowhere else: nothing is read of it there.
fn positions(found: &StudyOutcome<'_>, index: usize) -> Vec<f64> {
    let machine = found.machine;
    let mut at: Vec<f64> = (found.probings.rows.iter().map(|row| row.position[index])).collect();
    at.extend(
        found
            .observations
            .rows
            .iter()
            .map(|row| row.position[index]),
    );
    let mut stood = Vec::new();
    for runs in found.runs {
        let lines = match &runs.measured {
            MeasuredRuns::Line(line) => std::slice::from_ref(line),
            MeasuredRuns::Square(square) => &square.lines[..],
        };
        for line in lines {
            match line.setup.moved == index {
                true => at.extend(&line.targets),
                false => stood.push(machine.to_command(&line.setup.at)[index]),
            }
        }
    }
    if at.is_empty() { stood } else { at }
}

/// The step of a grid that all positions are on, or all but a few, if it is not fine.
fn common_step(at: &[f64]) -> Option<f64> {
    let distances = || at.windows(2).map(|pair| pair[1] - pair[0]);
    // The step of a grid with a few other positions is the distance that occurs most.
    let alike = |step: f64| distances().filter(move |d| (d - step).abs() < SAME);
    let most = distances().max_by_key(|step| alike(*step).count())?;
    let step = alike(most).sum::<f64>() / alike(most).count() as f64;
    greatest_divisor(at).or_else(|| {
        let mut rests: Vec<f64> = at.iter().map(|x| (x - at[0]).rem_euclid(step)).collect();
        ascending(&mut rests);
        let once_more: Vec<f64> = rests.iter().map(|rest| rest + step).collect();
        rests.extend(once_more);
        let from = |k: usize| rests.partition_point(|rest| *rest < rests[k] + SAME) - k;
        let together = (0..at.len()).map(from).max()?;
        (step > FINE && together as f64 >= ON_GRID * at.len() as f64).then_some(step)
    })
}

/// The largest step of which all distances are multiples, if it is not fine.
fn greatest_divisor(at: &[f64]) -> Option<f64> {
    let mut distances = at.windows(2).map(|pair| pair[1] - pair[0]);
    let first = distances.next().filter(|step| *step > FINE)?;
    let step = distances.try_fold(first, |mut step, mut rest| {
        // Euclid's algorithm; just below a multiple is a multiple.
        while rest > SAME {
            (step, rest) = (rest, step % rest);
            rest = rest.min(step - rest);
        }
        (step > FINE).then_some(step)
    })?;
    // The whole range is rounded no more than a single distance.
    let whole = at[at.len() - 1] - at[0];
    Some(whole / (whole / step).round())
}

/// The widest stretch without a position, if it is a large part of the range.
fn widest_gap(at: &[f64]) -> Option<[f64; 2]> {
    let [low, high] = extremes(at.iter().copied());
    let gaps = at.windows(2).map(|pair| [pair[0], pair[1]]);
    let widest = gaps.max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])))?;
    (widest[1] - widest[0] > WIDE * (high - low)).then_some(widest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_step_of_a_grid_is_that_of_all_positions() {
        let of = |at: &[f64]| common_step(at).map(|step| (step * 1e3).round() / 1e3);
        assert_eq!(of(&[0.0, 50.0, 100.0, 250.0]), Some(50.0));
        assert_eq!(of(&[-55.0, -40.0, 15.0, 55.0]), Some(5.0));
        // Rounded to a micrometre.
        assert_eq!(of(&[0.0, 33.333, 66.667, 133.333]), Some(33.333));
        assert_eq!(of(&[0.0, 90.0]), Some(90.0));
        // As ISO 230-2 asks for, and whole millimetres without a common step.
        assert_eq!(of(&[1.3, 48.7, 102.2, 149.9]), None);
        assert_eq!(of(&[0.0, 47.0, 103.0, 148.0]), None);
        // One position beside the grid shows nothing of what repeats within it; small steps with a wide gap are a grid, too.
        let with_one: Vec<f64> = (0..=10).map(|k| f64::from(50 * k)).chain([523.0]).collect();
        assert_eq!(of(&with_one), Some(50.0));
        let rounded = (0..40).map(|k| (f64::from(k) * 1e4 / 3.0).round() * 1e-3);
        let with_gap: Vec<f64> = rounded.clone().chain(rounded.map(|x| x + 430.0)).collect();
        assert_eq!(of(&with_gap), Some(3.333));
        let half: Vec<f64> = (0..=10)
            .map(|k| f64::from(50 * k) + f64::from(k % 2) * 13.7)
            .collect();
        assert_eq!(of(&half), None);
        assert_eq!(of(&[7.0]), None);
        assert_eq!(of(&[]), None);
    }

    #[test]
    fn a_wide_gap_is_named() {
        assert_eq!(
            widest_gap(&[-55.0, -35.0, -15.0, 0.0, 15.0, 40.0, 55.0]),
            Some([15.0, 40.0])
        );
        assert_eq!(widest_gap(&[0.0, 20.0, 40.0, 60.0, 80.0, 100.0]), None);
        assert_eq!(widest_gap(&[3.0]), None);
    }
}

//! Which positions of each axis were measured: their range, and what is between them.

use super::{Hidden, Probed};
use crate::StudyOutcome;
use trueaxis_direct::MeasuredRuns;
use trueaxis_model::machine::Axis;
use trueaxis_model::numbers::{ascending, extremes};

/// Positions (mm, deg) closer than this are the same: files round to 1 µm.
const SAME: f64 = 5e-3;
/// Errors that repeat within this (mm, deg) or less are left out: leads of screws and teeth of worm wheels are longer.
const SHORTEST: f64 = 1.0;
/// The longest lead in ISO 3408-2 (mm), which is the way per turn of a belt pulley of printers, too; a tooth of a worm wheel with
/// 36 (deg).
const LONGEST: [f64; 2] = [40.0, 10.0];
/// A sinusoid hardly shows at positions if less than a ninth of its square does, so a third of its amplitude.
const SHOWS: f64 = 1.0 / 9.0;
/// Number of periods that are named.
const NAMED: usize = 4;
/// Positions that are looked at: more show as much.
const MOST: usize = 300;
/// A stretch without positions is named if it is more than this part of the range.
const WIDE: f64 = 0.2;

impl Probed {
    /// What was measured of each axis.
    #[must_use]
    pub fn of(found: &StudyOutcome<'_>) -> Vec<Self> {
        let axes = found.machine.axes.iter().enumerate();
        let one = |(index, axis): (usize, &Axis)| {
            let at = distinct(positions(found, index));
            Self {
                axis: axis.letter.char(),
                range: extremes(at.iter().copied()),
                hidden: Some(hidden(found, index)),
                gap: widest_gap(&at),
            }
        };
        axes.map(one).collect()
    }

    /// What errors that vary quickly along the axis can hide behind.
    #[must_use]
    pub fn blind_to(&self) -> Vec<String> {
        let hidden = self.hidden.iter().flatten();
        let hidden = hidden.map(|hidden| hidden.sentence(self.axis));
        let gap = self.gap.map(|gap| {
            let [from, to] = gap.map(|x| format!("{}", (x * 1e3).round() / 1e3).replace('-', "−"));
            let (axis, unit) = (self.axis, unit(self.axis));
            format!(
                "nothing was measured between {axis} {from} and {to}{unit}, where errors are only those of the model"
            )
        });
        hidden.chain(gap).collect()
    }
}

impl Hidden {
    /// What it means.
    #[must_use]
    pub fn sentence(&self, axis: char) -> String {
        let whose = match self.motions.len() {
            // All that an axis has.
            6 => format!("errors of {axis}"),
            _ => format!("errors {} of {axis}", self.motions.join(", ")),
        };
        let unit = unit(axis);
        let periods: Vec<String> = self.periods.iter().map(|p| significant(*p)).collect();
        let every = match &periods[..] {
            [longest, others @ ..] if !others.is_empty() => {
                format!("{longest}{unit} (or {})", others.join(", "))
            }
            all => format!("{}{unit}", all.concat()),
        };
        format!("{whose} that repeat every {every} hardly show at the measured positions")
    }
}

/// Of an axis.
fn unit(axis: char) -> &'static str {
    if "XYZUVW".contains(axis) { " mm" } else { "°" }
}

/// With three digits.
fn significant(x: f64) -> String {
    match x {
        x if x >= 10.0 => format!("{}", (x * 10.0).round() / 10.0),
        x => format!("{}", (x * 100.0).round() / 100.0),
    }
}

/// In order, without repetitions.
fn distinct(mut at: Vec<f64>) -> Vec<f64> {
    ascending(&mut at);
    at.dedup_by(|a, b| (*a - *b).abs() < SAME);
    at
}

/// What is hidden of the error motions of an axis: of each that runs show, at the targets of these runs, and of the others at
/// the positions of all rows. Motions of which the same is hidden are together.
fn hidden(found: &StudyOutcome<'_>, index: usize) -> Vec<Hidden> {
    let machine = found.machine;
    let axis = &machine.axes[index];
    let is_rotary = axis.letter.is_rotary();
    let kept = found.kept.iter().flat_map(|kept| &kept.motions);
    let kept: Vec<_> = kept.filter(|motion| motion.axis == index).collect();
    let mut all: Vec<Hidden> = Vec::new();
    let mut add = |motions: Vec<String>, at: Vec<f64>| {
        let periods = hidden_periods(&distinct(at), LONGEST[usize::from(is_rotary)]);
        match all.iter_mut().find(|known| known.periods == periods) {
            _ if periods.is_empty() || motions.is_empty() => {}
            Some(known) => known.motions.extend(motions),
            None => all.push(Hidden { motions, periods }),
        }
    };
    for motion in &kept {
        let degrees = |at: &f64| if is_rotary { at.to_degrees() } else { *at };
        add(
            vec![motion.name(machine)],
            motion.at.iter().map(degrees).collect(),
        );
    }
    let is_kept = |component: usize| kept.iter().any(|motion| motion.component == component);
    let rest = "XYZABC"
        .chars()
        .zip(0..)
        .filter(|(_, component)| !is_kept(*component));
    let rest = rest.map(|(letter, _)| format!("E{letter}{}", axis.letter.char()));
    add(rest.collect(), rows(found, index));
    all
}

/// Commanded positions (mm, deg) of an axis in probings and observations.
fn rows(found: &StudyOutcome<'_>, index: usize) -> Vec<f64> {
    let probings = found.probings.rows.iter().map(|row| row.position[index]);
    let observations = found.observations.rows.iter();
    probings
        .chain(observations.map(|row| row.position[index]))
        .collect()
}

/// Commanded positions (mm, deg) of an axis in all measurements. Where it stood while another one was run counts only if it
/// was nowhere else: nothing is read of it there.
fn positions(found: &StudyOutcome<'_>, index: usize) -> Vec<f64> {
    let machine = found.machine;
    let mut at = rows(found, index);
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

/// The longest periods of sinusoids that positions hardly show, whatever their phase: of their square, the mean over all phases
/// is 1 − |R|², with R the mean of exp(2πi·x/period).
fn hidden_periods(at: &[f64], longest: f64) -> Vec<f64> {
    /// Between neighbouring frequencies, phases change by this (rad) along the range. On a grid, what is hidden stays hidden
    /// up to a change of 1.2 rad, so no hidden period is stepped over.
    const STEP: f64 = 0.3;
    /// Fractions of its multiples are spread evenly, and on no grid.
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let [low, high] = extremes(at.iter().copied());
    let range = high - low;
    if at.len() < 2 || range <= SHORTEST {
        return Vec::new();
    }
    let spread = |k: usize| at[((k as f64 * GOLDEN).fract() * at.len() as f64) as usize];
    let few: Vec<f64> = match at.len() <= MOST {
        true => at.to_vec(),
        false => (0..MOST).map(spread).collect(),
    };
    let shows = |frequency: f64| {
        let turns = few.iter().map(|x| (x - low) * frequency);
        let [mut cosines, mut sines] = [0.0; 2];
        for turn in turns {
            let (sine, cosine) = libm::sincos(turn * std::f64::consts::TAU);
            (cosines, sines) = (cosines + cosine, sines + sine);
        }
        let count = few.len() as f64;
        1.0 - (cosines * cosines + sines * sines) / (count * count)
    };
    let step = STEP / std::f64::consts::TAU / range;
    // Not as far as SHORTEST itself: what repeats within it, as on a grid of whole mm, would still be hidden there.
    let (first, last) = (1.0 / longest, 1.0 / SHORTEST - 1.0 / range);
    let mut found = Vec::new();
    let [mut before, mut here] = [first - step, first].map(shows);
    let mut frequency = first;
    while frequency < last && found.len() < NAMED {
        let next = shows(frequency + step);
        if here < SHOWS && here <= before && here < next {
            // The vertex of the parabola through three.
            let vertex = 0.5 * (before - next) / (before - 2.0 * here + next);
            found.push(1.0 / (frequency + vertex.clamp(-1.0, 1.0) * step));
        }
        (before, here, frequency) = (here, next, frequency + step);
    }
    found
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

    fn of(at: &[f64]) -> Vec<f64> {
        let periods = hidden_periods(&distinct(at.to_vec()), LONGEST[0]);
        periods
            .iter()
            .map(|p| (p * 100.0).round() / 100.0)
            .collect()
    }

    #[test]
    fn on_a_grid_the_parts_of_its_step_are_hidden() {
        assert_eq!(of(&[0.0, 50.0, 100.0, 250.0]), [25.0, 16.67, 12.5, 10.0]);
        // Few positions hide more.
        assert!(of(&[-55.0, -40.0, 15.0, 55.0]).contains(&5.0));
        // Rounded to a micrometre.
        assert_eq!(of(&[0.0, 33.333, 66.667, 133.333])[..2], [33.33, 16.67]);
        // One position beside the grid shows only some of what repeats within it: 523 is nearly a multiple of 25 and 12.5.
        let with_one: Vec<f64> = (0..=10).map(|k| f64::from(50 * k)).chain([523.0]).collect();
        assert_eq!(of(&with_one)[..2], [24.96, 12.48]);
        // Small steps with a wide gap are a grid, too.
        let rounded = (0..40).map(|k| (f64::from(k) * 1e4 / 3.0).round() * 1e-3);
        let with_gap: Vec<f64> = rounded.clone().chain(rounded.map(|x| x + 430.0)).collect();
        assert_eq!(of(&with_gap), [3.33, 1.67, 1.11]);
        assert_eq!(of(&[7.0]), [0.0; 0]);
        assert_eq!(of(&[]), [0.0; 0]);
    }

    #[test]
    fn positions_near_a_grid_hide_what_those_of_iso_230_2_show() {
        // Along 500 mm, steps of 50 mm with what is added at random; ISO 230-2 asks for as much as a screw has per turn.
        let random = [
            0.31, -0.82, 0.67, -0.13, 0.95, -0.48, 0.09, -0.96, 0.52, -0.27, 0.78,
        ];
        let with = |mm: f64| -> Vec<f64> {
            let targets = random
                .iter()
                .zip(0..)
                .map(|(r, k)| f64::from(50 * k) + mm * r);
            of(&targets.collect::<Vec<_>>())
        };
        assert_eq!(with(0.3).len(), 4);
        assert_eq!(with(5.0), [0.0; 0]);
        // Alternately beside the grid.
        let half = (0..=10).map(|k| f64::from(50 * k) + f64::from(k % 2) * 13.7);
        let half = of(&half.collect::<Vec<_>>());
        assert!(!half.contains(&25.0) && !half.contains(&10.0), "{half:?}");
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

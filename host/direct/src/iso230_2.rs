//! ISO 230-2: accuracy and repeatability of positioning, with the terms and symbols of its clause 3.

use crate::{AxisRuns, RunColumn};
use serde::Serialize;
use trueaxis_model::machine::Machine;
use trueaxis_model::numbers::extremes;

/// Results at one target position, in mm or rad like the readings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AtTarget {
    /// The target (mm or deg).
    pub target: f64,
    /// Mean deviations x̄ᵢ↑ and x̄ᵢ↓.
    pub mean: [Option<f64>; 2],
    /// Estimators sᵢ↑ and sᵢ↓ of the standard uncertainty of a run; require two runs.
    pub spread: [Option<f64>; 2],
    /// Reversal value Bᵢ = x̄ᵢ↑ − x̄ᵢ↓.
    pub reversal: Option<f64>,
    /// Repeatability Rᵢ↑ = 4sᵢ↑ and Rᵢ↓ = 4sᵢ↓, and Rᵢ = max(2sᵢ↑ + 2sᵢ↓ + |Bᵢ|, Rᵢ↑, Rᵢ↓).
    pub repeatability: [Option<f64>; 3],
}

/// Results for the axis as a whole, in mm or rad like the readings. Of two or three values the first is ↑ (after
/// positive travel), the second ↓, the third of both directions.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Analysis {
    /// Number of runs.
    pub runs: [usize; 2],
    /// Why the figures are not those of the standard, if they are not.
    pub not_to_the_standard: Option<String>,
    /// Target by target.
    pub targets: Vec<AtTarget>,
    /// Accuracy A: max(x̄ᵢ + 2sᵢ) − min(x̄ᵢ − 2sᵢ).
    pub accuracy: [Option<f64>; 3],
    /// Systematic positional deviation E: range of x̄ᵢ.
    pub systematic_deviation: [Option<f64>; 3],
    /// Repeatability R: the largest Rᵢ.
    pub repeatability: [Option<f64>; 3],
    /// Range M of the mean bidirectional deviations x̄ᵢ = (x̄ᵢ↑ + x̄ᵢ↓)/2.
    pub range_of_mean_deviations: Option<f64>,
    /// Reversal value B = max |Bᵢ|.
    pub reversal: Option<f64>,
    /// Mean reversal value B̄, with its sign.
    pub mean_reversal: Option<f64>,
}

const DIRECTIONS: [f64; 2] = [1.0, -1.0];

fn runs(line: &AxisRuns, direction: f64) -> impl Iterator<Item = &RunColumn> {
    let columns = line.columns.iter();
    columns.filter(move |run| run.direction == direction)
}

/// Evaluates the runs of an axis.
#[must_use]
pub fn analysis(line: &AxisRuns) -> Analysis {
    let targets: Vec<AtTarget> = (0..line.targets.len())
        .map(|i| AtTarget::new(line, i))
        .collect();
    // From the smallest to the largest of two numbers of each target, for each direction and both together.
    let ranges = |ends: &dyn Fn(&AtTarget, usize) -> Option<[f64; 2]>| {
        let [up, down] = [0, 1].map(|d| hull(targets.iter().map(|t| ends(t, d))));
        [up, down, hull([up, down])].map(size)
    };
    let largest = |values: &mut dyn Iterator<Item = Option<f64>>| {
        let values: Option<Vec<f64>> = values.collect();
        values?.into_iter().reduce(f64::max)
    };
    let reversals: Option<Vec<f64>> = targets.iter().map(|t| t.reversal).collect();
    let runs = DIRECTIONS.map(|d| runs(line, d).count());
    Analysis {
        runs,
        not_to_the_standard: not_to_the_standard(runs),
        accuracy: ranges(&|t, d| {
            let (x, s) = t.mean[d].zip(t.spread[d])?;
            Some([x - 2.0 * s, x + 2.0 * s])
        }),
        systematic_deviation: ranges(&|t, d| t.mean[d].map(|x| [x, x])),
        repeatability: [0, 1, 2].map(|d| largest(&mut targets.iter().map(|t| t.repeatability[d]))),
        range_of_mean_deviations: size(hull(targets.iter().map(|t| {
            let (up, down) = t.mean[0].zip(t.mean[1])?;
            Some([0.5 * (up + down); 2])
        }))),
        reversal: largest(&mut targets.iter().map(|t| t.reversal.map(f64::abs))),
        mean_reversal: reversals.and_then(|all| mean(&all)),
        targets,
    }
}

impl AtTarget {
    fn new(line: &AxisRuns, i: usize) -> Self {
        let values = DIRECTIONS.map(|d| runs(line, d).map(|run| run.readings[i]));
        let values = values.map(|values| values.collect::<Vec<f64>>());
        let mean = values.each_ref().map(|values| mean(values));
        let spread = values.each_ref().map(|values| spread(values));
        let reversal = mean[0].zip(mean[1]).map(|(up, down)| up - down);
        let [up, down] = spread.map(|s| s.map(|s| 4.0 * s));
        let both = spread[0].zip(spread[1]).zip(reversal);
        let both = both.map(|((up, down), b)| {
            let together = 2.0 * up + 2.0 * down + b.abs();
            together.max(4.0 * up).max(4.0 * down)
        });
        Self {
            target: line.targets[i],
            mean,
            spread,
            reversal,
            repeatability: [up, down, both],
        }
    }
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Standard deviation with n − 1.
fn spread(values: &[f64]) -> Option<f64> {
    let mean = mean(values).filter(|_| values.len() > 1)?;
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    Some((squares / (values.len() - 1) as f64).sqrt())
}

/// From the smallest to the largest of all ends, if all are known.
fn hull(ends: impl IntoIterator<Item = Option<[f64; 2]>>) -> Option<[f64; 2]> {
    let all: Option<Vec<[f64; 2]>> = ends.into_iter().collect();
    (all?.into_iter()).reduce(|[a, b], [low, high]| [a.min(low), b.max(high)])
}

fn size(ends: Option<[f64; 2]>) -> Option<f64> {
    ends.map(|[low, high]| high - low)
}

/// Number of runs in each direction that the standard asks for (ISO 230-2, 5.3.2).
const RUNS: usize = 5;

fn not_to_the_standard([up, down]: [usize; 2]) -> Option<String> {
    (up.max(down) < RUNS || up.min(down) != 0 && up.min(down) < RUNS).then(|| {
        format!("it asks for {RUNS} runs in each direction, these are {up} ↑ and {down} ↓")
    })
}

/// Fewer targets than the standard asks for: five per metre, and five at least, on a linear axis of up to 2 m (5.3.2); three,
/// five or eight on a rotary axis of up to 90°, 180° and more (5.3.4).
fn too_few_targets(targets: &[f64], is_rotary: bool) -> Option<String> {
    const LONG: f64 = 2000.0;
    let [low, high] = extremes(targets.iter().copied());
    let span = high - low;
    let least = match is_rotary {
        true if span <= 90.0 => 3,
        true if span <= 180.0 => 5,
        true => 8,
        false => ((span.min(LONG) / 200.0).ceil() as usize).max(5),
    };
    (targets.len() < least).then(|| {
        format!(
            "it asks for {least} targets on this length at least, these are {}",
            targets.len()
        )
    })
}

/// Targets with one and the same distance: periodic errors of this pitch, or a part of it, do not show (5.3.2).
fn equal_distances(targets: &[f64]) -> Option<String> {
    const SAME: f64 = 1e-3;
    let distances = targets.windows(2).map(|pair| pair[1] - pair[0]);
    let [least, most] = extremes(distances);
    (targets.len() > 2 && most - least < SAME).then(|| {
        "it asks for targets at unequal distances, so that periodic errors show".to_owned()
    })
}

/// An analysis as it is read: positions in mm or degrees, values in `unit`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AxisRecord {
    /// File of the runs.
    pub file: String,
    /// Letter of the axis.
    pub axis: char,
    /// `µm` or `µrad`.
    pub unit: &'static str,
    /// The figures.
    #[serde(flatten)]
    pub found: Analysis,
}

impl AxisRecord {
    /// Evaluates the runs of a file.
    #[must_use]
    pub fn of(machine: &Machine, file: &str, line: &AxisRuns) -> Self {
        let (factor, unit) = match line.setup.is_angular() {
            true => (1e6, "µrad"),
            false => (1e3, "µm"),
        };
        let mut found = analysis(line);
        let is_rotary = machine.axes[line.setup.moved].letter.is_rotary();
        let few = too_few_targets(&line.targets, is_rotary);
        let reasons = found.not_to_the_standard.into_iter().chain(few);
        let reasons = reasons.chain(equal_distances(&line.targets));
        let reasons: Vec<String> = reasons.collect();
        found.not_to_the_standard = (!reasons.is_empty()).then(|| reasons.join("; "));
        let of_targets = found.targets.iter_mut().flat_map(|t| {
            let pairs = t.mean.iter_mut().chain(&mut t.spread);
            pairs.chain([&mut t.reversal]).chain(&mut t.repeatability)
        });
        let triples = (found.accuracy.iter_mut())
            .chain(&mut found.systematic_deviation)
            .chain(&mut found.repeatability);
        let all = of_targets.chain(triples).chain([
            &mut found.range_of_mean_deviations,
            &mut found.reversal,
            &mut found.mean_reversal,
        ]);
        all.flatten().for_each(|value| *value *= factor);
        Self {
            file: file.to_owned(),
            axis: machine.axes[line.setup.moved].letter.char(),
            unit,
            found,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{MeasurementSetup, RunColumn};
    use nalgebra::Vector3;
    use trueaxis_model::explain::Sense;

    fn line(up: &[&[f64]], down: &[&[f64]]) -> AxisRuns {
        let columns = |direction: f64, rows: &[&[f64]]| -> Vec<RunColumn> {
            let runs = 0..rows.first().map_or(0, |row| row.len());
            let run = |k: usize| RunColumn {
                direction,
                readings: rows.iter().map(|row| row[k]).collect(),
            };
            runs.map(run).collect()
        };
        AxisRuns {
            setup: MeasurementSetup {
                moved: 0,
                sense: Sense::In(0),
                counts: 1.0,
                at: [0.0; 6],
                offset: Vector3::zeros(),
                keeps_slope: false,
            },
            targets: vec![0.0, 100.0, 250.0, 400.0, 500.0],
            columns: [columns(1.0, up), columns(-1.0, down)].concat(),
        }
    }

    const UP: [&[f64]; 5] = [
        &[0.0, 0.4, -0.2, 0.3, 0.0],
        &[2.1, 2.5, 1.9, 2.2, 2.3],
        &[5.0, 5.6, 4.8, 5.2, 5.4],
        &[3.1, 3.0, 3.7, 3.3, 3.4],
        &[7.9, 8.2, 8.4, 7.7, 8.3],
    ];
    const DOWN: [&[f64]; 5] = [
        &[-1.5, -1.1, -1.3, -1.8, -1.3],
        &[0.2, 0.6, 0.1, 0.5, 0.1],
        &[2.6, 3.0, 3.4, 2.9, 3.1],
        &[1.9, 1.2, 1.6, 1.5, 1.3],
        &[6.1, 6.6, 6.0, 6.4, 5.9],
    ];

    fn near(found: Option<f64>, expected: f64) -> bool {
        // Sums of ten numbers of size 10.
        found.is_some_and(|found| (found - expected).abs() < 1e-13)
    }

    /// Calculated by hand, in fractions: sums of squares divided by n − 1 = 4 are variances such as (0.1² + 0.3² +
    /// 0.3² + 0.2² + 0.1²)/4 = 0.06 at the first target.
    #[test]
    fn a_case_that_was_worked_out_by_hand_has_these_parameters() {
        let found = analysis(&line(&UP, &DOWN));
        let means = [[0.1, -1.4], [2.2, 0.3], [5.2, 3.0], [3.3, 1.5], [8.1, 6.2]];
        let variances: [[f64; 2]; 5] = [
            [0.06, 0.07],
            [0.05, 0.055],
            [0.1, 0.085],
            [0.075, 0.075],
            [0.085, 0.085],
        ];
        let reversals = [1.5, 1.9, 2.2, 1.8, 1.9];
        for (i, at) in found.targets.iter().enumerate() {
            for d in 0..2 {
                assert!(near(at.mean[d], means[i][d]), "{at:?}");
                assert!(near(at.spread[d], variances[i][d].sqrt()), "{at:?}");
                assert!(near(at.repeatability[d], 4.0 * variances[i][d].sqrt()));
            }
            assert!(near(at.reversal, reversals[i]), "{at:?}");
            let [up, down] = variances[i].map(f64::sqrt);
            assert!(near(
                at.repeatability[2],
                2.0 * up + 2.0 * down + reversals[i]
            ));
        }
        assert_eq!(found.runs, [5, 5]);
        // The third target has the largest spread ↑ and, with its reversal, in both directions.
        let third = 2.0 * 0.1_f64.sqrt() + 2.0 * 0.085_f64.sqrt() + 2.2;
        // Accuracies are from the first to the last target.
        let [first, last, top] = [0.06_f64, 0.07, 0.085].map(f64::sqrt);
        for (found, expected) in [
            (found.reversal, 2.2),
            (found.mean_reversal, (1.5 + 1.9 + 2.2 + 1.8 + 1.9) / 5.0),
            // The range of 0.1, 2.2, 5.2, 3.3, 8.1, of −1.4 … 6.2, and from −1.4 to 8.1.
            (found.systematic_deviation[0], 8.0),
            (found.systematic_deviation[1], 7.6),
            (found.systematic_deviation[2], 9.5),
            // From (0.1 − 1.4)/2 to (8.1 + 6.2)/2.
            (found.range_of_mean_deviations, 7.15 + 0.65),
            (found.repeatability[0], 4.0 * 0.1_f64.sqrt()),
            (found.repeatability[1], 4.0 * 0.085_f64.sqrt()),
            (found.repeatability[2], third),
            (found.accuracy[0], 8.1 + 2.0 * top - (0.1 - 2.0 * first)),
            (found.accuracy[1], 6.2 + 2.0 * top - (-1.4 - 2.0 * last)),
            (found.accuracy[2], 8.1 + 2.0 * top - (-1.4 - 2.0 * last)),
        ] {
            assert!(near(found, expected), "{found:?} {expected}");
        }
        // The same figure from another program.
        let other = (found.accuracy[2]).map(|a| (a - 10.612_245_452).abs());
        assert!(other.is_some_and(|off| off < 1e-9));
    }

    #[test]
    fn a_repeatability_of_one_direction_counts_if_it_is_larger() {
        let still: &[f64] = &[0.0; 5];
        let found = analysis(&line(&UP, &[still; 5]));
        // The first target: 2·√0.06 + 0 + 0.1 is less than 4·√0.06.
        assert!(near(
            found.targets[0].repeatability[2],
            4.0 * 0.06_f64.sqrt()
        ));
    }

    #[test]
    fn what_one_run_or_one_direction_does_not_tell_is_not_there() {
        let one: Vec<&[f64]> = UP.iter().map(|row| &row[..1]).collect();
        let found = analysis(&line(&one, &[]));
        assert_eq!(found.runs, [1, 0]);
        assert!(near(found.systematic_deviation[0], 7.9));
        for missing in [
            found.systematic_deviation[1],
            found.systematic_deviation[2],
            found.range_of_mean_deviations,
            found.reversal,
            found.mean_reversal,
            found.accuracy[0],
            found.accuracy[2],
            found.repeatability[0],
            found.repeatability[2],
        ] {
            assert_eq!(missing, None);
        }
    }

    #[test]
    fn targets_with_one_distance_are_not_to_the_standard() {
        assert!(equal_distances(&[0.0, 100.0, 200.0, 300.0]).is_some());
        assert!(equal_distances(&[0.0, 103.2, 198.7, 300.0]).is_none());
        // One distance is neither.
        assert!(equal_distances(&[0.0, 100.0]).is_none());
    }

    #[test]
    fn few_targets_are_not_to_the_standard() {
        let few = |end: f64, count: usize, is_rotary| {
            let targets: Vec<f64> = (0..count)
                .map(|k| end * k as f64 / (count - 1) as f64)
                .collect();
            too_few_targets(&targets, is_rotary).is_some()
        };
        for (end, least, is_rotary) in [
            (2.0, 5, false),
            (1000.0, 5, false),
            (1400.0, 7, false),
            (90.0, 3, true),
            (180.0, 5, true),
            (360.0, 8, true),
        ] {
            assert!(
                !few(end, least, is_rotary) && few(end, least - 1, is_rotary),
                "{end}"
            );
        }
    }
}

//! Single readings that the other runs contradict.

use crate::measurement::{AxisRuns, RunColumn};
use trueaxis_model::machine::Machine;
use trueaxis_model::numbers::{ascending, order};

/// A reading is named if it is off by more than this many standard deviations of all readings. These come from what three
/// quarters of all do not exceed, which a few outliers do not change; of two or three runs they are up to a half too small. So
/// normal scatter is named in less than one file of a thousand.
const DEVIATIONS: f64 = 8.0;
/// Standard deviation of normal scatter of which three quarters do not exceed 1.
const OF_QUARTER: f64 = 0.8693;
/// A smaller difference (mm or rad) is the rounding of simulated readings to 0.0001 µm.
const ROUNDED: f64 = 1e-6;

/// A reading, and how far it is from the others.
struct OffReading {
    /// Column and target (by index).
    at: [usize; 2],
    /// How far it is off (mm or rad).
    by: f64,
}

/// What to do about it.
pub const REMEDY: &str =
    "look at it, and leave the run out if it is a mistake: the mean has its part of it";

/// Names the reading that is farthest from the other runs in its direction, if it is far beyond the usual scatter.
pub fn outlying(machine: &Machine, line: &AxisRuns) -> Option<String> {
    let mut all = in_direction(line, 1.0);
    all.extend(in_direction(line, -1.0));
    let sizes: Vec<f64> = all.iter().map(|one| one.by.abs()).collect();
    let ranks = order(&sizes);
    let worst = &all[*ranks.last()?];
    // What an instrument rounds to is the smallest difference that is not zero, and half of all differences may be zero.
    let resolution = ranks.iter().map(|k| sizes[*k]).find(|size| *size > ROUNDED);
    let usual = (OF_QUARTER * sizes[ranks[3 * ranks.len() / 4]]).max(resolution?);
    if worst.by.abs() <= DEVIATIONS * usual {
        return None;
    }
    let (per_unit, unit) = match line.setup.is_angular() {
        true => (1e6, "µrad"),
        false => (1e3, "µm"),
    };
    let axis = &machine.axes[line.setup.moved];
    let [column, target] = worst.at;
    let direction = line.columns[column].direction;
    let before = line.columns[..=column].iter();
    let number = before.filter(|c| c.direction == direction).count();
    let sign = if direction < 0.0 { '-' } else { '+' };
    Some(format!(
        "the reading of run {sign}{number} at {} = {} differs by {:.2} {unit} from the other runs there, and readings usually differ by {:.2} {unit}",
        axis.letter,
        line.targets[target],
        worst.by.abs() * per_unit,
        usual * per_unit
    ))
}

/// The readings of the runs in a direction, if there are at least two of them: how far each is from the median at its
/// target, beyond what is common to its whole run.
fn in_direction(line: &AxisRuns, direction: f64) -> Vec<OffReading> {
    let runs: Vec<(usize, &RunColumn)> = (line.columns.iter().enumerate())
        .filter(|(_, run)| run.direction == direction)
        .collect();
    if runs.len() < 2 {
        return Vec::new();
    }
    let medians: Vec<f64> = (0..line.targets.len())
        .map(|target| median(runs.iter().map(|(_, run)| run.readings[target])))
        .collect();
    let of_run = |(column, run): &(usize, &RunColumn)| {
        let off: Vec<f64> = run
            .readings
            .iter()
            .zip(&medians)
            .map(|(r, m)| r - m)
            .collect();
        let common = median(off.iter().copied());
        let column = *column;
        let readings = off.into_iter().enumerate();
        let readings = readings.map(move |(target, off)| OffReading {
            at: [column, target],
            by: off - common,
        });
        readings.collect::<Vec<_>>()
    };
    runs.iter().flat_map(of_run).collect()
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    ascending(&mut values);
    let n = values.len();
    0.5 * (values[(n - 1) / 2] + values[n / 2])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::runs;
    use crate::measurement::MeasuredRuns;
    use rand::SeedableRng;
    use rand_pcg::Pcg64Mcg;
    use trueaxis_model::numbers::normal;

    fn mill() -> Machine {
        Machine::from_toml(include_str!("../../../examples/mill-21/machine.toml")).unwrap()
    }

    /// What is said of runs over eleven targets with normal scatter (µm), rounded to `step`, of which one may be off.
    fn said(runs: usize, scatter: f64, step: f64, seed: u64, off: f64) -> Option<String> {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let names = (1..=runs).flat_map(|k| [format!("+{k}"), format!("-{k}")]);
        let names: Vec<String> = names.collect();
        let mut text = format!(
            "# axis = \"X\"\n# reads = \"tool +X\"\n# unit = \"um\"\n# at = {{ Y = 150.0, Z = -200.0 }}\ntarget,{}\n",
            names.join(",")
        );
        for target in 0..11 {
            text += &(40 * target).to_string();
            for column in 0..names.len() {
                let bend = 0.1 * f64::from(target * target);
                // A whole run may have moved.
                let common = 0.5 * column as f64;
                let mut reading = bend + common + scatter * normal(&mut random);
                if (target, column) == (7, 2) {
                    reading += off;
                }
                text += &format!(",{:?}", (reading / step).round() * step);
            }
            text += "\n";
        }
        let machine = mill();
        let MeasuredRuns::Line(line) = runs::read(&text, &machine).unwrap() else {
            panic!("runs");
        };
        outlying(&machine, &line)
    }

    #[test]
    fn a_reading_that_the_other_runs_contradict_is_named() {
        for runs in [2, 3, 5] {
            let what = said(runs, 0.3, 1e-3, 1, 40.0).unwrap();
            assert!(
                what.starts_with("the reading of run +2 at X = 280"),
                "{what}"
            );
        }
        assert!(said(5, 0.05, 1.0, 1, 40.0).is_some());
    }

    #[test]
    fn normal_scatter_is_not_named() {
        let mut named = 0;
        for seed in 0..1000 {
            let runs = [2, 3, 5][seed as usize % 3];
            let step = [1e-4, 0.1, 1.0][(seed / 3) as usize % 3];
            let found = said(runs, 0.3, step, seed, 0.0);
            named += usize::from(found.is_some());
        }
        assert_eq!(named, 0);
        assert_eq!(said(1, 0.3, 1e-3, 1, 40.0), None);
    }
}

//! Simulated runs of a laser, straightedge, level, calibrator or square.

use crate::{AxisRuns, Means, Square};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use trueaxis_model::explain::Bench;
use trueaxis_model::machine::Machine;
use trueaxis_model::numbers::normal;

/// Disturbances of readings (mm, or rad for angles).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OfReadings {
    /// Standard deviation of a reading.
    pub noise: f64,
    /// Drift of the reading from the first to the last.
    pub drift: f64,
    /// Fraction of the readings, 0 to 1, that are off by an additional `outlier`.
    pub outliers: f64,
    /// Size of an outlier, of either sign.
    pub outlier: f64,
    /// Seed of the random numbers.
    pub seed: u64,
}

impl OfReadings {
    /// The disturbance of a reading at a fraction of the time, 0 to 1.
    pub(super) fn draw(&self, random: &mut Pcg64Mcg, time: f64) -> f64 {
        let noise = self.noise * normal(random);
        // Drawn unconditionally, so that the noise of a seed is the same with and without outliers.
        let (chance, up) = (random.random::<f64>(), random.random::<bool>());
        let outlier = match (chance < self.outliers, up) {
            (false, _) => 0.0,
            (true, true) => self.outlier,
            (true, false) => -self.outlier,
        };
        noise + outlier + self.drift * time
    }
}

/// Simulates the readings of a line, keeping its setup, targets and runs. A straightedge is aligned at both ends,
/// unless its slope is to be kept. `None` if linear axes cannot follow a ball.
#[must_use]
pub fn line(bench: &Bench<'_>, line: &AxisRuns, disturbed: &OfReadings) -> Option<AxisRuns> {
    let mut shown = line.shown(bench, &line.means().directions())?;
    if line.setup.is_straightness(bench.machine) && !line.setup.keeps_slope {
        let slope = ends(bench.machine, line, &shown);
        let positions = line.positions(bench.machine);
        shown.level(&positions, positions[0], slope);
    }
    let mut random = Pcg64Mcg::seed_from_u64(disturbed.seed);
    read(line, &shown, disturbed, &mut random)
}

/// Simulates the readings of a square that is aligned with its first line at both ends.
#[must_use]
pub fn square(bench: &Bench<'_>, square: &Square, disturbed: &OfReadings) -> Option<Square> {
    let mut random = Pcg64Mcg::seed_from_u64(disturbed.seed);
    let [a, b] = &square.lines;
    let mut along_a = a.shown(bench, &a.means().directions())?;
    let mut along_b = b.shown(bench, &b.means().directions())?;
    let slope = ends(bench.machine, a, &along_a);
    // In the direction of the second line the square is turned the other way, plus its own error.
    for (line, along, slope) in [
        (a, &mut along_a, slope),
        (b, &mut along_b, -slope - square.over),
    ] {
        let positions = line.positions(bench.machine);
        along.level(&positions, positions[0], slope);
    }
    let a = read(a, &along_a, disturbed, &mut random)?;
    let b = read(b, &along_b, disturbed, &mut random)?;
    Some(Square {
        lines: [a, b],
        over: square.over,
    })
}

/// The slope from the first to the last target.
fn ends(machine: &Machine, line: &AxisRuns, shown: &Means) -> f64 {
    let (positions, both) = (line.positions(machine), shown.both());
    let last = both.len() - 1;
    (both[last] - both[0]) / (positions[last] - positions[0])
}

/// Reads run after run, each in its direction.
fn read(
    line: &AxisRuns,
    shown: &Means,
    disturbed: &OfReadings,
    random: &mut Pcg64Mcg,
) -> Option<AxisRuns> {
    let mut line = line.clone();
    let count = line.targets.len();
    let last = ((count * line.columns.len()).max(2) - 1) as f64;
    let mut number = 0;
    for column in &mut line.columns {
        let values = shown.of(column.direction)?;
        column.readings = vec![0.0; count];
        for step in 0..count {
            let k = match column.direction > 0.0 {
                true => step,
                false => count - 1 - step,
            };
            column.readings[k] = values[k] + disturbed.draw(random, f64::from(number) / last);
            number += 1;
        }
    }
    Some(line)
}

//! Evenly spaced points of linear and cubic tables, and their cost.

use super::spline;
use super::variables::Variable;
use crate::cost::{CUBIC_BANK, CUBIC_TABLE, LINEAR_TABLE};
use trueaxis::SampleFormat;

/// Bytes of samples that cost as much as one instruction: a slot of 256 kB for at most 4000 instructions, which a
/// controller can spend in a tenth of a 4 kHz period.
pub const BYTES_PER_INSTRUCTION: f64 = 64.0;
/// A kink counts as on a point if it is off by less than this fraction of a step; the resulting error is an equally
/// small fraction of that permitted for interpolation.
pub const GRID_SLACK: f64 = 1e-3;
/// Limits on the number of intervals of a bent table.
pub const LEAST_INTERVALS: usize = 4;
pub const MOST_INTERVALS: usize = 8192;

/// Evenly spaced points over a variable's range, in its kinematic unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// The first point, at or before the lower end of the range.
    pub start: f64,
    /// Spacing of the points.
    pub step: f64,
    /// The number of points minus one; equal to it if the variable wraps.
    pub intervals: usize,
    /// Whether interpolation is cubic rather than linear.
    pub cubic: bool,
}

impl Grid {
    /// A grid from end to end of a range.
    pub fn over([low, high]: [f64; 2], intervals: usize) -> Self {
        Self {
            start: low,
            step: (high - low) / intervals as f64,
            intervals,
            cubic: false,
        }
    }

    /// The grid of a cubic table, which has no kinks: its intervals cover the range.
    pub(crate) fn cubic(variable: &Variable, intervals: usize) -> Self {
        Self {
            cubic: true,
            ..Self::over(
                variable.range,
                intervals.clamp(LEAST_INTERVALS, MOST_INTERVALS),
            )
        }
    }

    /// A grid with at least `least` intervals over the range and the ends of the calibrated range on points.
    pub fn even(variable: &Variable, least: usize) -> Self {
        let [low, high] = variable.range;
        let (Some(first), Some(last)) = (variable.ends.first(), variable.ends.last()) else {
            return Self::over(variable.range, least);
        };
        if variable.wraps {
            return Self::over(variable.range, least);
        }
        let step = (high - low) / least as f64;
        let between = ((last - first) / step - GRID_SLACK).ceil();
        let step = if between > 0.0 {
            (last - first) / between
        } else {
            step
        };
        Self::through(*first, step, variable.range)
    }

    /// A grid with a point at a given position, covering the range and up to one step beyond.
    fn through(point: f64, step: f64, [low, high]: [f64; 2]) -> Self {
        let before = ((point - low) / step - GRID_SLACK).ceil().max(0.0);
        let start = point - before * step;
        let intervals = ((high - start) / step - GRID_SLACK).ceil() as usize;
        Self {
            start,
            step,
            intervals: intervals.max(1),
            cubic: false,
        }
    }

    /// The coarsest grid that has all kinks of a variable on points: the measured positions, and those where motions
    /// begin to hold. `None` if nothing was measured or no such grid exists.
    pub(crate) fn through_kinks(variable: &Variable) -> Option<Self> {
        let [low, high] = variable.range;
        let first = *variable.kinks.first()?;
        if variable.kinks.len() <= variable.ends.len() {
            return None;
        }
        // If positions repeat, both ends are the same point.
        let ends = if variable.wraps { vec![high] } else { vec![] };
        let all: Vec<f64> = variable.kinks.iter().copied().chain(ends).collect();
        let gap = all
            .windows(2)
            .map(|w| w[1] - w[0])
            .fold(high - low, f64::min);
        (1..=4)
            .map(|parts| gap / f64::from(parts))
            .find(|step| {
                let on_point = |x: &f64| {
                    let steps = (x - first) / step;
                    (steps - steps.round()).abs() < GRID_SLACK
                };
                all.iter().all(on_point) && (!variable.wraps || on_point(&low))
            })
            .map(|step| {
                // Derive the step from the longest distance, because rounding of short ones accumulates.
                let last = all[all.len() - 1];
                let steps = ((last - first) / step).round();
                let step = if steps > 0.0 {
                    (last - first) / steps
                } else {
                    step
                };
                Self::through(first, step, variable.range)
            })
            .filter(|grid| grid.intervals <= MOST_INTERVALS)
    }

    /// Divides each interval into `parts`.
    pub fn divided(self, parts: usize) -> Self {
        Self {
            step: self.step / parts as f64,
            intervals: self.intervals * parts,
            ..self
        }
    }

    /// Number of samples of a table on this grid.
    pub fn samples(&self, wraps: bool) -> usize {
        match self.cubic {
            true => spline::count(self.intervals, wraps),
            false => self.intervals + usize::from(!wraps),
        }
    }

    /// The positions at which tables on this grid are sampled: its points, and for cubic tables also the midpoints
    /// between them.
    pub(crate) fn sampled_at(&self, wraps: bool) -> impl Iterator<Item = f64> + '_ {
        let (count, step) = match self.cubic {
            true => (spline::positions(self.intervals, wraps), 0.5 * self.step),
            false => (self.samples(wraps), self.step),
        };
        (0..count).map(move |i| self.start + step * i as f64)
    }

    /// The points in ascending order.
    pub fn points(&self) -> impl Iterator<Item = f64> + '_ {
        (0..=self.intervals).map(|i| self.start + self.step * i as f64)
    }
}

/// Cost of `tables` tables with `samples` samples each, in instructions: their evaluation and the storage of their
/// samples.
pub fn cost(tables: usize, samples: usize, cubic: bool, format: SampleFormat) -> f64 {
    let (bank, table) = match cubic {
        true => (CUBIC_BANK, CUBIC_TABLE),
        false => (0.0, LINEAR_TABLE),
    };
    bank + table * tables as f64 + stored(tables * samples, format)
}

/// Storage cost of samples, in instructions.
pub fn stored(samples: usize, format: SampleFormat) -> f64 {
    let bytes = match format {
        SampleFormat::F32 => 4,
        SampleFormat::I16 => 2,
    };
    (samples * bytes) as f64 / BYTES_PER_INSTRUCTION
}

#[cfg(test)]
mod tests {
    use super::super::specimen::{errors, machine, with_rotary};
    use super::super::variables::variables;
    use super::*;
    use trueaxis_model::kinematics::Kinematics;
    use trueaxis_model::machine::Machine;

    fn first(machine: &Machine, lines: &str) -> Variable {
        let errors = errors(machine, lines);
        variables(&Kinematics::new(machine, &errors), 1e-6).remove(0)
    }

    fn table(name: &str, at: &[f64]) -> String {
        let values = vec!["0.0"; at.len() - 1].join(", ");
        format!("[tabulated.{name}]\nat = {at:?}\nvalue = [{values}, 1e-3]\n")
    }

    fn has(grid: &Grid, x: f64) -> bool {
        grid.points().any(|p| (p - x).abs() < 1e-9)
    }

    #[test]
    fn a_grid_has_all_measured_points_and_no_more_than_they_ask_for() {
        let machine = with_rotary(&[]);
        let fine: Vec<f64> = (0..=50).map(|i| -200.0 + 8.0 * f64::from(i)).collect();
        let coarse: Vec<f64> = (0..=25).map(|i| -200.0 + 16.0 * f64::from(i)).collect();
        let lines = table("EXX", &fine) + &table("EYX", &coarse);
        let grid = Grid::through_kinks(&first(&machine, &lines)).unwrap();
        assert_eq!((grid.start, grid.intervals), (-200.0, 50));
        // Thirds of one and halves of the other coincide at every sixth.
        let third: Vec<f64> = (0..=75)
            .map(|i| -200.0 + 400.0 / 75.0 * f64::from(i))
            .collect();
        let lines = table("EXX", &fine) + &table("EYX", &third);
        let grid = Grid::through_kinks(&first(&machine, &lines)).unwrap();
        assert_eq!(grid.intervals, 150);
    }

    #[test]
    fn points_measured_on_a_part_of_the_travel_are_points_and_the_grid_covers_the_rest() {
        let machine = with_rotary(&[]);
        let variable = first(&machine, &table("EXX", &[-130.0, -60.0, 10.0, 80.0]));
        let grid = Grid::through_kinks(&variable).unwrap();
        assert!([-130.0, -60.0, 10.0, 80.0].iter().all(|x| has(&grid, *x)));
        let points: Vec<f64> = grid.points().collect();
        assert!(points[0] <= -200.0 && points[1] > -200.0);
        assert!(points[points.len() - 1] >= 200.0 && points[points.len() - 2] < 200.0);
    }

    #[test]
    fn uneven_points_on_a_common_step_share_a_grid_and_others_have_none() {
        let machine = machine(&[
            ('X', [-400.0, 400.0]),
            ('Y', [-200.0, 200.0]),
            ('Z', [-200.0, 200.0]),
        ]);
        let lines = table("EXX", &[-300.0, -100.0, 0.0, 200.0, 350.0]);
        let grid = Grid::through_kinks(&first(&machine, &lines)).unwrap();
        assert_eq!((grid.start, grid.step, grid.intervals), (-400.0, 50.0, 16));
        let lines = table("EXX", &[-300.0, -101.7, 3.3, 200.0, 350.0]);
        assert_eq!(Grid::through_kinks(&first(&machine, &lines)), None);
    }

    #[test]
    fn the_ends_of_a_calibrated_range_are_points_of_every_grid() {
        let machine = with_rotary(&[]);
        let lines = "[parameters]\nEYX2 = 1e-9\n[calibrated]\nX = [-133.0, 71.0]\n";
        let variable = first(&machine, lines);
        for least in [4, 7, 48, 1000] {
            let grid = Grid::even(&variable, least);
            assert!(has(&grid, -133.0) && has(&grid, 71.0), "{least}");
            assert!(grid.intervals >= least && grid.intervals < 2 * least + 4);
        }
        assert_eq!(Grid::through_kinks(&variable), None);
    }
}

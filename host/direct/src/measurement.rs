//! Measurements and how they were taken.

use nalgebra::Vector3;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::explain::{Bench, BenchState, Sense};
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_model::numbers::{extremes, student};

/// A measurement from one file.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurement {
    /// Name for messages.
    pub name: String,
    /// Content.
    pub measured: MeasuredRuns,
}

/// Content of a file.
#[derive(Clone, Debug, PartialEq)]
pub enum MeasuredRuns {
    /// An axis that moves, and an instrument.
    Line(AxisRuns),
    /// Two axes measured along the two legs of a square.
    Square(Square),
}

/// The setup of a measurement.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasurementSetup {
    /// The axis (by index) whose command moved.
    pub moved: usize,
    /// Direction of the reading: of the tool relative to the workpiece.
    pub sense: Sense,
    /// +1 if the instrument counts this direction as positive, −1 if the opposite. The readings of a [`RunColumn`]
    /// already have the sign of the tool.
    pub counts: f64,
    /// Positions of the other axes (mm, rad); for the moving axis, its position nearest to zero. If it is rotary and
    /// a displacement is read, linear axes follow the ball from there.
    pub at: PerAxis,
    /// The measured point relative to the tool tip of the machine file (mm, in the directions of the workpiece frame
    /// at this position); it moves with the tool.
    pub offset: Vector3<f64>,
    /// True if the slope of a straightness belongs to the machine, not to the alignment of the straightedge.
    pub keeps_slope: bool,
}

/// One run.
#[derive(Clone, Debug, PartialEq)]
pub struct RunColumn {
    /// Direction of travel: +1 or −1.
    pub direction: f64,
    /// Readings at the targets (mm or rad): how far the tool has gone too far relative to the workpiece.
    pub readings: Vec<f64>,
}

/// Runs of one axis.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisRuns {
    /// The setup.
    pub setup: MeasurementSetup,
    /// Target positions (mm or deg), increasing.
    pub targets: Vec<f64>,
    /// The runs.
    pub columns: Vec<RunColumn>,
}

/// A square: each axis moves along its leg and is read in the direction of the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Square {
    /// The two legs.
    pub lines: [AxisRuns; 2],
    /// Angle between the legs of the square itself, minus 90° (rad).
    pub over: f64,
}

/// Means of the runs (mm or rad) after positive and after negative travel, if there are such runs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Means(pub [Option<Vec<f64>>; 2]);

impl Means {
    /// The directions in which there are runs.
    #[must_use]
    pub fn directions(&self) -> Vec<f64> {
        let there = |direction: &f64| self.of(*direction).is_some();
        [1.0, -1.0].into_iter().filter(there).collect()
    }

    /// The mean for one direction.
    #[must_use]
    pub fn of(&self, direction: f64) -> Option<&Vec<f64>> {
        self.0[usize::from(direction < 0.0)].as_ref()
    }

    /// The mean of both directions, or of the only one.
    #[must_use]
    pub fn both(&self) -> Vec<f64> {
        match &self.0 {
            [Some(p), Some(n)] => p.iter().zip(n).map(|(p, n)| 0.5 * (p + n)).collect(),
            [Some(one), None] | [None, Some(one)] => one.clone(),
            [None, None] => Vec::new(),
        }
    }

    /// Takes a slope about `zero` off.
    pub(crate) fn level(&mut self, positions: &[f64], zero: f64, slope: f64) {
        for values in self.0.iter_mut().flatten() {
            for (value, q) in values.iter_mut().zip(positions) {
                *value -= slope * (q - zero);
            }
        }
    }
}

impl AxisRuns {
    /// Means of the runs, not set to zero at any target.
    #[must_use]
    pub fn means(&self) -> Means {
        let mean = |direction: f64| {
            let runs = self.columns.iter().filter(|c| c.direction == direction);
            let runs: Vec<&RunColumn> = runs.collect();
            let count = runs.len() as f64;
            (!runs.is_empty()).then(|| {
                let at = |k: usize| runs.iter().map(|c| c.readings[k]).sum::<f64>() / count;
                (0..self.targets.len()).map(at).collect()
            })
        };
        Means([1.0, -1.0].map(mean))
    }

    /// The target nearest to the axis' zero, at which errors are zero.
    #[must_use]
    pub fn zero(&self) -> usize {
        let size = |k: &usize| self.targets[*k].abs();
        let nearest = (0..self.targets.len()).min_by(|a, b| size(a).total_cmp(&size(b)));
        nearest.unwrap_or(0)
    }

    /// The targets in mm or rad.
    #[must_use]
    pub fn positions(&self, machine: &Machine) -> Vec<f64> {
        let axis = &machine.axes[self.setup.moved];
        self.targets.iter().map(|t| axis.to_kinematic(*t)).collect()
    }

    /// The reading (mm or rad) at every target on a machine with errors, with the same zero as [`Self::zeroed`].
    /// `None` if linear axes cannot follow a ball.
    #[must_use]
    pub fn shown(&self, bench: &Bench<'_>, directions: &[f64]) -> Option<Means> {
        let positions = self.positions(bench.machine);
        let zero = match directions {
            [one] => *one,
            _ => 0.0,
        };
        let from = self.setup.state(bench, positions[self.zero()], zero)?;
        let point = self.setup.point(bench);
        let all = |direction: f64| -> Option<Vec<f64>> {
            let all = positions.iter().map(|q| {
                let to = self.setup.state(bench, *q, direction)?;
                let deviation = bench.deviation_of(&point, &from, &to);
                Some(bench.reads(self.setup.sense, &deviation, &to.q))
            });
            all.collect()
        };
        let mut shown = Means::default();
        for direction in directions {
            shown.0[usize::from(*direction < 0.0)] = Some(all(*direction)?);
        }
        Some(self.zeroed(shown))
    }

    /// These means, with the mean of both directions zero at the target [`Self::zero`].
    #[must_use]
    pub fn zeroed(&self, mut means: Means) -> Means {
        let zero = means.both()[self.zero()];
        for value in means.0.iter_mut().flatten().flatten() {
            *value -= zero;
        }
        means
    }
}

impl MeasurementSetup {
    /// The measured point in the frame of the tool's pose (mm from the tip).
    #[must_use]
    pub fn point(&self, bench: &Bench<'_>) -> Vector3<f64> {
        bench.nominal(&self.at).r.transpose() * self.offset
    }

    /// The command for a position (mm, rad) of the axis, approached in a direction. `None` if the linear axes cannot
    /// follow a ball.
    #[must_use]
    pub fn state(&self, bench: &Bench<'_>, position: f64, direction: f64) -> Option<BenchState> {
        let mut state = BenchState::at(self.at).with(self.moved, position);
        state.sign[self.moved] = direction;
        let rotary = bench.machine.axes[self.moved].letter.is_rotary();
        if rotary && matches!(self.sense, Sense::In(_)) {
            let point = self.point(bench);
            let met = bench.nominal(&self.at);
            let ball = met.t + met.r * point;
            let tip = ball - bench.nominal(&state.q).r * point;
            state.q = bench.reach(&state.q, tip)?;
        }
        Some(state)
    }

    /// True if an angle is read.
    #[must_use]
    pub fn is_angular(&self) -> bool {
        !matches!(self.sense, Sense::In(_))
    }

    /// True if the reading is along or about the moving axis.
    #[must_use]
    pub fn is_positioning(&self) -> bool {
        matches!(self.sense, Sense::In(axis) | Sense::About(axis) if axis == self.moved)
    }

    /// True if the instrument is read against a straightedge, which has been aligned in some way. An axis that moves
    /// in nearly the same direction, such as a quill, has none.
    #[must_use]
    pub fn is_straightness(&self, machine: &Machine) -> bool {
        const ALONG: f64 = 0.5;
        let Sense::In(axis) = self.sense else {
            return false;
        };
        let perfect = ErrorModel::perfect(machine);
        let bench = Bench::new(machine, &perfect, Default::default());
        let rotary = machine.axes[self.moved].letter.is_rotary();
        let [own, read] = [self.moved, axis].map(|i| bench.way(&self.at, i));
        !rotary && own.dot(&read).abs() < ALONG
    }

    /// The direction of the reading as text: `tool +X`, `tool +Y to +Z`.
    #[must_use]
    pub fn words(&self, machine: &Machine) -> String {
        let letter = |axis: usize| machine.axes[axis].letter;
        let is_negative = self.counts < 0.0;
        match self.sense {
            Sense::In(axis) | Sense::About(axis) => {
                let sign = if is_negative { '-' } else { '+' };
                format!("tool {sign}{}", letter(axis))
            }
            Sense::From(a, b) => {
                let [a, b] = if is_negative { [b, a] } else { [a, b] };
                format!("tool +{} to +{}", letter(a), letter(b))
            }
        }
    }
}

/// Least-squares slope of values over positions.
#[must_use]
pub fn slope(positions: &[f64], values: &[f64]) -> f64 {
    let count = positions.len() as f64;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / count;
    let (q, v) = (mean(positions), mean(values));
    let pairs = positions.iter().zip(values);
    let along: f64 = pairs.map(|(p, w)| (p - q) * (w - v)).sum();
    let across: f64 = positions.iter().map(|p| (p - q).powi(2)).sum();
    along / across
}

/// The step of the display that readings (mm or rad) were taken from: the largest of 1, 2 and 5 times a power of ten mm or
/// rad, or seconds of arc, of which all are multiples; 0 if there is none, or they are all alike.
fn display_step(readings: &[f64], is_angular: bool) -> f64 {
    const SECOND: f64 = std::f64::consts::PI / 648_000.0;
    let [low, high] = extremes(readings.iter().copied());
    let fits = |step: f64| {
        let is_multiple = |x: &f64| (x / step - (x / step).round()).abs() < 1e-6;
        step <= high - low && readings.iter().all(is_multiple)
    };
    let units = if is_angular {
        &[1.0, SECOND][..]
    } else {
        &[1.0]
    };
    let powers = (-9..=1)
        .rev()
        .flat_map(|k| [5, 2, 1].map(|digit| f64::from(digit) * 10_f64.powi(k)));
    let steps = units
        .iter()
        .flat_map(|unit| powers.clone().map(move |power| unit * power));
    steps.filter(|step| fits(*step)).fold(0.0, f64::max)
}

/// Standard uncertainty (mm or rad) of a weighted sum over the targets, of the mean of both directions or half of their
/// difference: from the scatter of readings, or of the sums of single runs, each of which may have an offset or a drift. A
/// standard deviation of few runs is little known, so that of the sums is what Student's factor makes of it.
pub(crate) fn sum_uncertainty(line: &AxisRuns, weights: &[f64]) -> Option<f64> {
    let size = weights.iter().map(|w| w * w).sum::<f64>().sqrt();
    let of_readings = mean_uncertainty(line)? * size;
    let sum = |run: &RunColumn| RunColumn {
        direction: run.direction,
        readings: vec![run.readings.iter().zip(weights).map(|(r, w)| r * w).sum()],
    };
    let sums = AxisRuns {
        columns: line.columns.iter().map(sum).collect(),
        targets: vec![0.0],
        setup: line.setup.clone(),
    };
    let directions = line.means().directions().len();
    let freedom = line.columns.len().saturating_sub(directions);
    let of_runs = mean_scatter(&sums)? * student(freedom) / 1.96;
    Some(of_readings.max(of_runs) / (directions as f64).sqrt())
}

/// Standard uncertainty (mm or rad) of the mean of the runs in one direction, from the scatter of all runs and the step of
/// the display. Readings that a coarse display rounds alike scatter less than they are off.
pub(crate) fn mean_uncertainty(line: &AxisRuns) -> Option<f64> {
    let readings: Vec<f64> = line
        .columns
        .iter()
        .flat_map(|run| run.readings.iter().copied())
        .collect();
    let step = display_step(&readings, line.setup.is_angular());
    Some(libm::hypot(mean_scatter(line)?, step / 12.0_f64.sqrt()))
}

/// The part of the scatter of all runs.
fn mean_scatter(line: &AxisRuns) -> Option<f64> {
    let (mut squares, mut freedom, mut least) = (0.0, 0, usize::MAX);
    let means = line.means();
    for direction in means.directions() {
        let mean = means.of(direction)?;
        let mut runs = 0;
        for run in line.columns.iter().filter(|c| c.direction == direction) {
            let pairs = run.readings.iter().zip(mean);
            squares += pairs.map(|(r, m)| (r - m).powi(2)).sum::<f64>();
            runs += 1;
        }
        freedom += (runs - 1) * mean.len();
        least = least.min(runs);
    }
    (freedom > 0).then(|| (squares / freedom as f64 / least as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_pcg::Pcg64Mcg;
    use trueaxis_model::numbers::normal;

    #[test]
    fn the_step_of_a_display_is_seen_in_its_readings() {
        let step = |um: &[f64], is_angular| {
            let readings: Vec<f64> = um.iter().map(|r| r * 1e-3).collect();
            display_step(&readings, is_angular) * 1e3
        };
        for (readings, expected) in [
            (&[0.0, 3.0, -1.0][..], 1.0),
            (&[0.0, 4.0, -2.0], 2.0),
            (&[0.3, -0.1, 12.4], 0.1),
            (&[0.0, 0.0], 0.0),
            (&[0.123_456_78, 5.0], 0.0),
        ] {
            let found = step(readings, false);
            assert!((found - expected).abs() < 1e-4, "{readings:?}: {found}");
        }
        let second = std::f64::consts::PI / 648_000.0;
        let found = display_step(&[0.1 * second, -0.7 * second, 1.2 * second], true);
        assert!((found / second - 0.1).abs() < 1e-9);
    }

    #[test]
    fn twice_the_uncertainty_of_a_backlash_contains_what_runs_with_offsets_are_off() {
        const FILES: usize = 400;
        const TARGETS: usize = 11;
        let same = [1.0 / TARGETS as f64; TARGETS];
        let mut random = Pcg64Mcg::seed_from_u64(3);
        // Noise, offsets of whole runs, step of the display (µm).
        for [noise, offset, step] in [
            [0.3, 0.0, 1e-4],
            [0.3, 0.5, 1e-4],
            [0.05, 0.5, 0.1],
            [0.05, 0.0, 1.0],
        ] {
            let mut reading = |k: usize, true_um: f64| {
                let shown = 3.7 * libm::sin(1.7 * k as f64) + true_um + noise * normal(&mut random);
                1e-3 * (shown / step).round() * step
            };
            let mut off = Pcg64Mcg::seed_from_u64(4);
            let mut run = |k: usize| {
                let direction = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
                // A backlash that no step of the display divides.
                let true_um = 0.337 * direction + offset * normal(&mut off);
                RunColumn {
                    direction,
                    readings: (0..TARGETS).map(|k| reading(k, true_um)).collect(),
                }
            };
            let mut contained = 0;
            for _ in 0..FILES {
                let line = AxisRuns {
                    setup: MeasurementSetup {
                        moved: 0,
                        sense: Sense::In(0),
                        counts: 1.0,
                        at: PerAxis::default(),
                        offset: Vector3::zeros(),
                        keeps_slope: false,
                    },
                    targets: (0..TARGETS).map(|k| 50.0 * k as f64).collect(),
                    columns: (0..10).map(&mut run).collect(),
                };
                let Means([Some(positive), Some(negative)]) = line.means() else {
                    unreachable!("runs in both directions");
                };
                let pairs = positive.iter().zip(&negative);
                let backlash = pairs.map(|(p, n)| 0.5 * (p - n)).sum::<f64>() / TARGETS as f64;
                let uncertainty = sum_uncertainty(&line, &same).unwrap();
                contained += usize::from((backlash - 0.337e-3).abs() <= 2.0 * uncertainty);
            }
            // 95 % of 400 is 380, ± 9 with twice the standard deviation of a count.
            assert!(contained >= 371, "{noise} {offset} {step}: {contained}");
        }
    }
}

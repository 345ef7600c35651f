//! Warnings about measurements.

use crate::block::gains;
use crate::iso230_2::analysis;
use crate::measurement::{AxisRuns, slope};
use crate::motion::{FoundMotion, name};
use crate::outlying::{REMEDY, outlying};
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_pcg::Pcg64Mcg;
use std::cmp::Ordering;
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind};
use trueaxis_model::explain::Bench;
use trueaxis_model::machine::Machine;
use trueaxis_model::numbers::extremes;

/// A warning.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{what}")]
pub struct Doubt {
    /// The measurement (by index) that it is about.
    pub file: Option<usize>,
    /// What is doubtful.
    pub what: String,
    /// What to do about it.
    pub remedy: &'static str,
}

/// A part of a turn without targets is a gap if it exceeds this many of the largest steps between targets.
const GAP: f64 = 2.0;
/// Levers (mm) and fractions below these are within the accuracy of a setup.
const LEVER: f64 = 1.0;
const PART: f64 = 0.01;
/// Slopes (rad) below this are ignored.
const LEANS: f64 = 1e-6;

/// Warnings about the measured motions, and about all errors including those known before.
pub fn doubts(
    machine: &Machine,
    lines: &[(usize, &AxisRuns)],
    motions: &[FoundMotion],
    errors: &ErrorModel,
) -> Vec<Doubt> {
    let mut doubts = short(machine);
    doubts.extend((lines.iter()).flat_map(|(file, line)| of_readings(machine, *file, line)));
    for (file, line) in lines.iter().filter(|(_, line)| !line.setup.is_angular()) {
        let axis = line.setup.moved;
        let from = motions.iter().find(|m| m.from == *file);
        let shown = from.map_or_else(|| line.setup.words(machine), |m| m.name(machine));
        let unknown = (0..6).filter(|c| errors.motions[axis][*c].is_zero());
        for component in unknown {
            let gains = gains(machine, line, component).unwrap_or_default();
            let most = largest(&gains);
            let motion = name(machine, axis, component);
            let (what, remedy) = match component >= 3 {
                true if most.abs() > LEVER => (
                    format!(
                        "{:.1} µm for each 10 µrad of it are in {shown}, with a lever of {most:.0} mm",
                        most.abs() * 1e-2
                    ),
                    "measure it too, or give its known value with --update: the result is for the measured line",
                ),
                false if most.abs() > PART => (
                    format!("{:.0} % of it are in {shown}", most.abs() * 1e2),
                    "measure it too, or give its known value with --update",
                ),
                _ => continue,
            };
            doubts.push(Doubt {
                file: Some(*file),
                what: format!("{motion} is not known: {what}"),
                remedy,
            });
        }
    }
    doubts.extend((motions.iter()).filter_map(|motion| gap(machine, motion)));
    doubts.extend((motions.iter()).filter_map(|motion| hardly_covered(machine, motion)));
    doubts.extend(counted_twice(machine, errors));
    doubts
}

/// The value with the largest size, with its sign.
fn largest(values: &[f64]) -> f64 {
    let larger = |most: f64, v: &f64| if v.abs() > most.abs() { *v } else { most };
    values.iter().fold(0.0, larger)
}

/// A part of a turn in which an endless axis was not measured.
fn gap(machine: &Machine, motion: &FoundMotion) -> Option<Doubt> {
    let axis = &machine.axes[motion.axis];
    let [low, high] = axis.travel.map(|t| axis.to_kinematic(t));
    let steps = motion.at.windows(2).map(|w| w[1] - w[0]);
    let step = steps.fold(0.0, f64::max);
    let gap = (high - low) - (motion.at[motion.at.len() - 1] - motion.at[0]);
    (axis.modulo && gap > GAP * step).then(|| Doubt {
        file: Some(motion.from),
        what: format!(
            "{} was not measured over {:.0}° of the turn: a straight line is assumed there",
            motion.name(machine),
            gap.to_degrees()
        ),
        remedy: "measure the whole turn if that matters",
    })
}

/// Targets over less than this part of a linear travel: inches that are taken for mm cover a twenty-fifth.
const COVERED: f64 = 0.1;

/// A linear axis that was measured over a small part of its travel.
fn hardly_covered(machine: &Machine, motion: &FoundMotion) -> Option<Doubt> {
    let axis = &machine.axes[motion.axis];
    let travel = axis.travel[1] - axis.travel[0];
    let covered = motion.at[motion.at.len() - 1] - motion.at[0];
    let is_linear = !axis.letter.is_rotary();
    (is_linear && covered < COVERED * travel).then(|| Doubt {
        file: Some(motion.from),
        what: format!(
            "{} was measured over {covered:.1} of {travel:.0} mm, and is taken for constant beyond",
            motion.name(machine),
        ),
        remedy: "write the targets in mm, if they are not; otherwise measure the whole travel",
    })
}

/// A linear travel (mm) is shorter than that of any machine tool with a tool of this length (mm).
const SHORT: f64 = 10.0;

fn short(machine: &Machine) -> Vec<Doubt> {
    let tip = nalgebra::Vector3::from(machine.tip).norm();
    let linear = machine.axes.iter().filter(|a| !a.letter.is_rotary());
    let travels = linear.map(|a| (a.letter, a.travel[1] - a.travel[0]));
    let short = travels.filter(|(_, travel)| travel.abs() < SHORT && tip > SHORT);
    let doubt = short.map(|(axis, travel)| {
        let unit = if travel < 2.0 { "metres" } else { "metres or inches" };
        Doubt {
            file: None,
            what: format!(
                "{axis} travels {travel:.3} mm, and the tip of the tool is {tip:.0} mm from the spindle: its range looks like {unit}"
            ),
            remedy: "write `range` and all other lengths of the machine file in mm; if the axis is as short, ignore this",
        }
    });
    doubt.collect()
}

/// Deviations of a working machine are less than this (mm or rad) ...
const GROSS: f64 = 0.3;
const GROSS_ANGLE: f64 = 5e-3;
/// ... and scatter over runs and targets by more than this (mm or rad): the resolution of any instrument for machine tools ...
const FINE: f64 = 5e-5;
/// ... and by more than this (mm or rad) from run to run (standard deviation): no machine returns to a position as well.
const REPEATS: f64 = 5e-6;
/// Less than that is the rounding of simulated readings to 0.0001 µm.
const SAME: f64 = 3e-8;
/// Less than this part of [`FINE`] is rounding, of simulated readings without noise.
const ROUNDED: f64 = 6e-3;

/// What is doubtful of readings by themselves; `file` is the index of the measurement.
#[must_use]
pub fn of_readings(machine: &Machine, file: usize, line: &AxisRuns) -> Vec<Doubt> {
    let outlying = outlying(machine, line).map(|what| Doubt {
        file: Some(file),
        what,
        remedy: REMEDY,
    });
    let misread = misread(machine, file, line);
    let drift = drift(machine, file, line);
    misread.into_iter().chain(drift).chain(outlying).collect()
}

/// Of so many orders of the runs, drawn at random ...
const ORDERS: usize = 5000;
/// ... this part may look as much like a warm-up as the order in which they were made. Five cycles have 120 orders.
const BY_CHANCE: f64 = 0.02;
/// How quickly a machine warms up, as parts of the time of all runs; the last hardly differs from a straight line.
const TIMES: [f64; 5] = [0.05, 0.1, 0.2, 0.5, 2.0];

/// Readings that change with the order of the runs, which repeatability does not: a machine or an instrument that is warming
/// up. What most of the scatter has in common is one number for each run (the first singular vector); its correlation with
/// an exponential is compared with those of other orders (a permutation test). A run in each direction is one cycle, whose
/// runs may have something in common and keep together.
fn drift(machine: &Machine, file: usize, line: &AxisRuns) -> Option<Doubt> {
    let (runs, targets) = (line.columns.len(), line.targets.len());
    let groups = [1.0, -1.0].map(|direction| {
        let all = (0..runs).filter(|run| line.columns[*run].direction == direction);
        all.collect::<Vec<usize>>()
    });
    // The runs of each cycle; in a file of other numbers of runs, those in the direction with most.
    let [some, others] = &groups;
    let cycles: Vec<Vec<usize>> = match some.len().cmp(&others.len()) {
        Ordering::Equal => some.iter().zip(others).map(|(a, b)| vec![*a, *b]).collect(),
        Ordering::Greater => some.iter().map(|run| vec![*run]).collect(),
        Ordering::Less => others.iter().map(|run| vec![*run]).collect(),
    };
    let count = cycles.len();
    if count < 2 || targets == 0 {
        return None;
    }
    // Cycles × their readings, less the mean of each.
    let width = cycles[0].len() * targets;
    let mut scatter = DMatrix::from_fn(count, width, |cycle, k| {
        line.columns[cycles[cycle][k / targets]].readings[k % targets]
    });
    for mut column in scatter.column_iter_mut() {
        let mean = column.mean();
        column.add_scalar_mut(-mean);
    }
    let parts = scatter.clone().svd(true, false);
    let score = parts.u?.column(parts.singular_values.imax()).into_owned();
    let shapes = TIMES.map(|time| {
        let shape = DVector::from_fn(count, |cycle, _| {
            libm::exp(-(cycle as f64) / (time * count as f64))
        });
        shape.add_scalar(-shape.mean()).normalize()
    });
    let is_like = |score: &DVector<f64>| {
        let alike = shapes.iter().map(|shape| shape.dot(score).abs());
        alike.fold(0.0, f64::max)
    };
    let found = is_like(&score);
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let mut other = score.clone();
    let mut as_much = 0;
    for _ in 0..ORDERS {
        other.as_mut_slice().shuffle(&mut random);
        // But for rounding.
        as_much += usize::from(is_like(&other) >= found * (1.0 - 1e-9));
    }
    if as_much as f64 > BY_CHANCE * ORDERS as f64 {
        return None;
    }
    let most = scatter.tr_mul(&score).iamax() % targets;
    let reading = |run: &usize| line.columns[*run].readings[most];
    let [first, last] = [&cycles[0], &cycles[count - 1]];
    let changes = first
        .iter()
        .zip(last)
        .map(|(first, last)| reading(last) - reading(first));
    let change = changes.sum::<f64>() / first.len() as f64;
    let letter = machine.axes[line.setup.moved].letter;
    let (unit, per_unit) = match line.setup.is_angular() {
        true => ("µrad", 1e6),
        false => ("µm", 1e3),
    };
    Some(Doubt {
        file: Some(file),
        what: format!(
            "the readings of {letter} change with the order of the runs, at {} by {:.1} {unit} from the first to the last: their mean belongs to no state of the machine, and an uncertainty from their scatter is too small",
            line.targets[most],
            change * per_unit
        ),
        remedy: "measure once machine and instrument are warm",
    })
}

/// Readings that are in another unit than their file declares.
fn misread(machine: &Machine, file: usize, line: &AxisRuns) -> Option<Doubt> {
    let axis = machine.axes[line.setup.moved].letter;
    let is_angle = line.setup.is_angular();
    let (gross, unit, small, per_unit) = match is_angle {
        true => (GROSS_ANGLE, "µrad", 1e-3, 1e6),
        false => (GROSS, "µm", 1.0, 1e3),
    };
    let doubt = |what: String, remedy: &'static str| {
        Some(Doubt {
            file: Some(file),
            what: format!("the readings of {axis} {what}"),
            remedy,
        })
    };
    let all = line.columns.iter().flat_map(|column| &column.readings);
    let [low, high] = extremes(all.copied());
    let range = high - low;
    if range > gross {
        return doubt(
            format!(
                "vary by {:.0} {unit}: no working machine does that, and with a unit a thousand times smaller they would vary by {:.2} {unit}",
                range * per_unit,
                range * per_unit * 1e-3
            ),
            "correct `unit`, if it is another one",
        );
    }
    if range == 0.0 && line.targets.len() > 2 {
        return doubt(
            format!(
                "are {:.4} {unit} everywhere: no machine is as good",
                low * per_unit
            ),
            "look whether the instrument was read",
        );
    }
    let rounded = FINE * ROUNDED * small;
    let too_fine = |[what, then]: [&str; 2], value: f64| {
        doubt(
            format!(
                "{what} by {:.4} {unit}: no machine is as good, and in a unit a thousand times larger they would {then} by {:.2} {unit}",
                value * per_unit,
                value * per_unit * 1e3
            ),
            "correct `unit`, if it is another one: \"mm\" for readings in mm",
        )
    };
    if range > rounded && range < FINE * small {
        return too_fine(["vary in all", "vary"], range);
    }
    let spreads = analysis(line).targets.into_iter().flat_map(|t| t.spread);
    let squares: Vec<f64> = spreads.flatten().map(|s| s * s).collect();
    let repeats = (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt();
    if repeats > SAME * small && repeats < REPEATS * small {
        return too_fine(["differ from run to run", "differ"], repeats);
    }
    None
}

/// Tabulated straightness with a slope, together with a squareness of the same axes, whatever the source of the errors.
#[must_use]
pub fn counted_twice(machine: &Machine, errors: &ErrorModel) -> Vec<Doubt> {
    let linear = |i: &usize| !machine.axes[*i].letter.is_rotary();
    let all: Vec<usize> = (0..machine.axes.len()).filter(linear).collect();
    let is_squareness = |p: &Parameter| p.kind == ParameterKind::Inter && p.is_angular();
    let locations = errors.parameters.iter();
    let locations = locations.filter(|(p, value)| is_squareness(p) && **value != 0.0);
    let locations: Vec<(Parameter, f64)> = locations.map(|(p, v)| (*p, *v)).collect();
    let mut doubts = Vec::new();
    for moved in &all {
        let axis = &machine.axes[*moved];
        for component in (0..3).filter(|c| *c != axis.letter.component()) {
            let Some(table) = &errors.motions[*moved][component].table else {
                continue;
            };
            let slope = mean_slope(table);
            if slope.abs() < LEANS {
                continue;
            }
            let leaning = Parameter {
                component,
                axis: axis.letter.char(),
                kind: ParameterKind::Degree(1),
            };
            let aligned = all.iter().filter(|other| *other != moved);
            let mut pairs = aligned.map(|aligned| [*aligned, *moved]);
            let pair = pairs.find(|pair| shown(machine, leaning, *pair) > 0.5);
            for (location, value) in &locations {
                if pair.is_some_and(|pair| shown(machine, *location, pair) > 0.5) {
                    doubts.push(Doubt {
                        file: None,
                        what: format!(
                            "{} leans by {:.1} µrad and {location} is {:.1} µrad: both are the squareness of the same axes, which may be counted twice",
                            name(machine, *moved, component),
                            slope * 1e6,
                            value * 1e6
                        ),
                        remedy: "take the slope off the straightness, or leave the squareness out; or write `slopes_beside_squareness = true` into the file if they belong together",
                    });
                }
            }
        }
    }
    doubts
}

/// The reading of a square along the second axis per unit of a parameter.
fn shown(machine: &Machine, parameter: Parameter, [aligned, moved]: [usize; 2]) -> f64 {
    const SMALL: f64 = 1e-6;
    let mut small = ErrorModel::perfect(machine);
    small.set(machine, parameter, SMALL);
    let bench = Bench::new(machine, &small, Default::default());
    let span = bench.span(moved, bench.travel(moved));
    bench.square(aligned, moved, span).size() / (SMALL * trueaxis_model::explain::REACH)
}

/// The slope of the mean of both directions.
fn mean_slope(table: &trueaxis_model::errors::Table) -> f64 {
    let negative = table.negative.as_ref().unwrap_or(&table.positive);
    let both = (table.positive.iter())
        .zip(negative)
        .map(|(p, n)| 0.5 * (p + n));
    slope(&table.at, &both.collect::<Vec<f64>>())
}

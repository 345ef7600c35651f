//! Simulates common machine tests, before and with the tables: circles (ISO 230-4), body diagonals (ISO 230-6),
//! positioning of linear axes (ISO 230-2).

use super::Subject;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use trueaxis_direct::ballbar::{BallBar, BallBarTurns, Circle, PathPoint, tip};
use trueaxis_direct::iso230_2::analysis;
use trueaxis_direct::{AxisRuns, MeasurementSetup, RunColumn};
use trueaxis_model::explain::{Bench, Sense};
use trueaxis_model::machine::{Axis, PerAxis};
use trueaxis_model::validate::Runtime;

/// Lengths of ball-bars (mm); the longest that the travels permit is used.
const BARS: [f64; 6] = [300.0, 250.0, 150.0, 100.0, 50.0, 25.0];
/// Steps per turn: of 1.5°, so that the middles of quadrants are included.
const STEPS: i32 = 240;
/// Number of steps before and after a turn.
const OVERSHOOT: i32 = 30;
/// Number of targets along an axis and along a diagonal.
const TARGETS: u32 = 20;
/// Planes of the circles, by the places of their axes among X, Y and Z.
const PLANES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];
/// Directions of the body diagonals along X, Y and Z.
const DIAGONALS: [[f64; 3]; 4] = [
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, -1.0],
];

/// Predicted test results.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tests {
    /// Positions of axes that do not move, and centre of the circles (mm, deg): `X = 0, …`.
    pub at: String,
    /// Circles.
    pub circles: Vec<CircularTest>,
    /// Body diagonals of the working volume of X, Y and Z.
    pub diagonals: Vec<Diagonal>,
    /// Linear axes.
    pub positioning: Vec<Positioning>,
}

/// A circular test in both directions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CircularTest {
    /// `XY`, `YZ` or `ZX`; angles are measured from the first towards the second axis.
    pub plane: String,
    /// Radius of the path.
    pub radius_mm: f64,
    /// Without tables.
    pub before: CircleFound,
    /// With the tables.
    pub after: Option<CircleFound>,
}

/// Results of a circular test.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CircleFound {
    /// Bidirectional circular deviation G(b).
    pub deviation_um: f64,
    /// Radial deviations F: largest and smallest.
    pub radial_um: [f64; 2],
    /// Circular hysteresis H.
    pub hysteresis_um: f64,
    /// Angles (deg) of both turns; the second runs backwards.
    pub angles_deg: Vec<f64>,
    /// Radial deviations there, from the nominal radius.
    pub readings_um: Vec<f64>,
}

/// A body diagonal, travelled both ways.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Diagonal {
    /// Directions: `+X+Y−Z`.
    pub name: String,
    /// Length of the body diagonal.
    pub length_mm: f64,
    /// Positions along it from its start.
    pub at_mm: Vec<f64>,
    /// Deviations along it without tables: outward, and back.
    pub before_um: [Vec<f64>; 2],
    /// Like `before_um`, with the tables.
    pub after_um: Option<[Vec<f64>; 2]>,
    /// Range of all deviations, before: the bidirectional systematic deviation E of ISO 230-6.
    pub systematic_before_um: f64,
    /// Like `systematic_before_um`, with the tables.
    pub systematic_after_um: Option<f64>,
}

/// A linear axis, travelled both ways.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Positioning {
    /// Letter of the linear axis.
    pub axis: char,
    /// Targets.
    pub at_mm: Vec<f64>,
    /// Without tables.
    pub before: PositioningFound,
    /// With the tables.
    pub after: Option<PositioningFound>,
}

/// Results according to ISO 230-2. A model has no scatter, so accuracy A is E, and repeatability R is B.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PositioningFound {
    /// Deviations after positive and after negative travel.
    pub deviations_um: [Vec<f64>; 2],
    /// Bidirectional systematic deviation E.
    pub systematic_um: Option<f64>,
    /// Range M of the mean bidirectional deviations.
    pub mean_range_um: Option<f64>,
    /// Reversal value B.
    pub reversal_um: Option<f64>,
}

/// Simulates all tests.
pub fn tests(subject: &Subject<'_>, remarks: &mut Vec<String>) -> Tests {
    let tests = some(subject, |_| true);
    if BallBar::axes(subject.machine).is_none() {
        remarks.push(
            "Circular tests and diagonals are for axes X, Y and Z, which this machine does not have."
                .to_owned(),
        );
    } else if tests.circles.len() < PLANES.len() {
        remarks.push(format!(
            "Travels of less than {} mm have no room for a circular test.",
            2.0 * BARS[BARS.len() - 1]
        ));
    }
    tests
}

/// Simulates the tests with these names: planes, axes, or directions of diagonals.
pub(crate) fn some(subject: &Subject<'_>, is_wanted: impl Fn(&str) -> bool) -> Tests {
    let machine = subject.machine;
    let bench = Bench::new(machine, subject.errors, Default::default());
    let simulated = SimulatedTests::new(&bench, subject.compensation.map(|c| c.runtime));
    let places = machine.axes.iter().zip(&simulated.centre);
    let at: Vec<String> = places
        .map(|(axis, q)| format!("{} = {}", axis.letter, crate::picture::tick(*q)))
        .collect();
    let axes = bench.linear();
    let axes = axes.filter(|i| is_wanted(&machine.axes[*i].letter.to_string()));
    let mut tests = Tests {
        at: at.join(", "),
        positioning: axes.map(|i| simulated.positioning(i)).collect(),
        ..Tests::default()
    };
    let Some(axes) = BallBar::axes(machine) else {
        return tests;
    };
    let planes = PLANES
        .into_iter()
        .filter(|plane| is_wanted(&plane_name(*plane)));
    tests.circles = planes
        .filter_map(|plane| simulated.circular(axes, plane))
        .collect();
    let diagonals = DIAGONALS.into_iter();
    let diagonals = diagonals.filter(|signs| is_wanted(&diagonal_name(*signs)));
    tests.diagonals = diagonals
        .map(|signs| simulated.diagonal(axes, signs))
        .collect();
    tests
}

/// Angle (rad) of a step around a circle.
fn angle(step: i32) -> f64 {
    (f64::from(step) * 360.0 / f64::from(STEPS)).to_radians()
}

/// The path of a circular test in both directions, around the centre; axes are counted from X.
fn circular_path([a, b]: [usize; 2], radius: f64) -> Vec<PathPoint> {
    let place = |step: i32| {
        let mut at = [0.0; 3];
        at[a] = radius * libm::cos(angle(step));
        at[b] = radius * libm::sin(angle(step));
        PathPoint {
            at,
            is_read: (0..=STEPS).contains(&step),
        }
    };
    let steps = -OVERSHOOT..=STEPS + OVERSHOOT;
    let both = steps.clone().chain(steps.rev());
    both.map(place).collect()
}

/// What a ball-bar reads along a circular path.
fn circle_found(
    bar: &BallBar<'_>,
    path: &[PathPoint],
    radius: f64,
    runtime: Option<&Runtime<'_>>,
) -> Option<CircleFound> {
    let readings = bar.read(path, runtime);
    let steps = (0..=STEPS).chain((0..=STEPS).rev());
    let all: Vec<(f64, f64)> = steps
        .zip(&readings)
        .map(|(step, read)| (angle(step), read.deviation))
        .collect();
    let (forth, back) = all.split_at(STEPS as usize + 1);
    let turns = BallBarTurns {
        counter_clockwise: forth.to_vec(),
        clockwise: back.to_vec(),
    };
    let circle = Circle::of(radius, &turns).ok()?;
    Some(CircleFound {
        deviation_um: circle.bidirectional? * 1e3,
        radial_um: circle.radial.map(|r| r * 1e3),
        hysteresis_um: circle.hysteresis? * 1e3,
        angles_deg: all.iter().map(|(angle, _)| angle.to_degrees()).collect(),
        readings_um: all.iter().map(|(_, reading)| reading * 1e3).collect(),
    })
}

/// Targets of a straight path, as fractions of it.
fn targets() -> impl Iterator<Item = f64> {
    (0..=TARGETS).map(|k| f64::from(k) / f64::from(TARGETS))
}

/// Deviations (µm) along a straight path, outward and back, relative to its start. `at` gives positions and
/// directions of approach at fractions of the path.
fn along(
    bench: &Bench<'_>,
    runtime: Option<&Runtime<'_>>,
    way: Vector3<f64>,
    at: impl Fn(f64, f64) -> (Vec<f64>, PerAxis),
) -> [Vec<f64>; 2] {
    let deviation = |part: f64, direction: f64| {
        let (position, coming) = at(part, direction);
        let [nominal, actual] = tip(bench, &position, &coming, runtime);
        (actual - nominal).dot(&way) * 1e3
    };
    let start = deviation(0.0, 1.0);
    [1.0, -1.0].map(|direction| {
        targets()
            .map(|part| deviation(part, direction) - start)
            .collect()
    })
}

/// The difference of the largest and the smallest value.
pub(crate) fn range<'v>(all: impl Iterator<Item = &'v f64>) -> f64 {
    let (low, high) = all.fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
    high - low
}

/// `XY`
fn plane_name(plane: [usize; 2]) -> String {
    plane.iter().map(|k| ['X', 'Y', 'Z'][*k]).collect()
}

/// `+X+Y−Z`
fn diagonal_name(signs: [f64; 3]) -> String {
    let all = signs.into_iter().zip(['X', 'Y', 'Z']);
    all.map(|(sign, letter)| format!("{}{letter}", if sign > 0.0 { '+' } else { '−' }))
        .collect()
}

/// Evaluates deviations (µm) of an axis at its targets by ISO 230-2.
fn positioning_found(runs: AxisRuns, deviations: [Vec<f64>; 2]) -> PositioningFound {
    let column = |direction: usize| RunColumn {
        direction: [1.0, -1.0][direction],
        readings: deviations[direction].iter().map(|d| d * 1e-3).collect(),
    };
    let analysis = analysis(&AxisRuns {
        columns: vec![column(0), column(1)],
        ..runs
    });
    let um = |mm: Option<f64>| mm.map(|mm| mm * 1e3);
    PositioningFound {
        systematic_um: um(analysis.systematic_deviation[2]),
        mean_range_um: um(analysis.range_of_mean_deviations),
        reversal_um: um(analysis.reversal),
        deviations_um: deviations,
    }
}

/// Tests of a machine around a point of its travels.
struct SimulatedTests<'a> {
    bench: &'a Bench<'a>,
    /// Position (mm, deg) of each axis: linear ones in the middle of their travels, rotary ones at zero.
    centre: Vec<f64>,
    /// Tables.
    runtime: Option<&'a Runtime<'a>>,
}

impl<'a> SimulatedTests<'a> {
    fn new(bench: &'a Bench<'a>, runtime: Option<&'a Runtime<'a>>) -> Self {
        let machine = bench.machine;
        let home = machine.to_command(&bench.home());
        let middle = |(axis, home): (&Axis, &f64)| match axis.letter.is_rotary() {
            true => *home,
            false => 0.5 * (axis.travel[0] + axis.travel[1]),
        };
        Self {
            bench,
            centre: machine.axes.iter().zip(&home).map(middle).collect(),
            runtime,
        }
    }

    /// A circle in the plane of two of X, Y and Z; `None` if no bar is short enough.
    fn circular(&self, axes: [usize; 3], plane: [usize; 2]) -> Option<CircularTest> {
        let [a, b] = plane.map(|k| {
            let [low, high] = self.bench.machine.axes[axes[k]].travel;
            0.5 * (high - low)
        });
        let room = a.min(b);
        let radius = BARS.into_iter().find(|radius| *radius <= room)?;
        let path = circular_path(plane, radius);
        let bar = BallBar::new(self.bench, axes, self.centre.clone());
        bar.reaches(&path).ok()?;
        Some(CircularTest {
            plane: plane_name(plane),
            radius_mm: radius,
            before: circle_found(&bar, &path, radius, None)?,
            after: (self.runtime)
                .and_then(|runtime| circle_found(&bar, &path, radius, Some(runtime))),
        })
    }

    fn diagonal(&self, axes: [usize; 3], signs: [f64; 3]) -> Diagonal {
        let (bench, machine) = (self.bench, self.bench.machine);
        let ends = [0, 1, 2].map(|k| {
            let [low, high] = machine.axes[axes[k]].travel;
            if signs[k] > 0.0 {
                [low, high]
            } else {
                [high, low]
            }
        });
        let at = |part: f64, direction: f64| {
            let mut position = self.centre.clone();
            let mut coming = PerAxis::default();
            for k in 0..3 {
                position[axes[k]] = ends[k][0] + part * (ends[k][1] - ends[k][0]);
                coming[axes[k]] = signs[k] * direction;
            }
            (position, coming)
        };
        let nominal = |part| bench.nominal(&machine.to_kinematic(&at(part, 1.0).0)).t;
        let whole = nominal(1.0) - nominal(0.0);
        let way = whole.normalize();
        let before = along(bench, None, way, at);
        let after = (self.runtime).map(|runtime| along(bench, Some(runtime), way, at));
        let length = whole.norm();
        Diagonal {
            name: diagonal_name(signs),
            length_mm: length,
            at_mm: (0..=TARGETS)
                .map(|k| length * f64::from(k) / f64::from(TARGETS))
                .collect(),
            systematic_before_um: range(before.iter().flatten()),
            systematic_after_um: after.as_ref().map(|after| range(after.iter().flatten())),
            before_um: before,
            after_um: after,
        }
    }

    fn positioning(&self, index: usize) -> Positioning {
        let machine = self.bench.machine;
        let [low, high] = machine.axes[index].travel;
        let target = |part: f64| low + part * (high - low);
        let at = |part: f64, direction: f64| {
            let mut position = self.centre.clone();
            let mut coming = PerAxis::default();
            position[index] = target(part);
            coming[index] = direction;
            (position, coming)
        };
        let centre = machine.to_kinematic(&self.centre);
        let way = self.bench.way(&centre, index);
        let runs = AxisRuns {
            setup: MeasurementSetup {
                moved: index,
                sense: Sense::In(index),
                counts: 1.0,
                at: centre,
                offset: Vector3::zeros(),
                keeps_slope: false,
            },
            targets: targets().map(target).collect(),
            columns: Vec::new(),
        };
        let found = |runtime| positioning_found(runs.clone(), along(self.bench, runtime, way, at));
        Positioning {
            axis: machine.axes[index].letter.char(),
            before: found(None),
            after: self.runtime.map(|runtime| found(Some(runtime))),
            at_mm: runs.targets.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueaxis_model::errors::{ErrorModel, Parameter};
    use trueaxis_model::machine::Machine;

    fn found(parameters: &[(&str, f64)]) -> (Machine, Tests) {
        let text = include_str!("../../../examples/mill-21/machine.toml");
        let machine = Machine::from_toml(text).unwrap();
        let mut errors = ErrorModel::perfect(&machine);
        for (name, value) in parameters {
            assert!(errors.set(&machine, Parameter::parse(name).unwrap(), *value));
        }
        let mut remarks = Vec::new();
        let tests = super::tests(&Subject::new(&machine, &errors, None, 1), &mut remarks);
        assert!(remarks.is_empty(), "{remarks:?}");
        (machine, tests)
    }

    #[test]
    fn squareness_is_a_circular_deviation_of_so_much_of_the_radius() {
        let (_, tests) = found(&[("EC0X", 40e-6)]);
        let planes: Vec<&str> = tests.circles.iter().map(|c| &*c.plane).collect();
        assert_eq!(planes, ["XY", "YZ", "ZX"]);
        let [xy, yz, zx] = [0, 1, 2].map(|k| &tests.circles[k].before);
        let expected = 40e-6 * tests.circles[0].radius_mm * 1e3;
        // Second order: a few µm squared, divided by the radius.
        assert!((xy.deviation_um - expected).abs() < 1e-3, "{xy:?}");
        assert!((xy.radial_um[0] - 0.5 * expected).abs() < 1e-3);
        assert!((xy.radial_um[1] + 0.5 * expected).abs() < 1e-3);
        for other in [yz, zx] {
            assert!(other.deviation_um < 1e-3, "{other:?}");
        }
    }

    #[test]
    fn a_scale_and_a_backlash_are_what_positioning_and_diagonals_show() {
        let (machine, tests) = found(&[("EXX1", 20e-6), ("EXXb", 3e-3)]);
        let travel = |letter: char| {
            let [low, high] = machine.axes[machine.index(letter).unwrap()].travel;
            high - low
        };
        let x = tests.positioning.iter().find(|p| p.axis == 'X').unwrap();
        // Rounding of positions of 1 m.
        let near = |a: Option<f64>, b: f64| (a.unwrap() - b).abs() < 1e-8;
        let scale = 20e-6 * travel('X') * 1e3;
        assert!(near(x.before.mean_range_um, scale), "{x:?}");
        assert!(near(x.before.reversal_um, 6.0), "{x:?}");
        assert!(near(x.before.systematic_um, scale + 6.0), "{x:?}");
        let y = tests.positioning.iter().find(|p| p.axis == 'Y').unwrap();
        assert!(near(y.before.systematic_um, 0.0), "{y:?}");
        for diagonal in &tests.diagonals {
            let length = libm::hypot(libm::hypot(travel('X'), travel('Y')), travel('Z'));
            assert!((diagonal.length_mm - length).abs() < 1e-9);
            // The share of X along the diagonal.
            let part = travel('X') / length;
            let [forth, back] = &diagonal.before_um;
            assert!(
                (forth.last().unwrap().abs() - scale * part).abs() < 1e-8,
                "{diagonal:?}"
            );
            assert!(
                ((forth[0] - back[0]).abs() - 6.0 * part).abs() < 1e-8,
                "{diagonal:?}"
            );
            let range = (scale + 6.0) * part;
            assert!((diagonal.systematic_before_um - range).abs() < 1e-8);
        }
    }
}

//! Files of runs and of ball-bars as observations.

use super::{InstrumentSetup, Observation, Observations, PlacePrior, ToolPoint};
use crate::instrument::{Kind, SetupPriors};
use nalgebra::{Matrix3, Vector3};
use trueaxis_direct::formats::of_this_machine;
use trueaxis_direct::formats::radii::{Radii, RadiusReadings};
use trueaxis_direct::formats::runs;
use trueaxis_direct::{AxisRuns, MeasuredRuns};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::explain::{Bench, Sense};
use trueaxis_model::formats::csv;
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_model::source::FileError;

/// A position this far (mm, deg) beyond an end of the travel is at the end.
const ROUNDING: f64 = 1e-6;
/// How exactly the direction of a straightedge is known whose slope belongs to the machine (rad): beyond any reading.
const ALIGNED: f64 = 1e-9;

/// The first column after the lines that begin with `#`, and the line of that header among those that are not empty.
pub fn first_column(text: &str) -> (&str, usize) {
    let lines = text.trim_start_matches('\u{feff}').lines().map(str::trim);
    let lines = lines.filter(|line| !line.is_empty());
    let header = lines.enumerate().find(|(_, line)| !line.starts_with('#'));
    header.map_or(("", 0), |(number, line)| {
        let name = line.split(',').next().unwrap_or("");
        (name.trim().trim_matches('"'), number)
    })
}

/// One set-up without readings.
fn setup(file: &str, kind: Kind, given: SetupPriors, tool: ToolPoint) -> Observations {
    Observations {
        files: vec![file.to_owned()],
        setups: vec![InstrumentSetup {
            name: file.to_owned(),
            kind,
            given,
            tool: 0,
        }],
        tools: vec![tool],
        ..Observations::default()
    }
}

/// Runs of a laser, straightedge, level, calibrator or square: one set-up with the name of the file. A straightedge
/// whose slope is kept is aligned with the machine's axes. The error of a square is subtracted.
///
/// # Errors
/// As for [`runs::read`], and if the linear axes cannot follow a ball.
pub fn of_runs(text: &str, file: &str, machine: &Machine) -> Result<Observations, FileError> {
    let (lines, over) = match runs::read(text, machine)? {
        MeasuredRuns::Line(line) => (vec![line], 0.0),
        MeasuredRuns::Square(square) => (square.lines.to_vec(), square.over),
    };
    let perfect = ErrorModel::perfect(machine);
    let bench = Bench::new(machine, &perfect, Default::default());
    let first = &lines[0].setup;
    let kind = match first.is_angular() {
        true => Kind::Angle,
        false => Kind::Displacement,
    };
    let given = SetupPriors {
        turn: first.keeps_slope.then(Matrix3::identity),
        turn_sigma: first.keeps_slope.then_some(ALIGNED),
        ..SetupPriors::default()
    };
    let tool = ToolPoint {
        name: file.to_owned(),
        place: Some(Vector3::from(machine.tip) + first.point(&bench)),
        known: PlacePrior::Exactly,
    };
    let mut all = setup(file, kind, given, tool);
    let header = first_column(text).1;
    for (number, line) in lines.iter().enumerate() {
        // In the direction of the second leg, the square's own error is a slope.
        let slope = if number == 1 { over } else { 0.0 };
        let above = header + number * lines[0].targets.len();
        take(&bench, line, kind, slope, above, text, &mut all)?;
    }
    Ok(all)
}

/// Adds the readings of a line, run after run; `above` is the number of lines of text above its first target.
fn take(
    bench: &Bench<'_>,
    line: &AxisRuns,
    kind: Kind,
    slope: f64,
    above: usize,
    text: &str,
    all: &mut Observations,
) -> Result<(), FileError> {
    let machine = bench.machine;
    let positions = line.positions(machine);
    let unit = match kind {
        Kind::Angle => crate::instrument::LEVER,
        _ => 1.0,
    };
    for column in &line.columns {
        for (k, (q, reading)) in positions.iter().zip(&column.readings).enumerate() {
            let state = line.setup.state(bench, *q, column.direction);
            let state = state.ok_or_else(|| {
                FileError::whole(
                    "the linear axes cannot follow a ball",
                    "leave the file out, or give a machine with three linear axes",
                )
            })?;
            let value = unit * (reading - slope * (q - positions[0]));
            all.rows.push(Observation {
                reads: Some((line.setup.sense, 1.0)),
                ..row(
                    machine.to_command(&state.q),
                    state.sign,
                    value,
                    csv::line_of(text, above + 1 + k).unwrap_or(0),
                )
            });
        }
    }
    Ok(())
}

/// Heights at which a probe touches a flat surface, each with the positions of the axes (mm, deg), in the direction of a linear
/// axis (by index): one set-up that reads displacements, whose zero and tilt are unknown. The probe has then gone farther
/// than commanded by minus the height. Motions by `beside` (mm, linear axes only) would bring the tool tip to where the probe is.
///
/// The positions are those of the axes at height zero: errors hardly change over a height, and if they were stated with it,
/// minus a scale of the axis would explain all heights.
#[must_use]
pub fn of_surface(
    name: &str,
    machine: &Machine,
    axis: usize,
    beside: &PerAxis,
    touches: &[(PerAxis, f64)],
) -> Observations {
    let perfect = ErrorModel::perfect(machine);
    let kinematics = Kinematics::new(machine, &perfect);
    let [tip, probe] = [&PerAxis::default(), beside].map(|q| kinematics.nominal(q, None));
    let is_beside = beside.iter().any(|by| *by != 0.0);
    let place = Vector3::from(machine.tip) + tip.r.transpose() * (probe.t - tip.t);
    let tool = ToolPoint {
        name: name.to_owned(),
        place: is_beside.then_some(place),
        known: PlacePrior::Exactly,
    };
    let mut all = setup(name, Kind::Displacement, SetupPriors::default(), tool);
    all.rows = (touches.iter().enumerate())
        .map(|(k, (position, height))| Observation {
            reads: Some((Sense::In(axis), 1.0)),
            ..row(*position, PerAxis::default(), -height, k + 2)
        })
        .collect();
    all
}

fn row(position: PerAxis, direction: PerAxis, value: f64, line: usize) -> Observation {
    Observation {
        setup: 0,
        position,
        direction,
        spindle: 0.0,
        reads: None,
        normal: None,
        value: Vector3::new(value, 0.0, 0.0),
        sigma: None,
        time: None,
        temperature: None,
        file: 0,
        line,
    }
}

/// Readings of a ball-bar on a circle or a sphere: lengths with one set-up that has the name of the file. On a sphere,
/// the direction of travel is not known.
///
/// # Errors
/// [`FileError`]: the file does not say where all axes stood at the centre, or the plane of a circle; it is of another
/// machine, or the test leaves the travel.
pub fn of_radii(
    text: &str,
    file: &str,
    radii: &Radii,
    machine: &Machine,
) -> Result<Observations, FileError> {
    let linear = |letter: char| {
        let index = machine.index(letter)?;
        (!machine.axes[index].letter.is_rotary()).then_some(index)
    };
    let letters = radii.plane.iter().flat_map(|plane| plane.chars());
    let plane: Option<Vec<usize>> = letters.map(linear).collect();
    let plane = plane.and_then(|axes| <[usize; 2]>::try_from(axes).ok());
    let all_three = ['X', 'Y', 'Z'].map(linear);
    if let Some((span, name)) = &radii.machine {
        of_this_machine(span.clone(), name, machine)?;
    }
    let missing = || {
        let example: Vec<String> = (machine.axes.iter())
            .map(|axis| format!("{} = 0.0", axis.letter))
            .collect();
        FileError::whole(
            "the file does not say where all axes stood at the centre of the test, or in which plane a circle was",
            format!(
                "add # at = {{ {} }}, and # plane = \"XY\" for a circle",
                example.join(", ")
            ),
        )
    };
    let centre = centre(radii, machine).ok_or_else(missing)?;
    let tool = ToolPoint {
        name: file.to_owned(),
        place: None,
        known: PlacePrior::Unknown,
    };
    let mut all = setup(file, Kind::Length, SetupPriors::default(), tool);
    let header = first_column(text).1;
    let mut add = |number: usize, position: PerAxis, direction: PerAxis, deviation: f64| {
        let line = csv::line_of(text, header + 1 + number).unwrap_or(0);
        let length = radii.radius + deviation;
        all.rows.push(row(position, direction, length, line));
    };
    match &radii.readings {
        RadiusReadings::Circle(turns) => {
            let [a, b] = plane.ok_or_else(missing)?;
            for (turn, way) in [(&turns.counter_clockwise, 1.0), (&turns.clockwise, -1.0)] {
                for (k, (angle, deviation)) in turn.iter().enumerate() {
                    let (sine, cosine) = libm::sincos(*angle);
                    let mut position = centre;
                    position[a] += radii.radius * cosine;
                    position[b] += radii.radius * sine;
                    let mut direction = PerAxis::default();
                    // Where an axis reverses, it came from inside the circle.
                    let sign = |moves: f64, out: f64| match moves.abs() < 1e-9 {
                        true => out.signum(),
                        false => moves.signum(),
                    };
                    direction[a] = sign(-way * sine, cosine);
                    direction[b] = sign(way * cosine, sine);
                    add(k, position, direction, *deviation);
                }
            }
        }
        RadiusReadings::Sphere(readings) => {
            for (k, (place, deviation)) in readings.iter().enumerate() {
                let mut position = centre;
                for (axis, at) in all_three.iter().zip(place.iter()) {
                    position[axis.ok_or_else(missing)?] += at;
                }
                add(k, position, PerAxis::default(), *deviation);
            }
        }
    }
    let outside = all.rows.iter().find_map(|row| {
        let mut axes = machine.axes.iter().zip(row.position);
        axes.find(|(axis, at)| *at < axis.travel[0] - ROUNDING || *at > axis.travel[1] + ROUNDING)
    });
    if let Some((axis, at)) = outside {
        let [low, high] = axis.travel;
        return Err(FileError::whole(
            format!(
                "{} = {at:.3} of the test is outside the travel of {low} to {high}",
                axis.letter
            ),
            "correct radius_mm or at, or the range of the axis in the machine file",
        ));
    }
    Ok(all)
}

/// Positions of all axes at the centre (mm, deg).
fn centre(radii: &Radii, machine: &Machine) -> Option<PerAxis> {
    let mut centre = PerAxis::default();
    for (at, axis) in centre.iter_mut().zip(&machine.axes) {
        let (_, value) = (radii.at.iter()).find(|(name, _)| *name == axis.letter.to_string())?;
        *at = *value;
    }
    Some(centre)
}

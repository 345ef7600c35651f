//! The setup: the lines that begin with `#`.

use super::sense;
use crate::MeasurementSetup;
use crate::formats::of_this_machine;
use nalgebra::Vector3;
use serde::Deserialize;
use std::collections::BTreeMap;
use toml::Spanned;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::explain::{Bench, Sense};
use trueaxis_model::formats::{csv, units};
use trueaxis_model::machine::{Axis, Machine, PerAxis};
use trueaxis_model::source::{Exactly, FileError};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RunEntries {
    machine: Option<Spanned<String>>,
    axis: Option<Spanned<String>>,
    reads: Option<Spanned<String>>,
    reads_along: Option<Spanned<BTreeMap<Spanned<String>, Spanned<String>>>>,
    unit: Option<Spanned<String>>,
    reads_position: Option<Spanned<bool>>,
    at: Option<Spanned<BTreeMap<Spanned<String>, Spanned<f64>>>>,
    offset_mm: Option<Spanned<Exactly<3>>>,
    slope: Option<Spanned<String>>,
    square_urad: Option<Spanned<f64>>,
}

/// The meaning of the readings.
#[derive(Clone, Copy, Debug)]
pub struct Readings {
    /// Size of their unit in mm or rad.
    pub factor: f64,
    /// True if they are positions, from which the targets must be subtracted.
    pub are_positions: bool,
}

/// Content of a heading.
pub struct RunHeading {
    /// One line, or the two legs of a square.
    pub setups: Vec<MeasurementSetup>,
    /// For a square, its angle minus 90° (rad).
    pub square: Option<f64>,
    /// The meaning of the readings.
    pub readings: Readings,
}

/// Largest distance (mm) of the measured point from the tip, and largest error (µrad) of a square.
const FAR: f64 = 1e4;
const SQUARE: f64 = 1e4;

const EXAMPLE: &str = "# axis = \"X\", # reads = \"tool +X\", # unit = \"um\" and # at = { Y = 0.0, Z = 0.0 }, each in a line that begins with #";
const DIRECTIONS: &str = "write tool or workpiece, and where it goes when the reading grows: \"tool +X\" (farther in the direction of a positive command of X, seen from the other one), \"tool +C\", \"tool +Y to +Z\" (turning from +Y towards +Z)";

impl RunHeading {
    /// Parses the heading, which must say where the other axes stood if that is needed; also returns where it ends.
    pub fn read(
        text: &str,
        machine: &Machine,
        needs_place: bool,
    ) -> Result<(Self, usize), FileError> {
        let remedy = format!("the lines with # say how it was measured: {EXAMPLE}");
        let (entries, end): (RunEntries, usize) = csv::heading(text, &remedy)?;
        Ok((entries.heading(machine, needs_place)?, end))
    }
}

/// A position (mm or rad) in the travel of an axis.
fn commanded(axis: &Axis, value: &Spanned<f64>) -> Result<f64, FileError> {
    let [low, high] = axis.travel;
    let value_mm = *value.get_ref();
    if !(low..=high).contains(&value_mm) {
        return Err(FileError::here(
            value.span(),
            format!(
                "{} = {value_mm} is outside the travel of {low} to {high}",
                axis.letter
            ),
            "correct the position, or the range of the axis in the machine file",
        ));
    }
    Ok(axis.to_kinematic(value_mm))
}

/// An entry that is not there.
pub fn missing(key: &str) -> FileError {
    FileError::whole(
        format!("the file does not say `{key}`"),
        format!("begin it with {EXAMPLE}"),
    )
}

/// Refuses an entry.
fn without<T>(entry: Option<&Spanned<T>>, message: &str, remedy: &str) -> Result<(), FileError> {
    entry.map_or(Ok(()), |entry| {
        Err(FileError::here(entry.span(), message, remedy))
    })
}

/// An axis that moves, and what is read then.
type AxisReading<'a> = (&'a Spanned<String>, &'a Spanned<String>);

impl RunEntries {
    fn heading(&self, machine: &Machine, needs_place: bool) -> Result<RunHeading, FileError> {
        if let Some(name) = &self.machine {
            of_this_machine(name.span(), name.get_ref(), machine)?;
        }
        let mut setups = Vec::new();
        for (axis, reads) in self.lines()? {
            setups.push(self.setup(machine, axis, reads, needs_place)?);
        }
        let square = self.square(machine, &setups)?;
        let Some(unit) = &self.unit else {
            return Err(missing("unit"));
        };
        let angular = setups[0].is_angular();
        let factor = units::factor(unit.get_ref(), angular)
            .map_err(|(message, remedy)| FileError::here(unit.span(), message, remedy))?;
        Ok(RunHeading {
            square,
            readings: Readings {
                factor,
                are_positions: self.are_positions(&setups[0])?,
            },
            setups,
        })
    }

    fn lines(&self) -> Result<Vec<AxisReading<'_>>, FileError> {
        match (&self.axis, &self.reads, &self.reads_along) {
            (Some(axis), Some(reads), None) => Ok(vec![(axis, reads)]),
            (None, None, Some(both)) if both.get_ref().len() == 2 => {
                Ok(both.get_ref().iter().collect())
            }
            (None, None, Some(both)) => Err(FileError::here(
                both.span(),
                format!("a square has two lines, not {}", both.get_ref().len()),
                "write # reads_along = { X = \"tool +Y\", Y = \"tool +X\" }",
            )),
            (_, _, Some(both)) => Err(FileError::here(
                both.span(),
                "a square has no other axis or direction than those along its lines".to_owned(),
                "keep reads_along, or axis and reads",
            )),
            (None, _, None) => Err(missing("axis")),
            (_, None, None) => Err(missing("reads")),
        }
    }

    fn are_positions(&self, setup: &MeasurementSetup) -> Result<bool, FileError> {
        let positions = self.reads_position.as_ref().filter(|p| *p.get_ref());
        if !setup.is_positioning() {
            without(
                positions,
                "this reading does not follow the axis that moves",
                "leave out reads_position: it is for readings in the direction of the axis itself",
            )?;
        }
        Ok(positions.is_some())
    }

    fn setup(
        &self,
        machine: &Machine,
        axis: &Spanned<String>,
        reads: &Spanned<String>,
        needs_place: bool,
    ) -> Result<MeasurementSetup, FileError> {
        let moved = index(axis, machine)?;
        let (sense, counts) = moving_sense(reads, moved, machine)?;
        let perfect = ErrorModel::perfect(machine);
        let bench = Bench::new(machine, &perfect, Default::default());
        let mut setup = MeasurementSetup {
            moved,
            sense,
            counts,
            at: bench.home(),
            offset: Vector3::zeros(),
            keeps_slope: false,
        };
        if let Sense::From(a, b) = sense {
            let [a, b] = [a, b].map(|axis| bench.way(&setup.at, axis));
            let is_parallel = a.cross(&b).norm() < 0.1;
            let remedy = "give two axes that are across each other";
            let message = "the two axes move in the same direction";
            without(Some(reads).filter(|_| is_parallel), message, remedy)?;
        }
        setup.at = self.at(machine, &setup, self.reads_along.is_some(), needs_place)?;
        setup.offset = self.offset()?;
        setup.keeps_slope = self.keeps_slope(&setup, machine)?;
        Ok(setup)
    }

    /// From the tip to the measured point (mm).
    fn offset(&self) -> Result<Vector3<f64>, FileError> {
        let offset = self.offset_mm.as_ref();
        let xyz = offset.map_or([0.0; 3], |offset| offset.get_ref().0);
        let is_near = xyz.iter().all(|v| (-FAR..=FAR).contains(v));
        without(
            offset.filter(|_| !is_near),
            "the measured point is nowhere near the tool",
            "write x, y and z from the tool tip to the measured point, in mm",
        )?;
        Ok(Vector3::from(xyz))
    }

    fn keeps_slope(&self, setup: &MeasurementSetup, machine: &Machine) -> Result<bool, FileError> {
        let Some(slope) = &self.slope else {
            return Ok(false);
        };
        if !setup.is_straightness(machine) {
            let message = "only a straightness has a slope that may be of the straightedge";
            without(Some(slope), message, "leave out slope")?;
        }
        match slope.get_ref().as_str() {
            "keep" => Ok(true),
            "remove" => Ok(false),
            other => Err(FileError::here(
                slope.span(),
                format!("`{other}` cannot be done with a slope"),
                "write keep if the straightedge was aligned with another axis, remove if it lay somehow",
            )),
        }
    }

    /// Positions of the axes.
    fn at(
        &self,
        machine: &Machine,
        setup: &MeasurementSetup,
        square: bool,
        needs_place: bool,
    ) -> Result<PerAxis, FileError> {
        let mut position = setup.at;
        let mut given = [false; trueaxis_model::machine::MAX_AXES];
        for (name, value) in self.at.iter().flat_map(|at| at.get_ref()) {
            let index = index(name, machine)?;
            let axis = &machine.axes[index];
            if index == setup.moved && !square {
                return Err(FileError::here(
                    name.span(),
                    format!("{} is the axis that moves", axis.letter),
                    "say where the other axes stood",
                ));
            }
            position[index] = commanded(axis, value)?;
            given[index] = true;
        }
        // Linear positions do not matter for angles.
        let needed = (0..machine.axes.len()).filter(|i| *i != setup.moved || square);
        let mut needed = needed.filter(|i| {
            let rotary = machine.axes[*i].letter.is_rotary();
            rotary || !setup.is_angular()
        });
        match needed.find(|i| needs_place && !given[*i]) {
            Some(lacking) => Err(self.lacks(machine.axes[lacking].letter.char())),
            None => Ok(position),
        }
    }

    /// An axis of which the file does not say where it stood.
    fn lacks(&self, letter: char) -> FileError {
        let message = format!("the file does not say where {letter} stood");
        let remedy = format!(
            "add {letter} to # at = {{ … }}: the measured line has a place, and angular motions a lever to it"
        );
        match &self.at {
            Some(entry) => FileError::here(entry.span(), message, remedy),
            None => FileError::whole(message, remedy),
        }
    }

    /// For a square, its angle minus 90°.
    fn square(
        &self,
        machine: &Machine,
        setups: &[MeasurementSetup],
    ) -> Result<Option<f64>, FileError> {
        let [a, b] = setups else {
            let message = "only a square has an error of its own";
            without(self.square_urad.as_ref(), message, "leave out square_urad")?;
            return Ok(None);
        };
        let span = self.reads_along.as_ref().map_or(0..0, Spanned::span);
        if a.sense != Sense::In(b.moved) || b.sense != Sense::In(a.moved) {
            let [x, y] = [a.moved, b.moved].map(|i| machine.axes[i].letter);
            return Err(FileError::here(
                span,
                "along each line of a square, the direction of the other is read".to_owned(),
                format!(
                    "write # reads_along = {{ {x} = \"tool +{y}\", {y} = \"tool +{x}\" }}, or - where the reading shrinks"
                ),
            ));
        }
        let over = self.square_urad.as_ref();
        let is_wrong = |over: &&Spanned<f64>| !(-SQUARE..=SQUARE).contains(over.get_ref());
        let remedy = "write what its angle is more than 90°, in µrad";
        without(over.filter(is_wrong), "no square is that wrong", remedy)?;
        Ok(Some(over.map_or(0.0, |over| over.get_ref() * 1e-6)))
    }
}

/// The direction that is read while an axis moves, and the sign with which it counts.
fn moving_sense(
    reads: &Spanned<String>,
    moved: usize,
    machine: &Machine,
) -> Result<(Sense, f64), FileError> {
    let (sense, counts) = sense(reads.get_ref(), machine)
        .map_err(|message| FileError::here(reads.span(), message, DIRECTIONS))?;
    if matches!(sense, Sense::About(about) if about != moved) {
        return Err(FileError::here(
            reads.span(),
            format!(
                "{} is not about {}, which moves",
                reads.get_ref(),
                machine.axes[moved].letter
            ),
            "read about the axis that moves, or from one linear axis to another: \"tool +Y to +Z\"",
        ));
    }
    Ok((sense, counts))
}

fn index(name: &Spanned<String>, machine: &Machine) -> Result<usize, FileError> {
    let mut letters = name.get_ref().chars();
    let index = letters.next().and_then(|letter| machine.index(letter));
    match (index, letters.next()) {
        (Some(index), None) => Ok(index),
        _ => {
            let letters: Vec<String> = machine.axes.iter().map(|a| a.letter.to_string()).collect();
            Err(FileError::here(
                name.span(),
                format!("the machine has no axis `{}`", name.get_ref()),
                format!("{} has the axes {}", machine.name, letters.join(" ")),
            ))
        }
    }
}

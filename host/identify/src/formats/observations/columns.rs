//! The columns of a file of observations: what each holds, which ones a kind needs, and what their cells may say.

use super::super::{axis, direction, position, temperatures};
use super::Observation;
use crate::instrument::Kind;
use nalgebra::Vector3;
use std::ops::RangeInclusive;
use trueaxis_direct::formats::runs::sense;
use trueaxis_model::explain::Sense;
use trueaxis_model::formats::csv::{CsvRow, CsvTable};
use trueaxis_model::machine::{MAX_AXES, Machine};
use trueaxis_model::source::FileError;

/// Content of a column.
#[derive(Clone, Debug, PartialEq)]
enum ObservationColumn {
    Kind,
    Setup,
    Axis(usize),
    Direction(usize),
    Spindle,
    Reads,
    /// A component of the normal of a surface.
    Normal(usize),
    /// A component of the reading of a kind.
    Value(Kind, usize),
    Sigma,
    SigmaOfAngle,
    Time,
    Temperature,
    Cycle,
    /// A temperature for [`temperatures::read`].
    Sensor(String),
}

/// Names of the columns that are neither axes nor readings.
const NAMES: [(&str, ObservationColumn); 12] = [
    ("kind", ObservationColumn::Kind),
    ("setup", ObservationColumn::Setup),
    ("S", ObservationColumn::Spindle),
    ("reads", ObservationColumn::Reads),
    ("normal_x", ObservationColumn::Normal(0)),
    ("normal_y", ObservationColumn::Normal(1)),
    ("normal_z", ObservationColumn::Normal(2)),
    ("sigma_um", ObservationColumn::Sigma),
    ("sigma_urad", ObservationColumn::SigmaOfAngle),
    ("time_s", ObservationColumn::Time),
    ("temperature_C", ObservationColumn::Temperature),
    ("cycle", ObservationColumn::Cycle),
];

/// Permitted standard uncertainties (µm, µrad).
const SIGMAS: RangeInclusive<f64> = 1e-6..=1e6;
/// Largest reading (mm): ten times the longest bar or distance of a tracker, and the largest deviation of a machine.
const LARGEST: f64 = 1e6;
const LARGEST_DEVIATION: f64 = 100.0;
const NORMALS: &str =
    "write the outward normal of the surface in the coordinates of the part, of length 1: 0, 0, 1";
/// How far the length of a normal may be from 1: measuring machines print three or more decimals.
const ROUNDED: f64 = 5e-3;
const DIRECTIONS: &str = "write tool or workpiece, and where it goes when the reading grows: tool +X, tool +C, tool +Y to +Z";

impl ObservationColumn {
    /// Whether cells of a kind must be empty.
    fn is_foreign_to(&self, of: Kind) -> bool {
        match self {
            Self::Value(kind, _) => *kind != of,
            Self::Reads => !of.has_direction(),
            Self::Normal(_) => of != Kind::Surface,
            Self::Sigma => of.sigma() != "sigma_um",
            Self::SigmaOfAngle => of.sigma() != "sigma_urad",
            _ => false,
        }
    }

    fn named(name: &str, machine: &Machine) -> Option<Self> {
        let axis = |name: &str| axis(name, machine);
        let named = (NAMES.iter())
            .find(|(n, _)| *n == name)
            .map(|(_, c)| c.clone());
        let value = || {
            Kind::ALL.into_iter().find_map(|kind| {
                let k = kind.columns().0.iter().position(|n| *n == name)?;
                Some(Self::Value(kind, k))
            })
        };
        let direction = || axis(name.strip_suffix("_dir")?).map(Self::Direction);
        named
            .or_else(value)
            .or_else(|| axis(name).map(Self::Axis))
            .or_else(direction)
            .or_else(|| Some(Self::Sensor(temperatures::sensor(name)?.to_owned())))
    }
}

/// The columns of a file.
pub(super) struct Columns<'m> {
    machine: &'m Machine,
    all: Vec<ObservationColumn>,
    header: CsvRow<'m>,
    /// Whether the file has readings: a plan may lack them.
    has_readings: bool,
    /// Place of the column with the kind.
    pub(super) kind: usize,
    /// Place of the column with the name of the set-up.
    pub(super) setup: Option<usize>,
}

impl<'m> Columns<'m> {
    /// Those of a table.
    ///
    /// # Errors
    /// [`FileError`]: an unknown column, or none for the kind or an axis.
    pub(super) fn of(
        table: &CsvTable<'m>,
        machine: &'m Machine,
        has_readings: bool,
    ) -> Result<Self, FileError> {
        let all = table.columns(0, |name| ObservationColumn::named(name, machine))?;
        let place = |column: ObservationColumn| all.iter().position(|c| *c == column);
        let kind = place(ObservationColumn::Kind).ok_or_else(|| table.missing("kind"))?;
        for (i, axis) in machine.axes.iter().enumerate() {
            place(ObservationColumn::Axis(i)).ok_or_else(|| table.missing(axis.letter))?;
        }
        Ok(Self {
            machine,
            kind,
            setup: place(ObservationColumn::Setup),
            all,
            header: table.header.clone(),
            has_readings,
        })
    }

    fn has(&self, column: &ObservationColumn) -> bool {
        self.all.contains(column)
    }

    /// The kind of a row.
    ///
    /// # Errors
    /// [`FileError`]: there is no such kind.
    pub(super) fn kind(&self, row: &CsvRow<'_>) -> Result<Kind, FileError> {
        let name = row.text(self.kind)?;
        let known = Kind::ALL.into_iter().find(|kind| kind.name() == name);
        known.ok_or_else(|| {
            let names = Kind::ALL.map(Kind::name).join(", ");
            row.error(
                self.kind,
                format!("`{name}` is not a kind of observation"),
                "unknown kind",
                format!("write one of {names}"),
            )
        })
    }

    /// A row of a set-up that reads something else; `kinds` are the row's and the set-up's.
    pub(super) fn other_kind(&self, row: &CsvRow<'_>, name: &str, kinds: [Kind; 2]) -> FileError {
        let [own, other] = kinds.map(Kind::one);
        row.error(
            self.setup.unwrap_or(self.kind),
            format!("the set-up `{name}` reads {other}, not {own}"),
            "here",
            "give each instrument its own name in the column setup",
        )
    }

    /// Refuses cells that do not belong to the kind of a row, and a file without columns that the kind needs.
    ///
    /// # Errors
    /// [`FileError`].
    pub(super) fn fit(&self, row: &CsvRow<'_>, of: Kind) -> Result<(), FileError> {
        for (k, column) in self.all.iter().enumerate() {
            if column.is_foreign_to(of) && !row.cells[k].text.is_empty() {
                let message = format!("{} has no {}", of.one(), self.header.cells[k].text);
                return Err(row.error(k, message, "here", "leave the cell empty"));
            }
        }
        let needs = |what: String, remedy: &str| {
            let message = format!("{} needs the {what}", of.one());
            FileError::at(self.header.span.clone(), message, "the header", remedy)
        };
        for (k, name) in of.columns().0.iter().enumerate() {
            if self.has_readings && !self.has(&ObservationColumn::Value(of, k)) {
                return Err(needs(format!("column `{name}`"), "add it"));
            }
        }
        if of.has_direction() && !self.has(&ObservationColumn::Reads) {
            return Err(needs("column `reads`".to_owned(), DIRECTIONS));
        }
        let has_normal = (0..3).all(|k| self.has(&ObservationColumn::Normal(k)));
        if of == Kind::Surface && !has_normal {
            let what = "columns normal_x, normal_y and normal_z".to_owned();
            return Err(needs(what, NORMALS));
        }
        Ok(())
    }

    /// The observation of a row.
    ///
    /// # Errors
    /// [`FileError`]: whatever cannot be the value of its cell.
    pub(super) fn observation(
        &self,
        row: &CsvRow<'_>,
        kind: Kind,
        setup: usize,
    ) -> Result<Observation, FileError> {
        let mut one = Observation {
            setup,
            position: [0.0; MAX_AXES],
            direction: [0.0; MAX_AXES],
            spindle: 0.0,
            reads: None,
            normal: None,
            value: Vector3::zeros(),
            sigma: None,
            time: None,
            temperature: None,
            file: 0,
            line: row.line,
        };
        for k in 0..self.all.len() {
            self.take(&mut one, row, k, kind)?;
        }
        if let Some(normal) = &mut one.normal {
            let length = normal.norm();
            if (length - 1.0).abs() >= ROUNDED {
                let first = ObservationColumn::Normal(0);
                let first = self.all.iter().position(|c| *c == first);
                let message = format!("the normal has the length {length:.3}");
                return Err(row.error(first.unwrap_or(0), message, "here", NORMALS));
            }
            *normal /= length;
        }
        Ok(one)
    }

    /// Takes the value of a cell into an observation.
    fn take(
        &self,
        one: &mut Observation,
        row: &CsvRow<'_>,
        k: usize,
        kind: Kind,
    ) -> Result<(), FileError> {
        let is_empty = row.cells[k].text.is_empty();
        match self.all[k] {
            ObservationColumn::Axis(i) => {
                one.position[i] = position(row, k, &self.machine.axes[i])?
            }
            ObservationColumn::Reads if kind.has_direction() => {
                one.reads = Some(self.direction_read(row, k, kind)?);
            }
            ObservationColumn::Value(of, i) if of == kind && (self.has_readings || !is_empty) => {
                one.value[i] = reading(row, k, kind)?;
            }
            ObservationColumn::Normal(i) if kind == Kind::Surface => {
                one.normal.get_or_insert_default()[i] = row.number(k)?;
            }
            _ if is_empty => {}
            ObservationColumn::Sensor(_) => _ = temperatures::celsius(row, k)?,
            ObservationColumn::Direction(i) => one.direction[i] = direction(row, k)?,
            ObservationColumn::Spindle => one.spindle = row.number(k)?,
            ObservationColumn::Time => one.time = Some(row.number(k)?),
            ObservationColumn::Temperature => one.temperature = Some(row.number(k)?),
            ObservationColumn::Sigma | ObservationColumn::SigmaOfAngle => {
                one.sigma = Some(sigma(row, k, kind)?);
            }
            // What is foreign to the kind is empty.
            ObservationColumn::Kind
            | ObservationColumn::Setup
            | ObservationColumn::Cycle
            | ObservationColumn::Reads
            | ObservationColumn::Value(..)
            | ObservationColumn::Normal(_) => {}
        }
        Ok(())
    }

    /// In which direction an instrument reads, and with which sign.
    fn direction_read(
        &self,
        row: &CsvRow<'_>,
        k: usize,
        kind: Kind,
    ) -> Result<(Sense, f64), FileError> {
        let words = row.text(k)?;
        let read = sense(words, self.machine);
        let read = read.map_err(|message| row.error(k, message, "here", DIRECTIONS))?;
        let is_length = matches!(read.0, Sense::In(_));
        if is_length != (kind == Kind::Displacement) {
            let message = format!("`{words}` is not the direction of {}", kind.one());
            return Err(row.error(k, message, "here", DIRECTIONS));
        }
        Ok(read)
    }
}

/// A reading (mm).
fn reading(row: &CsvRow<'_>, k: usize, kind: Kind) -> Result<f64, FileError> {
    let value = row.number(k)? * kind.columns().1;
    let most = match kind {
        Kind::Displacement | Kind::Angle | Kind::Surface => LARGEST_DEVIATION,
        Kind::Length | Kind::Point => LARGEST,
    };
    if value.abs() > most {
        let message = format!("{} cannot be a reading", row.cells[k].text);
        let remedy = "look at its unit, which the name of the column says";
        return Err(row.error(k, message, "here", remedy));
    }
    Ok(value)
}

/// The standard uncertainty of a reading (mm).
fn sigma(row: &CsvRow<'_>, k: usize, kind: Kind) -> Result<f64, FileError> {
    let (value, unit) = (row.number(k)?, kind.unit());
    match SIGMAS.contains(&value) {
        true => Ok(value * 1e-3),
        false => Err(row.error(
            k,
            format!("{value} {unit} cannot be the uncertainty of a reading"),
            "here",
            format!("write the standard uncertainty in {unit}, more than 0"),
        )),
    }
}

//! Observations as CSV: lengths, points, displacements and angles that instruments read, and deviations of the surfaces of
//! a part, a line for each.
//!
//! The header names the columns, in any order: `kind`, `setup` (optional: the name of the file), one column per axis
//! (mm, degrees), the reading of each kind that occurs (`length_mm`; `x_mm`, `y_mm`, `z_mm`; `displacement_um`;
//! `angle_urad`; `deviation_um`), `reads` for the direction of a displacement or an angle, `normal_x`, `normal_y`, `normal_z`
//! for that of a surface (coordinates of the part), and optionally `sigma_um` or `sigma_urad`
//! (standard uncertainty), `S` (spindle angle, degrees), `time_s`, `temperature_C`, `A_dir` …, and columns of
//! [`temperatures`]: `NAME_C` and `cycle`. A cell that does not
//! belong to the kind of its line is empty. Lines at the top that begin with `#` say in TOML what is known about the
//! set-ups.

mod converted;
mod heading;

use super::radii;
use super::runs::sense;
use super::temperatures::ThermalModel;
use super::{axis, is_in_travel, temperatures};
use crate::instrument::{Commanded, Kind, SetupPriors, turned};
pub use converted::of_surface;
use heading::ObservationHeading;
use nalgebra::{Matrix3, Vector3};
use std::fmt::Write;
use std::ops::RangeInclusive;
use trueaxis_model::explain::Sense;
use trueaxis_model::formats::csv::{CsvRow, CsvTable};
use trueaxis_model::machine::{MAX_AXES, Machine, PerAxis};
use trueaxis_model::source::FileError;

/// Everything that was observed besides probings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Observations {
    /// Names of the files.
    pub files: Vec<String>,
    /// The set-ups.
    pub setups: Vec<InstrumentSetup>,
    /// The points of the tool that are observed.
    pub tools: Vec<ToolPoint>,
    /// The observations, in the order of the files.
    pub rows: Vec<Observation>,
    /// Drift that is looked for, as found by [`drifting`](crate::identify::drifting).
    pub drift: Vec<Drift>,
    /// Temperatures on which parameters depend, as chosen by [`thermal`](crate::identify::thermal()).
    pub thermal: Option<ThermalModel>,
}

/// An instrument that was set up once.
#[derive(Clone, Debug, PartialEq)]
pub struct InstrumentSetup {
    /// Name of the instrument.
    pub name: String,
    /// What it reads.
    pub kind: Kind,
    /// What is known about it.
    pub given: SetupPriors,
    /// The point that it observes, as an index into [`Observations::tools`].
    pub tool: usize,
}

/// A point of the tool.
#[derive(Clone, Debug, PartialEq)]
pub struct ToolPoint {
    /// Name: that of its set-up, or one that several set-ups share; `stylus` is the stylus of the probings.
    pub name: String,
    /// Place in the spindle frame (mm), if it is not the tip of the machine file.
    pub place: Option<Vector3<f64>>,
    /// How well that is known.
    pub known: PlacePrior,
}

/// How well a place is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlacePrior {
    /// It is found from the observations.
    Unknown,
    /// With a standard uncertainty of each coordinate (mm).
    Within(f64),
    /// Exactly: observations hardly depend on it.
    Exactly,
}

/// The tool point that is the stylus of the probings.
pub const STYLUS: &str = "stylus";

/// One observation.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// Set-up, as an index into [`Observations::setups`].
    pub setup: usize,
    /// Axis positions (mm, deg).
    pub position: PerAxis,
    /// Direction from which each axis arrived: +1, −1, or 0 if unknown.
    pub direction: PerAxis,
    /// Angle of the spindle (deg).
    pub spindle: f64,
    /// Direction of a displacement or an angle, and its sign.
    pub reads: Option<(Sense, f64)>,
    /// Outward normal of a surface, of length 1 (coordinates of the part).
    pub normal: Option<Vector3<f64>>,
    /// The reading (mm; angles over [`LEVER`](crate::instrument::LEVER)); a scalar is the first component.
    pub value: Vector3<f64>,
    /// Standard uncertainty, of each coordinate (in the same unit).
    pub sigma: Option<f64>,
    /// Time (s).
    pub time: Option<f64>,
    /// Temperature (°C).
    pub temperature: Option<f64>,
    /// File, as an index into [`Observations::files`], and its line there, counted from 1.
    pub file: usize,
    /// See there.
    pub line: usize,
}

/// A component of the drift of the artefact or of a set-up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    /// The set-up, as an index into [`Observations::setups`]; `None` for the artefact.
    pub setup: Option<usize>,
    /// Along (0, 1, 2) or about (3, 4, 5) which axis of the workpiece frame.
    pub component: usize,
    /// Time constant (s) with which it approaches its end; `None` if it is linear in time.
    pub lag: Option<f64>,
    /// The time (s) of the first row.
    pub first: f64,
    /// The time (s) of the last row.
    pub last: f64,
}

impl Drift {
    /// The time (h) that linear drift of the same amount from the first to the last row would have taken until a time
    /// (s): half of it is before 0.
    #[must_use]
    pub fn hours(&self, time: f64) -> f64 {
        const HOUR: f64 = 3600.0;
        let span = self.last - self.first;
        match self.lag {
            None => (time - 0.5 * (self.first + self.last)) / HOUR,
            Some(lag) => {
                // 1 − e^(−t/τ), which goes from 0 to 1 from the first to the last row.
                let gone = |seconds: f64| -libm::expm1(-seconds / lag);
                (gone(time - self.first) / gone(span) - 0.5) * span / HOUR
            }
        }
    }

    /// Number of unknowns: the rate, and the time constant.
    #[must_use]
    pub fn unknowns(&self) -> usize {
        1 + usize::from(self.lag.is_some())
    }
}

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
const VALUES: &str = "write one value per column of the header, with a decimal point; leave cells empty that do not belong to the kind of the line";
const NORMALS: &str =
    "write the outward normal of the surface in the coordinates of the part, of length 1: 0, 0, 1";
/// How far the length of a normal may be from 1: measuring machines print three or more decimals.
const ROUNDED: f64 = 5e-3;
const DIRECTIONS: &str = "write tool or workpiece, and where it goes when the reading grows: tool +X, tool +C, tool +Y to +Z";

impl ObservationColumn {
    fn named(name: &str, machine: &Machine) -> Option<Self> {
        let axis = |name: &str| axis(name, machine);
        let named = NAMES
            .iter()
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

/// Reads observations. `file` is the name of the file, which is also that of its set-up if there is no column
/// `setup`. Files of [`runs`](super::runs) and of a [ball-bar](super::radii) are read, too.
///
/// # Errors
/// [`FileError`] with line, column, cause and remedy: whatever [`CsvTable`] refuses, a heading with unknown keys or a
/// set-up that no line has, a missing column, a value that is missing or belongs to another kind, a position outside
/// the travel, an impossible direction, reading or uncertainty.
pub fn read(text: &str, file: &str, machine: &Machine) -> Result<Observations, FileError> {
    opened(text, file, machine, true)
}

/// Like `read`, of a plan, which may lack readings: they are zero then.
///
/// # Errors
/// As for [`read`].
pub fn read_plan(text: &str, file: &str, machine: &Machine) -> Result<Observations, FileError> {
    opened(text, file, machine, false)
}

fn opened(
    text: &str,
    file: &str,
    machine: &Machine,
    has_readings: bool,
) -> Result<Observations, FileError> {
    match converted::first_column(text).0 {
        "target" | "line" => return converted::of_runs(text, file, machine),
        "angle" => return converted::of_radii(text, file, &radii::read(text)?, machine),
        _ if text.contains("radius_mm") => {
            return converted::of_radii(text, file, &radii::read(text)?, machine);
        }
        _ => {}
    }
    let (heading, start) = ObservationHeading::read(text)?;
    let letters = machine.axes.iter().map(|axis| axis.letter.to_string());
    let layout = format!(
        "write the header kind,setup,{} in any order, with the readings length_mm; x_mm,y_mm,z_mm; displacement_um or angle_urad (these with reads); deviation_um (with normal_x,normal_y,normal_z), and sigma_um, sigma_urad, S, time_s, temperature_C, NAME_C of other sensors or A_dir where they are known",
        letters.collect::<Vec<_>>().join(",")
    );
    let table = CsvTable::open(text, start, layout, VALUES)?;
    let columns = table.columns(0, |name| ObservationColumn::named(name, machine))?;
    let place = |column: ObservationColumn| columns.iter().position(|c| *c == column);
    let kind = place(ObservationColumn::Kind).ok_or_else(|| table.missing("kind"))?;
    for (i, axis) in machine.axes.iter().enumerate() {
        place(ObservationColumn::Axis(i)).ok_or_else(|| table.missing(axis.letter))?;
    }
    let setup = place(ObservationColumn::Setup);
    let header = table.header.clone();
    let mut all = Observations {
        files: vec![file.to_owned()],
        ..Observations::default()
    };
    for row in table {
        let row = row?;
        let name = row.text(kind)?;
        let of = Kind::ALL.into_iter().find(|kind| kind.name() == name);
        let Some(of) = of else {
            let names = Kind::ALL.map(Kind::name).join(", ");
            let message = format!("`{name}` is not a kind of observation");
            return Err(row.error(
                kind,
                message,
                "unknown kind",
                format!("write one of {names}"),
            ));
        };
        let name = setup.map_or(Ok(file), |k| row.text(k))?;
        let number = match all.setups.iter().position(|s| s.name == name) {
            Some(number) if all.setups[number].kind == of => number,
            Some(number) => {
                let other = all.setups[number].kind.one();
                return Err(row.error(
                    setup.unwrap_or(kind),
                    format!("the set-up `{name}` reads {other}, not {}", of.one()),
                    "here",
                    "give each instrument its own name in the column setup",
                ));
            }
            None => heading.add(&mut all, name, of),
        };
        for (k, column) in columns.iter().enumerate() {
            let is_foreign = match column {
                ObservationColumn::Value(kind, _) => *kind != of,
                ObservationColumn::Reads => !of.has_direction(),
                ObservationColumn::Normal(_) => of != Kind::Surface,
                ObservationColumn::Sigma => of.sigma() != "sigma_um",
                ObservationColumn::SigmaOfAngle => of.sigma() != "sigma_urad",
                _ => false,
            };
            if is_foreign && !row.cells[k].text.is_empty() {
                let message = format!("{} has no {}", of.one(), header.cells[k].text);
                return Err(row.error(k, message, "here", "leave the cell empty"));
            }
        }
        for name in of.columns().0 {
            let has = |c: &ObservationColumn| matches!(c, ObservationColumn::Value(kind, k) if *kind == of && of.columns().0[*k] == *name);
            if has_readings && !columns.iter().any(has) {
                let message = format!("{} needs the column `{name}`", of.one());
                return Err(FileError::at(
                    header.span.clone(),
                    message,
                    "the header",
                    "add it",
                ));
            }
        }
        if of.has_direction() && place(ObservationColumn::Reads).is_none() {
            return Err(FileError::at(
                header.span.clone(),
                format!("{} needs the column `reads`", of.one()),
                "the header",
                DIRECTIONS,
            ));
        }
        let has_normal = (0..3).all(|k| place(ObservationColumn::Normal(k)).is_some());
        if of == Kind::Surface && !has_normal {
            return Err(FileError::at(
                header.span.clone(),
                format!(
                    "{} needs the columns normal_x, normal_y and normal_z",
                    of.one()
                ),
                "the header",
                NORMALS,
            ));
        }
        let observation = observation(&row, &columns, machine, (of, number), has_readings)?;
        all.rows.push(observation);
    }
    heading.is_used(&all)?;
    Ok(all)
}

fn observation(
    row: &CsvRow<'_>,
    columns: &[ObservationColumn],
    machine: &Machine,
    (kind, setup): (Kind, usize),
    has_readings: bool,
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
    let unit = kind.columns().1;
    for (k, column) in columns.iter().enumerate() {
        let is_empty = row.cells[k].text.is_empty();
        match *column {
            ObservationColumn::Kind | ObservationColumn::Setup | ObservationColumn::Cycle => {}
            ObservationColumn::Sensor(_) if is_empty => {}
            ObservationColumn::Sensor(_) => _ = temperatures::celsius(row, k)?,
            ObservationColumn::Axis(i) => {
                let value = row.number(k)?;
                let axis = &machine.axes[i];
                if !axis.modulo {
                    let remedy = "correct the row, or the range of the axis in the machine file";
                    is_in_travel(row, k, axis, value, remedy)?;
                }
                one.position[i] = value;
            }
            ObservationColumn::Direction(_) if is_empty => {}
            ObservationColumn::Direction(i) => {
                let value = row.number(k)?;
                if ![1.0, -1.0, 0.0].contains(&value) {
                    return Err(row.error(
                        k,
                        format!("`{}` is not a direction", row.cells[k].text),
                        "here",
                        "write 1 after positive travel, -1 after negative travel, 0 if unknown",
                    ));
                }
                one.direction[i] = value;
            }
            ObservationColumn::Spindle if !is_empty => one.spindle = row.number(k)?,
            ObservationColumn::Time if !is_empty => one.time = Some(row.number(k)?),
            ObservationColumn::Temperature if !is_empty => one.temperature = Some(row.number(k)?),
            ObservationColumn::Spindle
            | ObservationColumn::Time
            | ObservationColumn::Temperature => {}
            ObservationColumn::Reads if kind.has_direction() => {
                let words = row.text(k)?;
                let read = sense(words, machine);
                let read = read.map_err(|message| row.error(k, message, "here", DIRECTIONS))?;
                let is_length = matches!(read.0, Sense::In(_));
                if is_length != (kind == Kind::Displacement) {
                    let message = format!("`{words}` is not the direction of {}", kind.one());
                    return Err(row.error(k, message, "here", DIRECTIONS));
                }
                one.reads = Some(read);
            }
            ObservationColumn::Value(..) if is_empty && !has_readings => {}
            ObservationColumn::Value(of, i) if of == kind => {
                let value = row.number(k)? * unit;
                let most = match kind {
                    Kind::Displacement | Kind::Angle | Kind::Surface => LARGEST_DEVIATION,
                    Kind::Length | Kind::Point => LARGEST,
                };
                if value.abs() > most {
                    let message = format!("{} cannot be a reading", row.cells[k].text);
                    let remedy = "look at its unit, which the name of the column says";
                    return Err(row.error(k, message, "here", remedy));
                }
                one.value[i] = value;
            }
            ObservationColumn::Sigma | ObservationColumn::SigmaOfAngle if !is_empty => {
                let value = row.number(k)?;
                if !SIGMAS.contains(&value) {
                    return Err(row.error(
                        k,
                        format!(
                            "{value} {} cannot be the uncertainty of a reading",
                            kind.unit()
                        ),
                        "here",
                        format!(
                            "write the standard uncertainty in {}, more than 0",
                            kind.unit()
                        ),
                    ));
                }
                one.sigma = Some(value * 1e-3);
            }
            ObservationColumn::Normal(i) if kind == Kind::Surface => {
                one.normal.get_or_insert_default()[i] = row.number(k)?;
            }
            ObservationColumn::Reads
            | ObservationColumn::Normal(_)
            | ObservationColumn::Value(..)
            | ObservationColumn::Sigma
            | ObservationColumn::SigmaOfAngle => {}
        }
    }
    if let Some(normal) = &mut one.normal {
        let length = normal.norm();
        if (length - 1.0).abs() >= ROUNDED {
            let first = columns
                .iter()
                .position(|c| *c == ObservationColumn::Normal(0));
            let message = format!("the normal has the length {length:.3}");
            return Err(row.error(first.unwrap_or(0), message, "here", NORMALS));
        }
        *normal /= length;
    }
    Ok(one)
}

impl Observations {
    /// Adds those of another file. Set-ups and tool points of the same name are the same.
    ///
    /// # Errors
    /// Cause and remedy: a set-up of the same name reads something else, or is described differently.
    pub fn add(&mut self, other: Self) -> Result<(), (String, String)> {
        let files = self.files.len();
        let mut tools = Vec::new();
        for tool in other.tools {
            let known = self.tools.iter().position(|t| t.name == tool.name);
            tools.push(known.unwrap_or(self.tools.len()));
            match known {
                None => self.tools.push(tool),
                Some(known) if self.tools[known] == tool => {}
                Some(_) => return Err(differ(&format!("tool point `{}`", tool.name))),
            }
        }
        let mut setups = Vec::new();
        for mut setup in other.setups {
            setup.tool = tools[setup.tool];
            let known = self.setups.iter().position(|s| s.name == setup.name);
            setups.push(known.unwrap_or(self.setups.len()));
            match known {
                None => self.setups.push(setup),
                Some(known) if self.setups[known] == setup => {}
                Some(_) => return Err(differ(&format!("set-up `{}`", setup.name))),
            }
        }
        self.files.extend(other.files);
        self.rows
            .extend(other.rows.into_iter().map(|row| Observation {
                setup: setups[row.setup],
                file: files + row.file,
                ..row
            }));
        Ok(())
    }

    /// Without the observations that are named: `setup bar`, `bar.csv line 12`, or a position such as `C = 90` or
    /// `S = 180`. `None` if it names none.
    #[must_use]
    pub fn without(&self, machine: &Machine, what: &str) -> Option<Self> {
        /// Positions (deg or mm) that differ by less are equal.
        const SAME: f64 = 1e-3;
        let mut left = self.clone();
        if let Some((axis, value)) = what.split_once('=') {
            let value: f64 = value.trim().trim_end_matches('°').parse().ok()?;
            let axis = axis.trim().to_ascii_uppercase();
            let index = machine
                .axes
                .iter()
                .position(|a| a.letter.to_string() == axis);
            let at = |row: &Observation| match axis.as_str() {
                "S" => Some(row.spindle),
                _ => index.map(|i| row.position[i]),
            };
            left.rows
                .retain(|row| !at(row).is_some_and(|at| (at - value).abs() < SAME));
        } else {
            let (first, name) = what.trim().split_once(char::is_whitespace)?;
            let name = name.trim();
            if first == "setup" {
                let number = self.setups.iter().position(|s| s.name == name)?;
                left.rows.retain(|row| row.setup != number);
            } else {
                let line: usize = name.strip_prefix("line")?.trim().parse().ok()?;
                let is_out = |row: &Observation| self.files[row.file] == first && row.line == line;
                left.rows.retain(|row| !is_out(row));
            }
        }
        (left.rows.len() < self.rows.len()).then_some(left)
    }

    /// The commands of all observations, as far as readings depend on them.
    #[must_use]
    pub fn commanded(&self, machine: &Machine) -> Vec<Commanded> {
        let mut first = vec![None; self.setups.len()];
        let each = self.rows.iter().map(|row| {
            let setup = &self.setups[row.setup];
            let tip = self.tip(machine, setup.tool);
            let tip = turned(machine.tool_axis, row.spindle) * tip;
            let q = machine.to_kinematic(&row.position);
            let mut one = Commanded::at(machine, &q, &tip, row.reads);
            one.travel = one.point - *first[row.setup].get_or_insert(one.point);
            if let Some(normal) = row.normal {
                one.along = normal;
                one.travel = setup.given.setting().turn.tr_mul(&one.travel);
            }
            one
        });
        each.collect()
    }

    /// The place of a tool point, as stated (mm, spindle frame).
    #[must_use]
    pub fn tip(&self, machine: &Machine, tool: usize) -> Vector3<f64> {
        let place = self.tools[tool].place;
        place.unwrap_or(Vector3::from(machine.tip))
    }
}

fn differ(what: &str) -> (String, String) {
    (
        format!("the {what} of two files is not the same"),
        "give them different names, or describe it in both files in the same words".to_owned(),
    )
}

/// Writes observations: all columns that any row has, positions and lengths with nine decimals, other readings with
/// six.
#[must_use]
pub fn write(all: &Observations, machine: &Machine) -> String {
    let mut text = heading::write(all);
    let kinds: Vec<Kind> = Kind::ALL
        .into_iter()
        .filter(|kind| all.setups.iter().any(|s| s.kind == *kind))
        .collect();
    let has_sigma = |name: &str| {
        let mut rows = all.rows.iter();
        rows.any(|row| row.sigma.is_some() && all.setups[row.setup].kind.sigma() == name)
    };
    let directions = |i: &usize| all.rows.iter().any(|row| row.direction[*i] != 0.0);
    let directed: Vec<usize> = (0..machine.axes.len()).filter(directions).collect();
    let has = |of: fn(&Observation) -> bool| all.rows.iter().any(of);
    let (has_s, has_reads) = (has(|r| r.spindle != 0.0), has(|r| r.reads.is_some()));
    let has_normal = has(|r| r.normal.is_some());
    let (has_t, has_c) = (has(|r| r.time.is_some()), has(|r| r.temperature.is_some()));
    let sigmas: Vec<&str> = ["sigma_um", "sigma_urad"]
        .into_iter()
        .filter(|name| has_sigma(name))
        .collect();
    let mut header: Vec<String> = vec!["kind".to_owned(), "setup".to_owned()];
    header.extend(machine.axes.iter().map(|axis| axis.letter.to_string()));
    header.extend(
        directed
            .iter()
            .map(|i| format!("{}_dir", machine.axes[*i].letter)),
    );
    header.extend(has_s.then(|| "S".to_owned()));
    header.extend(has_reads.then(|| "reads".to_owned()));
    let normals = ["normal_x", "normal_y", "normal_z"];
    header.extend(
        normals
            .map(str::to_owned)
            .into_iter()
            .filter(|_| has_normal),
    );
    for kind in &kinds {
        header.extend(kind.columns().0.iter().map(|name| (*name).to_owned()));
    }
    header.extend(sigmas.iter().map(|name| (*name).to_owned()));
    header.extend(has_t.then(|| "time_s".to_owned()));
    header.extend(has_c.then(|| "temperature_C".to_owned()));
    let _ = writeln!(text, "{}", header.join(","));
    for row in &all.rows {
        let setup = &all.setups[row.setup];
        let mut cells = vec![setup.kind.name().to_owned(), setup.name.clone()];
        let positions = row.position.iter().take(machine.axes.len());
        cells.extend(positions.map(|q| rounded(*q, 9)));
        cells.extend(directed.iter().map(|i| row.direction[*i].to_string()));
        cells.extend(has_s.then(|| row.spindle.to_string()));
        cells.extend(has_reads.then(|| row.reads.map_or(String::new(), |r| words(r, machine))));
        let normal = |k: usize| row.normal.map_or(String::new(), |n| rounded(n[k], 9));
        cells.extend((0..3).filter(|_| has_normal).map(normal));
        for kind in &kinds {
            let (names, unit) = kind.columns();
            let digits = if unit == 1.0 { 9 } else { 6 };
            let cell = |k: usize| match *kind == setup.kind {
                true => rounded(row.value[k] / unit, digits),
                false => String::new(),
            };
            cells.extend((0..names.len()).map(cell));
        }
        cells.extend(sigmas.iter().map(|name| {
            let own = row.sigma.filter(|_| setup.kind.sigma() == *name);
            own.map_or(String::new(), |s| rounded(s * 1e3, 9))
        }));
        let optional = |value: Option<f64>| value.map_or(String::new(), |v| v.to_string());
        cells.extend(has_t.then(|| optional(row.time)));
        cells.extend(has_c.then(|| optional(row.temperature)));
        let _ = writeln!(text, "{}", cells.join(","));
    }
    text
}

/// A number without trailing zeros.
fn rounded(value: f64, digits: i32) -> String {
    let scale = 10_f64.powi(digits);
    // Avoids -0.
    ((value * scale).round() / scale + 0.0).to_string()
}

/// A direction as [`sense`] reads it.
fn words((sense, sign): (Sense, f64), machine: &Machine) -> String {
    let letter = |axis: usize| machine.axes[axis].letter;
    match (sense, sign < 0.0) {
        (Sense::In(axis) | Sense::About(axis), false) => format!("tool +{}", letter(axis)),
        (Sense::In(axis) | Sense::About(axis), true) => format!("tool -{}", letter(axis)),
        (Sense::From(a, b), false) => format!("tool +{} to +{}", letter(a), letter(b)),
        (Sense::From(a, b), true) => format!("tool +{} to +{}", letter(b), letter(a)),
    }
}

/// Rotations (deg) about x, y and z, in this order, of an orientation in a file.
fn angles(turn: &Matrix3<f64>) -> [f64; 3] {
    let y = libm::asin(turn[(0, 2)].clamp(-1.0, 1.0));
    let x = libm::atan2(-turn[(1, 2)], turn[(2, 2)]);
    let z = libm::atan2(-turn[(0, 1)], turn[(0, 0)]);
    [x, y, z].map(f64::to_degrees)
}

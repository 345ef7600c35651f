//! Observations as CSV: lengths, points, displacements and angles that instruments read, and deviations of the surfaces of
//! a part, a line for each.
//!
//! The header names the columns, in any order: `kind`, `setup` (optional: the name of the file), one column per axis
//! (mm, degrees), the reading of each kind that occurs (`length_mm`; `x_mm`, `y_mm`, `z_mm`; `displacement_um`;
//! `angle_urad`; `deviation_um`), `reads` for the direction of a displacement or an angle, `normal_x`, `normal_y`, `normal_z`
//! for that of a surface (coordinates of the part), and optionally `sigma_um` or `sigma_urad`
//! (standard uncertainty), `S` (spindle angle, degrees), `time_s`, `temperature_C`, `A_dir` …, and columns of
//! [`temperatures`](super::temperatures): `NAME_C` and `cycle`. A cell that does not
//! belong to the kind of its line is empty. Lines at the top that begin with `#` say in TOML what is known about the
//! set-ups.

mod columns;
mod converted;
mod heading;

use super::temperatures::ThermalModel;
use crate::instrument::{Commanded, Kind, SetupPriors, turned};
use columns::Columns;
pub use converted::of_surface;
use heading::ObservationHeading;
use nalgebra::{Matrix3, Vector3};
use trueaxis_direct::formats::radii;
use trueaxis_model::explain::Sense;
use trueaxis_model::formats::csv::CsvTable;
use trueaxis_model::machine::{Machine, PerAxis};
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
    /// Drift that is looked for, as found by [`drifting`](crate::drifting).
    pub drift: Vec<Drift>,
    /// Temperatures on which parameters depend, as chosen by [`thermal`](crate::thermal()).
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

const VALUES: &str = "write one value per column of the header, with a decimal point; leave cells empty that do not belong to the kind of the line";

/// Reads observations. `file` is the name of the file, which is also that of its set-up if there is no column
/// `setup`. Files of [`runs`](trueaxis_direct::formats::runs) and of a [ball-bar](trueaxis_direct::formats::radii) are
/// read, too.
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
        first if first == "angle" || text.contains("radius_mm") => {
            return converted::of_radii(text, file, &radii::read(text)?, machine);
        }
        _ => {}
    }
    let (heading, start) = ObservationHeading::read(text)?;
    let table = CsvTable::open(text, start, layout(machine), VALUES)?;
    let columns = Columns::of(&table, machine, has_readings)?;
    let mut all = Observations {
        files: vec![file.to_owned()],
        ..Observations::default()
    };
    for row in table {
        let row = row?;
        let kind = columns.kind(&row)?;
        let name = columns.setup.map_or(Ok(file), |k| row.text(k))?;
        let setup = match all.setups.iter().position(|s| s.name == name) {
            Some(number) if all.setups[number].kind == kind => number,
            Some(number) => {
                return Err(columns.other_kind(&row, name, [kind, all.setups[number].kind]));
            }
            None => heading.add(&mut all, name, kind),
        };
        columns.fit(&row, kind)?;
        all.rows.push(columns.observation(&row, kind, setup)?);
    }
    heading.is_used(&all)?;
    Ok(all)
}

/// What a file has to look like.
fn layout(machine: &Machine) -> String {
    let letters = machine.axes.iter().map(|axis| axis.letter.to_string());
    format!(
        "write the header kind,setup,{} in any order, with the readings length_mm; x_mm,y_mm,z_mm; displacement_um or angle_urad (these with reads); deviation_um (with normal_x,normal_y,normal_z), and sigma_um, sigma_urad, S, time_s, temperature_C, NAME_C of other sensors or A_dir where they are known",
        letters.collect::<Vec<_>>().join(",")
    )
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

/// The name of a column, and its cell in a row.
type WrittenColumn<'a> = (String, Box<dyn Fn(&Observation) -> String + 'a>);

/// Which rows these are, and where they were measured.
fn written_places<'a>(all: &'a Observations, machine: &'a Machine) -> Vec<WrittenColumn<'a>> {
    let mut columns: Vec<WrittenColumn<'a>> = vec![
        (
            "kind".to_owned(),
            Box::new(|row| all.setups[row.setup].kind.name().to_owned()),
        ),
        (
            "setup".to_owned(),
            Box::new(|row| all.setups[row.setup].name.clone()),
        ),
    ];
    for (i, axis) in machine.axes.iter().enumerate() {
        let cell = move |row: &Observation| rounded(row.position[i], 9);
        columns.push((axis.letter.to_string(), Box::new(cell)));
    }
    for (i, axis) in machine.axes.iter().enumerate() {
        if all.rows.iter().any(|row| row.direction[i] != 0.0) {
            let cell = move |row: &Observation| row.direction[i].to_string();
            columns.push((format!("{}_dir", axis.letter), Box::new(cell)));
        }
    }
    columns
}

/// What was read there, and how; columns of which all cells are empty are left out.
fn written_readings<'a>(all: &'a Observations, machine: &'a Machine) -> Vec<WrittenColumn<'a>> {
    type OptionalCell<'a> = Box<dyn Fn(&Observation) -> Option<String> + 'a>;
    let mut columns: Vec<WrittenColumn<'a>> = Vec::new();
    let mut add = |name: &str, cell: OptionalCell<'a>| {
        if all.rows.iter().any(|row| cell(row).is_some()) {
            let cell = move |row: &Observation| cell(row).unwrap_or_default();
            columns.push((name.to_owned(), Box::new(cell)));
        }
    };
    if all.rows.iter().any(|row| row.spindle != 0.0) {
        add("S", Box::new(|row| Some(row.spindle.to_string())));
    }
    add("reads", Box::new(|row| Some(words(row.reads?, machine))));
    for (k, name) in ["normal_x", "normal_y", "normal_z"].into_iter().enumerate() {
        add(name, Box::new(move |row| Some(rounded(row.normal?[k], 9))));
    }
    let kind = |row: &Observation| all.setups[row.setup].kind;
    for own in Kind::ALL {
        let (names, unit) = own.columns();
        let digits = if unit == 1.0 { 9 } else { 6 };
        for (k, name) in names.iter().enumerate() {
            let cell = move |row: &Observation| rounded(row.value[k] / unit, digits);
            add(
                name,
                Box::new(move |row| (kind(row) == own).then(|| cell(row))),
            );
        }
    }
    for name in ["sigma_um", "sigma_urad"] {
        let own = move |row: &Observation| row.sigma.filter(|_| kind(row).sigma() == name);
        add(name, Box::new(move |row| Some(rounded(own(row)? * 1e3, 9))));
    }
    add("time_s", Box::new(|row| Some(row.time?.to_string())));
    add(
        "temperature_C",
        Box::new(|row| Some(row.temperature?.to_string())),
    );
    columns
}

/// Writes observations: all columns that any row has, positions and lengths with nine decimals, other readings with
/// six.
#[must_use]
pub fn write(all: &Observations, machine: &Machine) -> String {
    let mut columns = written_places(all, machine);
    columns.extend(written_readings(all, machine));
    let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
    let mut text = format!("{}{}\n", heading::write(all), names.join(","));
    for row in &all.rows {
        let cells: Vec<String> = columns.iter().map(|(_, cell)| cell(row)).collect();
        text += &format!("{}\n", cells.join(","));
    }
    text
}

/// A number without trailing zeros.
fn rounded(value: f64, digits: i32) -> String {
    let scale = 10_f64.powi(digits);
    // Avoids -0.
    ((value * scale).round() / scale + 0.0).to_string()
}

/// A direction as [`sense`](trueaxis_direct::formats::runs::sense) reads it.
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

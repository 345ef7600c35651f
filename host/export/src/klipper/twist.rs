//! `[axis_twist_compensation]` of Klipper: what a probe beside the nozzle reads wrong because the axes twist.
//!
//! Klipper adds a value to each reading of the probe, never to a motion: one over X, linear between equidistant points of
//! `z_compensations`, and one over Y from `zy_compensations`; beyond its ends a straight line goes on. The mean of each
//! table is zero, because `z_offset` of the probe has the constant. Source: `axis_twist_compensation.py` of Klipper.
//!
//! The calibration stores each value under the place of the bed that probe and nozzle touched; for the reading, the nozzle
//! stood at that place minus the offset of the probe. [`Lookup`] says under which position a firmware looks a value up.

use super::config::sections;
use crate::NotExported;
use crate::sampled::{Nodes, SampledGrid};
use std::fmt::Write;
use trueaxis_model::errors::{ErrorModel, Parameter, Situation, Switches};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_model::source::FileError;

/// Under which position a firmware looks up the value of a reading.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Lookup {
    /// That of the probe over the bed: Klipper since its pull request 7343 (August 2026).
    #[default]
    Bed,
    /// That of the nozzle: Klipper before, and Kalico.
    Nozzle,
}

impl Lookup {
    /// The firmware that does so.
    #[must_use]
    pub fn firmware(self) -> &'static str {
        match self {
            Self::Bed => "Klipper since August 2026 (pull request 7343)",
            Self::Nozzle => "Klipper before August 2026 (pull request 7343), and Kalico",
        }
    }
}

/// A table along X or Y.
#[derive(Clone, Debug, PartialEq)]
pub struct TwistTable {
    /// Positions in the file (mm).
    pub nodes: Nodes,
    /// What is added to a reading (mm).
    pub values: Vec<f64>,
}

impl TwistTable {
    /// True if its values are only rounded.
    fn is_zero(&self) -> bool {
        self.values.iter().all(|value| value.abs() <= NOTHING)
    }

    /// What Klipper adds to a reading of the probe.
    #[must_use]
    pub fn at(&self, position: f64) -> f64 {
        let along = (position - self.nodes.start) / self.nodes.step;
        let node = along.floor().clamp(0.0, (self.nodes.count - 2) as f64);
        let [a, b] = [0, 1].map(|next| self.values[node as usize + next]);
        a + (along - node) * (b - a)
    }
}

/// What to do if a machine or a probe has no twist that the tables could hold.
const PROBE: &str = "give --probe x_offset and y_offset of [probe], and the machine file of this printer, with X, Y and Z";

fn no_axes() -> NotExported {
    let cause = "the machine has no axes X, Y and Z along x, y and z";
    NotExported::new(cause, PROBE)
}

/// A probe beside the nozzle of a machine.
pub struct NozzleProbe<'m> {
    kinematics: Kinematics<'m>,
    /// From nozzle to probe (mm), as in `[probe]`: how much X and Y move until the nozzle is where the probe was.
    offset: [f64; 2],
    /// The axes X, Y, Z.
    axes: [usize; 3],
    /// Z where it probes (mm).
    bed: f64,
}

impl<'m> NozzleProbe<'m> {
    /// A probe at `offset`, which touches a bed at the position `bed` of Z.
    ///
    /// # Errors
    /// [`NotExported`]
    pub fn new(
        machine: &'m Machine,
        errors: &'m ErrorModel,
        offset: [f64; 2],
        bed: f64,
    ) -> Result<Self, NotExported> {
        let index = |letter| machine.index(letter).ok_or_else(no_axes);
        let axes = [index('X')?, index('Y')?, index('Z')?];
        if machine.axes.len() != 3 {
            return Err(no_axes());
        }
        let kinematics = Kinematics::new(machine, errors);
        for (k, axis) in axes.into_iter().enumerate() {
            let mut q = PerAxis::default();
            let before = kinematics.nominal(&q, None).t;
            q[axis] = 1.0;
            let moved = kinematics.nominal(&q, None).t - before;
            // A direction whose other components are a millionth is that of an axis.
            if (moved[k].abs() - 1.0).abs() > 1e-6 {
                return Err(no_axes());
            }
        }
        let probe = Self {
            kinematics,
            offset,
            axes,
            bed,
        };
        probe.range(0)?;
        probe.range(1)?;
        Ok(probe)
    }

    /// Positions of X (0) or Y (1) at which both probe and nozzle reach the same point.
    ///
    /// # Errors
    /// [`NotExported`]
    pub fn range(&self, k: usize) -> Result<[f64; 2], NotExported> {
        let axis = &self.kinematics.machine.axes[self.axes[k]];
        let [low, high] = axis.travel;
        let offset = self.offset[k];
        let range = [low - offset.min(0.0), high - offset.max(0.0)];
        match range[0] < range[1] {
            true => Ok(range),
            false => Err(NotExported::new(
                format!(
                    "the travel of {} is not longer than the probe is away from the nozzle",
                    axis.letter
                ),
                PROBE,
            )),
        }
    }

    /// Where the axes are (mm).
    fn command(&self, [x, y]: [f64; 2]) -> PerAxis {
        let mut q = PerAxis::default();
        for (axis, value) in self.axes.into_iter().zip([x, y, self.bed]) {
            q[axis] = value;
        }
        q
    }

    /// How much higher than commanded a point is that X and Y would reach with the nozzle if they moved by `offset` (mm).
    fn up(&self, position: [f64; 2], offset: [f64; 2]) -> f64 {
        let q = self.command(position);
        let moved = self.command([position[0] + offset[0], position[1] + offset[1]]);
        let nominal = self.kinematics.nominal(&q, None);
        let actual = (self.kinematics).actual(&q, &Situation::default(), &Switches::ALL);
        let beside = self.kinematics.nominal(&moved, None).t - nominal.t;
        (actual.t + actual.r * (nominal.r.transpose() * beside) - nominal.t - beside).z
    }

    /// How much higher the bed seems to the nozzle than to the probe, at a position of X and Y while probing (mm).
    #[must_use]
    pub fn missing(&self, position: [f64; 2]) -> f64 {
        let [x, y] = [0, 1].map(|k| position[k] + self.offset[k]);
        self.up(position, self.offset) - self.up([x, y], [0.0; 2])
    }

    /// How far the position in the table is from that of the tool while probing.
    fn shift(&self, k: usize, lookup: Lookup) -> f64 {
        match lookup {
            Lookup::Bed => self.offset[k],
            Lookup::Nozzle => 0.0,
        }
    }

    /// The tables along X and Y with `points` each, each through the middle of the other axis.
    ///
    /// # Errors
    /// [`NotExported`]
    pub fn tables(&self, points: usize, lookup: Lookup) -> Result<[TwistTable; 2], NotExported> {
        let ranges = [self.range(0)?, self.range(1)?];
        let middle = ranges.map(|[low, high]| (low + high) / 2.0);
        Ok([0, 1].map(|k| {
            let shift = self.shift(k, lookup);
            let nodes = Nodes::over(ranges[k].map(|end| end + shift), points);
            let values = (0..points).map(|i| {
                let mut position = middle;
                position[k] = nodes.at(i) - shift;
                self.missing(position)
            });
            let values: Vec<f64> = values.collect();
            let mean = values.iter().sum::<f64>() / points as f64;
            let values = values.into_iter().map(|value| value - mean).collect();
            TwistTable { nodes, values }
        }))
    }

    /// Largest reading that is wrong by twist (µm), and what the tables leave of it; both but for a constant.
    ///
    /// # Errors
    /// [`NotExported`]
    pub fn left(&self, tables: &[TwistTable; 2], lookup: Lookup) -> Result<[f64; 2], NotExported> {
        /// Places along each axis.
        const PLACES: usize = 61;
        let nodes = [
            Nodes::over(self.range(0)?, PLACES),
            Nodes::over(self.range(1)?, PLACES),
        ];
        let all = SampledGrid::of(&nodes, |p| {
            let missing = self.missing([p[0], p[1]]);
            let [x, y] = [0, 1].map(|k| tables[k].at(p[k] + self.shift(k, lookup)));
            [missing, missing - x - y]
        });
        let half_range = |k: usize| {
            let values = all.values.iter().map(|v| v[k]);
            let [low, high] = values.fold([f64::MAX, f64::MIN], |[low, high], v| {
                [low.min(v), high.max(v)]
            });
            (high - low) / 2.0 * 1e3
        };
        Ok([half_range(0), half_range(1)])
    }

    /// Where the tool stood while the values of a table were probed, in any version of Klipper.
    #[must_use]
    pub fn probed_at(&self, k: usize, table: &TwistTable) -> Vec<f64> {
        let shift = self.shift(k, Lookup::Bed);
        let nodes = 0..table.nodes.count;
        nodes.map(|i| table.nodes.at(i) - shift).collect()
    }

    /// Refuses a table that this machine cannot have measured with this probe.
    fn reaches(&self, k: usize, table: &TwistTable) -> Result<(), NotExported> {
        /// Klipper writes positions (mm) to as much.
        const POSITIONS: f64 = 0.01;
        let [low, high] = self.range(k)?;
        let at = self.probed_at(k, table);
        let (first, last) = (at[0], at[at.len() - 1]);
        if first >= low - POSITIONS && last <= high + POSITIONS {
            return Ok(());
        }
        let axis = self.kinematics.machine.axes[self.axes[k]].letter;
        Err(NotExported::new(
            format!(
                "{axis} stood at {first:.2} to {last:.2} mm while probing, and nozzle and probe reach the same places from {low} to {high} mm only"
            ),
            PROBE,
        ))
    }

    /// The roll of X or Y (rad) that explains a table, where [`Self::probed_at`] says: E A X or E B Y.
    ///
    /// # Errors
    /// [`NotExported`]
    pub fn roll(&self, k: usize, table: &TwistTable) -> Result<Vec<f64>, NotExported> {
        /// A roll for the derivative (rad).
        const ROLL: f64 = 1e-5;
        /// The least lever (mm).
        const LEVER: f64 = 1e-3;
        let machine = self.kinematics.machine;
        let axis = machine.axes[self.axes[k]].letter.char();
        let name = ["EAX0", "EBY0"][k];
        let mut errors = ErrorModel::perfect(machine);
        if let Some(parameter) = Parameter::parse(name) {
            errors.set(machine, parameter, ROLL);
        }
        let mut offset = [0.0; 2];
        offset[1 - k] = self.offset[1 - k];
        let rolled = NozzleProbe::new(machine, &errors, offset, self.bed)?;
        let mut position = [0, 1].map(|i| {
            let [low, high] = machine.axes[self.axes[i]].travel;
            (low + high) / 2.0
        });
        let places = self.probed_at(k, table);
        let values = places.iter().zip(&table.values).map(|(at, value)| {
            position[k] = *at;
            let by_roll = rolled.missing(position) / ROLL;
            let nozzle = rolled.up(position, [0.0; 2]) / ROLL;
            if by_roll.abs() <= LEVER {
                return Err(NotExported::new(
                    format!(
                        "a roll of {axis} does not move a probe at this place up or down more than the nozzle that follows it"
                    ),
                    PROBE,
                ));
            }
            if self.offset[k] != 0.0 && nozzle.abs() > LEVER {
                return Err(NotExported::new(
                    format!(
                        "a roll of {axis} moves the nozzle up and down, too, and the nozzle follows the probe after {axis} has moved: the table cannot tell the two rolls apart"
                    ),
                    "place the frame of this axis (origin_mm) in the machine file so that the nozzle has no lever about it",
                ));
            }
            Ok(value / by_roll)
        });
        values.collect()
    }
}

/// The section, for `printer.cfg`.
#[must_use]
pub fn print(tables: &[TwistTable; 2], lookup: Lookup) -> String {
    let mut text = format!("# for {}\n[axis_twist_compensation]\n", lookup.firmware());
    for (twist, (letter, key)) in tables.iter().zip(KEYS) {
        let values = twist.values.iter().map(|v| format!("{v:.6}"));
        let nodes = twist.nodes;
        let _ = write!(
            text,
            "{key} = {}\ncompensation_start_{letter} = {:.6}\ncompensation_end_{letter} = {:.6}\n",
            values.collect::<Vec<_>>().join(", "),
            nodes.start,
            nodes.at(nodes.count - 1)
        );
    }
    text
}

/// The letters of the axes in keys, and the key of their values.
const KEYS: [(char, &str); 2] = [('x', "z_compensations"), ('y', "zy_compensations")];

/// Reads the section: the tables along X and Y that it has.
///
/// # Errors
/// [`FileError`]
pub fn read(text: &str) -> Result<[Option<TwistTable>; 2], FileError> {
    match tables(text)? {
        [None, None] => Err(FileError::whole(
            "there is no [axis_twist_compensation] with values",
            "run AXIS_TWIST_COMPENSATION_CALIBRATE and SAVE_CONFIG, and give printer.cfg",
        )),
        tables => Ok(tables),
    }
}

/// Along which of X and Y the probe has measured as the nozzle would have, because a table corrected its readings.
///
/// # Errors
/// As for [`read`], except that a file without tables is fine.
pub fn corrects(text: &str) -> Result<[bool; 2], FileError> {
    let is_one = |table: Option<TwistTable>| table.is_some_and(|table| !table.is_zero());
    Ok(tables(text)?.map(is_one))
}

fn tables(text: &str) -> Result<[Option<TwistTable>; 2], FileError> {
    let sections = sections(text);
    let own = (sections.iter()).find(|s| s.name == "axis_twist_compensation");
    let given = |key: &str| own.and_then(|section| section.given(key));
    let mut tables = [None, None];
    for (table, (letter, key)) in tables.iter_mut().zip(KEYS) {
        // Klipper takes an empty list for no table.
        let Some(values) = given(key).filter(|values| !values.lines.is_empty()) else {
            continue;
        };
        let number = |which: &str| {
            let key = format!("compensation_{which}_{letter}");
            let missing = || {
                let message = format!("[axis_twist_compensation] has no `{key}`");
                values.line.bad(message, STORED)
            };
            given(&key).ok_or_else(missing)?.number()
        };
        let range = [number("start")?, number("end")?];
        let found = values.numbers()?;
        if let Some(value) = found.iter().find(|v| v.abs() >= HIGHEST) {
            let message = format!("`{key}` has {value}: no axis twists that far");
            return Err(values
                .line
                .bad(message, "give values in mm, or calibrate again"));
        }
        if found.len() < 2 || range[0] >= range[1] {
            let message = "a table needs two values, and an end after its start";
            return Err(values.line.bad(message, STORED));
        }
        *table = Some(TwistTable {
            nodes: Nodes::over(range, found.len()),
            values: found,
        });
    }
    Ok(tables)
}

/// The tables along X and Y of what [`print()`] has written, as the firmware reads them.
///
/// # Errors
/// [`NotExported`] if it is not read.
pub fn read_again(text: &str) -> Result<[TwistTable; 2], NotExported> {
    match read(text).map_err(NotExported::unread)? {
        [Some(x), Some(y)] => Ok([x, y]),
        _ => Err(NotExported::unread(FileError::whole(
            "a table is missing",
            STORED,
        ))),
    }
}

/// Values (mm) from here on are no twist: a probe 30 mm beside the nozzle would hang by 2°.
const HIGHEST: f64 = 1.0;
/// Remedy for a section that Klipper did not write.
const STORED: &str =
    "give the section as AXIS_TWIST_COMPENSATION_CALIBRATE and SAVE_CONFIG store it";
/// A value (mm) that is only rounded: the tables have six decimals.
const NOTHING: f64 = 1e-6;

/// The rolls that explain tables.
#[derive(Clone, Debug)]
pub struct TwistErrors {
    /// The error file.
    pub text: String,
    /// Names of the motions in it; a table of nothing has none.
    pub motions: Vec<&'static str>,
    /// What no roll explains, and why.
    pub left_out: Vec<String>,
}

impl TwistErrors {
    /// The rolls that explain the tables.
    ///
    /// # Errors
    /// [`NotExported`]: the axes cannot have stood there, or no roll explains any of the tables.
    pub fn of(
        probe: &NozzleProbe<'_>,
        tables: &[Option<TwistTable>; 2],
    ) -> Result<Self, NotExported> {
        let name = toml::Value::from(probe.kinematics.machine.name.as_str());
        let mut found = Self {
            text: format!(
                "# Roll of X and Y from [axis_twist_compensation] of Klipper.\nmachine = {name}\n"
            ),
            motions: Vec::new(),
            left_out: Vec::new(),
        };
        let mut refused = None;
        for (k, table) in tables.iter().enumerate() {
            let Some(table) = table.as_ref().filter(|table| !table.is_zero()) else {
                continue;
            };
            probe.reaches(k, table)?;
            let roll = match probe.roll(k, table) {
                Ok(roll) => roll,
                Err(error) => {
                    found
                        .left_out
                        .push(format!("{}: {}", KEYS[k].1, error.cause));
                    refused = Some(error);
                    continue;
                }
            };
            let list =
                |values: &mut dyn Iterator<Item = String>| values.collect::<Vec<_>>().join(", ");
            let places = probe.probed_at(k, table).into_iter();
            let at = list(&mut places.map(|at| format!("{:?}", rounded(at, 1e9))));
            let values = list(&mut roll.iter().map(|v| format!("{:?}", rounded(v * 1e6, 1e6))));
            let motion = ["EAX", "EBY"][k];
            let _ = write!(
                found.text,
                "\n[tabulated.{motion}]\nat = [{at}]\nvalue = [{values}]\nunit = \"urad\"\n"
            );
            found.motions.push(motion);
        }
        match refused.filter(|_| found.motions.is_empty()) {
            Some(error) => Err(error),
            None => Ok(found),
        }
    }
}

/// To 1 / `steps`, and never −0.
fn rounded(value: f64, steps: f64) -> f64 {
    (value * steps).round() / steps + 0.0
}

#[cfg(test)]
mod tests;

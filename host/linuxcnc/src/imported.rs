//! What LinuxCNC compensates by itself, `COMP_FILE` and `BACKLASH`, as errors of the machine.
//!
//! Per joint, LinuxCNC adds a correction c to the command: from a file of positions p, linear in between and constant
//! outside, or half of the backlash after positive travel and minus half of it after negative travel. A file replaces
//! the backlash. The error of the axis is −c, or c if a positive command moves the carriage the negative way.

use crate::comp_file::{self, CompFileRow, Type};
use crate::configuration::{Configuration, JointAxis, Open};
use crate::formats::ini::IniEntry;
use std::fmt::Write;
use trueaxis_model::source::FileError;

/// Corrections that LinuxCNC adds to the command of a joint, in its unit.
#[derive(Clone, Debug, PartialEq)]
enum JointCorrections {
    /// Position, correction after positive travel, correction after negative travel.
    Table(Vec<CompFileRow>),
    /// Twice the correction after positive travel.
    Backlash(f64),
}

/// What the INI file compensates on a joint.
#[derive(Clone, Debug)]
pub struct Import {
    joint: JointAxis,
    corrections: JointCorrections,
    /// The entry, as in the INI file.
    entry: String,
    /// Where it is, for readers.
    place: String,
}

impl Import {
    /// The letter of the axis.
    #[must_use]
    pub fn letter(&self) -> char {
        self.joint.letter
    }

    /// The lines of `COMP_FILE` and `BACKLASH` in the INI file that the error file replaces; none of those that it cannot
    /// have, or that an included file has.
    #[must_use]
    pub fn lines(&self, configuration: &Configuration) -> Vec<usize> {
        let is_endless = configuration.is_endless(self.joint);
        let is_table = matches!(self.corrections, JointCorrections::Table(_));
        if !"XYZABC".contains(self.letter()) || (is_endless && is_table) {
            return Vec::new();
        }
        let entries = ["COMP_FILE", "BACKLASH"]
            .iter()
            .filter_map(|key| configuration.compensated(self.joint.number, key));
        let own = entries.filter(|e| e.place.source.name == configuration.start.source.name);
        own.map(|entry| entry.place.line()).collect()
    }

    /// The line in the INI file, for readers.
    #[must_use]
    pub fn source(&self) -> String {
        format!("{} in {}", self.entry, self.place)
    }

    /// Whether an error file that was made for the same configuration has these corrections still.
    #[must_use]
    pub fn is_in(&self, errors: &str) -> bool {
        let entry = format!(": {} in ", self.entry);
        let is_named = |line: &str| line.starts_with("# Joint ") && line.contains(&entry);
        errors.lines().any(is_named) && has_imported(errors, self.letter())
    }
}

/// The head of an error file with what LinuxCNC compensated.
const HEAD: &str = "# What LinuxCNC compensated, as errors of the machine";

/// Whether an error file has what LinuxCNC compensated.
#[must_use]
pub(crate) fn is_imported(errors: &str) -> bool {
    errors.starts_with(HEAD)
}

/// Whether such a file has errors along an axis that can have been imported.
#[must_use]
pub(crate) fn has_imported(errors: &str, letter: char) -> bool {
    let [table, backlash] = [
        format!("[tabulated.E{letter}{letter}]"),
        format!("E{letter}{letter}b"),
    ];
    is_imported(errors)
        && errors.lines().any(|line| {
            let key = line.split('=').next().unwrap_or(line).trim();
            key == table || key == backlash
        })
}

/// Reads what the configuration compensates, but for what [`Configuration::kept`] has; `open` opens the files that it
/// names.
///
/// # Errors
/// [`FileError`]: a file that cannot be read, or that LinuxCNC does not read to its end.
pub fn imported(configuration: &Configuration, open: &Open<'_>) -> Result<Vec<Import>, FileError> {
    let mut found: Vec<Import> = Vec::new();
    for joint in configuration.axes() {
        let Some(entry) = configuration.compensates(joint.number) else {
            continue;
        };
        if !configuration.kept(joint.letter).is_empty() {
            continue;
        }
        let corrections = match entry.key.as_str() {
            "COMP_FILE" => JointCorrections::Table(table(configuration, joint, entry, open)?),
            _ => JointCorrections::Backlash(value(entry)?),
        };
        let IniEntry {
            key, value, place, ..
        } = entry;
        found.push(Import {
            joint,
            corrections,
            entry: format!("{key} = {value}"),
            place: format!("{}, line {}", place.source.name, place.line()),
        });
    }
    Ok(found)
}

fn value(entry: &IniEntry) -> Result<f64, FileError> {
    let value = entry.number().map(|(value, _)| value);
    value.ok_or_else(|| {
        let message = format!("{} is `{}`, no number", entry.key, entry.value);
        entry.place.error(
            message,
            "here",
            "write BACKLASH = 0, or how far the axis moves before it moves",
        )
    })
}

/// Rows of a file.
fn table(
    configuration: &Configuration,
    joint: JointAxis,
    file: &IniEntry,
    open: &Open<'_>,
) -> Result<Vec<CompFileRow>, FileError> {
    let kind = configuration.of_joint(joint.number, "COMP_FILE_TYPE");
    let number = kind.map(|entry| entry.number().map(|(value, _)| value));
    let kind = match (number, kind) {
        (None | Some(Some(0.0)), _) => Type::Positions,
        (Some(Some(1.0)), _) => Type::Corrections,
        (_, entry) => {
            let IniEntry { value, place, .. } = entry.unwrap_or(file);
            let message = format!("COMP_FILE_TYPE is `{value}`");
            return Err(place.error(message, "here", "write 0 (positions) or 1 (corrections)"));
        }
    };
    let source = open(&file.value).map_err(|cause| {
        let message = format!("COMP_FILE = {} cannot be read: {cause}", file.value);
        let text = file.value.find(['#', ';']).filter(|at| *at > 0);
        let remedy = match text.map(|at| &file.value[at..]) {
            Some(text) => format!(
                "write `{text}` on a line of its own: LinuxCNC takes it as part of the name"
            ),
            None => "name a file in the folder of the INI file".to_owned(),
        };
        file.place.error(message, "here", remedy)
    })?;
    let rows = comp_file::read(&source.text, kind)
        .map_err(|error| error.within(&source.name, &source.text))?;
    match rows.is_empty() {
        false => Ok(rows),
        true => {
            let message = format!("COMP_FILE = {} has no lines", file.value);
            Err(file.place.error(message, "here", "remove this line"))
        }
    }
}

/// How an axis of the description moves.
pub(crate) struct AxisMotion {
    pub(crate) letter: char,
    pub(crate) reversed: bool,
    pub(crate) endless: bool,
}

/// The error file, if there is anything to import. `axes` are those of the machine file `name`.
pub(crate) fn errors(
    configuration: &Configuration,
    name: &str,
    axes: &[AxisMotion],
    imports: &[Import],
) -> Option<String> {
    if imports.is_empty() {
        return None;
    }
    let (mut parameters, mut tables) = (String::new(), String::new());
    let mut done: Vec<char> = Vec::new();
    for import in imports {
        let Import {
            joint: JointAxis { number, letter },
            corrections,
            ..
        } = import;
        let head = format!("\n# Joint {number}: {}.", import.source());
        // Joints of one axis have the same.
        if done.contains(letter) {
            continue;
        }
        done.push(*letter);
        let axis = match importable(axes, import) {
            Ok(axis) => axis,
            Err(why) => {
                tables += &format!("{head}\n# CHECK: not imported: {why}.\n");
                continue;
            }
        };
        let is = if axis.reversed { "is" } else { "is not" };
        let sign = format!(
            " {letter} {is} reversed in machine.toml: if you change that, change the signs here."
        );
        let scale = if axis.reversed { 1.0 } else { -1.0 } * configuration.unit(import.joint);
        match corrections {
            JointCorrections::Backlash(value) => {
                let half = backlash(import, 0.5 * value * scale);
                parameters += &format!("{head}{sign}\nE{letter}{letter}b = {half}\n");
            }
            JointCorrections::Table(rows) => {
                tables += &format!("{head}{sign}\n[tabulated.E{letter}{letter}]\n");
                tables += &tabulated(import, rows, scale, configuration.unit(import.joint));
            }
        }
    }
    let mut text = format!(
        "{HEAD}: see the page on error files in the manual.\n\
         machine = {}\n",
        toml::Value::from(name)
    );
    if !parameters.is_empty() {
        text += &format!("\n[parameters]{parameters}");
    }
    text += &tables;
    Some(text)
}

/// The axis whose errors are imported, or why they are not.
fn importable<'a>(axes: &'a [AxisMotion], import: &Import) -> Result<&'a AxisMotion, &'static str> {
    let letter = import.letter();
    let mut axes = axes.iter().filter(|_| "XYZABC".contains(letter));
    let axis = axes.find(|axis| axis.letter == letter);
    let is_table = matches!(import.corrections, JointCorrections::Table(_));
    match axis {
        Some(axis) if axis.endless && is_table => {
            Err("the errors of an axis without end must close after a turn")
        }
        Some(axis) => Ok(axis),
        None => Err("the direction of this axis is unknown"),
    }
}

/// Half of a backlash in the unit of error files.
fn backlash(import: &Import, half: f64) -> String {
    match import.joint.is_rotary() {
        true => format!("{:?}  # rad", rounded(half.to_radians(), 1e12)),
        false => format!("{:?}  # mm", rounded(half, 1e9)),
    }
}

/// The values of a table: positions times `unit`, corrections times `scale`.
fn tabulated(import: &Import, rows: &[CompFileRow], scale: f64, unit: f64) -> String {
    let mut rows = rows.to_vec();
    // One line is a constant; a table has two positions.
    if let [[p, forward, reverse]] = rows[..] {
        rows = vec![[p - 1.0, forward, reverse], [p + 1.0, forward, reverse]];
    }
    let list = |k: usize, factor: f64| -> String {
        let values = rows
            .iter()
            .map(|row| format!("{:?}", rounded(row[k] * factor, 1e9)));
        values.collect::<Vec<_>>().join(", ")
    };
    let mut text = format!("at = [{}]\n", list(0, unit));
    if rows.iter().all(|row| row[1] == row[2]) {
        let _ = writeln!(text, "value = [{}]", list(1, scale));
    } else {
        let _ = writeln!(
            text,
            "positive = [{}]\nnegative = [{}]",
            list(1, scale),
            list(2, scale)
        );
    }
    let unit = if import.joint.is_rotary() {
        "deg"
    } else {
        "mm"
    };
    let _ = writeln!(text, "unit = \"{unit}\"");
    text
}

/// To 1 / `steps`, and never −0.
fn rounded(value: f64, steps: f64) -> f64 {
    (value * steps).round() / steps + 0.0
}

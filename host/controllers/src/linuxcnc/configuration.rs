//! The INI file of a machine and all HAL files that it names.

use super::kinematics::Module;
use crate::formats::hal::{self, Hal};
use crate::formats::ini::{Entry, FileLocation, Ini};
use std::rc::Rc;
use trueaxis_model::machine::Letter;
use trueaxis_model::source::{FileError, Named};

/// Opens a file by its name in an INI or HAL file; returns the cause of a failure.
pub type Open<'o> = dyn Fn(&str) -> Result<Named, String> + 'o;

/// A configuration as LinuxCNC would load it.
#[derive(Debug)]
pub struct Configuration {
    /// The INI file with what it includes.
    pub ini: Ini,
    /// The state of HAL after its HAL files.
    pub hal: Hal,
    /// The INI file itself.
    pub start: FileLocation,
    /// Number of joints.
    pub joints: usize,
    /// The kinematics.
    pub module: Module,
    /// Size of the machine's linear unit in mm; `None` if it is missing or unknown.
    pub mm: Option<f64>,
}

/// A joint and the letter of its axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Joint {
    /// Its number.
    pub number: usize,
    /// The letter of its axis.
    pub letter: char,
}

impl Joint {
    /// Whether its axis rotates.
    #[must_use]
    pub fn is_rotary(self) -> bool {
        matches!(self.letter, 'A' | 'B' | 'C')
    }
}

/// LinuxCNC has no more joints.
const MOST_JOINTS: usize = 16;

impl Configuration {
    /// Reads a configuration; `open` opens the files that it names.
    ///
    /// # Errors
    /// [`FileError`]: files that cannot be read, and missing entries without which LinuxCNC would not start.
    pub fn read(source: Named, open: &Open<'_>) -> Result<Self, FileError> {
        let start = FileLocation {
            source: Rc::new(source.clone()),
            span: 0..0,
        };
        let ini = Ini::read(source, open)?;
        let joints = need(&ini, &start, "KINS", "JOINTS", "3")?;
        let count = joints.value.parse().ok();
        let count = count.filter(|n| (1..=MOST_JOINTS).contains(n));
        let count = count.ok_or_else(|| {
            let message = format!("`{}` is not a number of joints", joints.value);
            joints
                .place
                .error(message, "here", "write JOINTS = 1 to 16")
        })?;
        let module = need(&ini, &start, "KINS", "KINEMATICS", "trivkins")?;
        need(&ini, &start, "HAL", "HALFILE", "machine.hal")?;
        let mut hal = Hal::default();
        for key in ["HALFILE", "HALCMD", "POSTGUI_HALFILE"] {
            for entry in ini.all("HAL", key) {
                let name = entry.value.split_whitespace().next().unwrap_or("");
                if key == "HALCMD" {
                    hal.line(&entry.value, &ini, &entry.place)?;
                } else if name.ends_with(".tcl") {
                    hal.programs.push((name.to_owned(), entry.place.clone()));
                } else {
                    let source = open(name);
                    let source = source.map_err(|e| hal::missing(&entry.place, name, &e))?;
                    hal.take(source, &ini, open)?;
                }
            }
        }
        let module = Module::read(module, ini.get("TRAJ", "COORDINATES"), &hal, count);
        let units = ini.get("TRAJ", "LINEAR_UNITS");
        Ok(Self {
            mm: units.and_then(|entry| millimetres(&entry.value)),
            ini,
            hal,
            start,
            joints: count,
            module,
        })
    }

    /// The start of a section, or of the file.
    #[must_use]
    pub fn section(&self, name: &str) -> &FileLocation {
        self.ini.section(name).unwrap_or(&self.start)
    }

    /// A value of a joint.
    #[must_use]
    pub(crate) fn of_joint(&self, number: usize, key: &str) -> Option<&Entry> {
        self.ini.get(&format!("JOINT_{number}"), key)
    }

    /// Joints with an axis of a machine.
    #[must_use]
    pub fn axes(&self) -> Vec<Joint> {
        let letters = self.module.letters.char_indices();
        let joints = letters.map(|(number, letter)| Joint { number, letter });
        joints
            .filter(|joint| Letter::new(joint.letter).is_some())
            .collect()
    }

    /// `COMP_FILE` or `BACKLASH` of a joint, if it has an effect.
    #[must_use]
    pub(crate) fn compensated(&self, number: usize, key: &str) -> Option<&Entry> {
        let entry = self.of_joint(number, key)?;
        let none = entry.value.is_empty() || (key == "BACKLASH" && entry.value.parse() == Ok(0.0));
        (!none).then_some(entry)
    }

    /// A numeric value of a joint, if there is one.
    #[must_use]
    pub fn number(&self, joint: usize, key: &str) -> Option<f64> {
        let value: f64 = self.of_joint(joint, key)?.value.parse().ok()?;
        value.is_finite().then_some(value)
    }

    /// Size of a joint's unit in mm or degrees.
    #[must_use]
    pub fn unit(&self, joint: Joint) -> f64 {
        match joint.is_rotary() {
            true => 1.0,
            false => self.mm.unwrap_or(1.0),
        }
    }
}

/// Size of a linear unit in mm.
#[must_use]
pub fn millimetres(unit: &str) -> Option<f64> {
    match unit.to_ascii_lowercase().as_str() {
        "mm" | "metric" => Some(1.0),
        "inch" | "in" | "imperial" => Some(25.4),
        _ => None,
    }
}

fn need<'i>(
    ini: &'i Ini,
    start: &FileLocation,
    section: &str,
    key: &str,
    example: &str,
) -> Result<&'i Entry, FileError> {
    ini.get(section, key).ok_or_else(|| {
        let place = ini.section(section).unwrap_or(start);
        place.error(
            format!("the INI file has no [{section}]{key}"),
            "not here",
            format!("write {key} = {example} below [{section}]; is the file cut off?"),
        )
    })
}

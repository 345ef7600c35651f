//! The INI file of a machine and all HAL files that it names.

use crate::formats::hal::{self, Hal};
pub use crate::formats::ini::Open;
use crate::formats::ini::{FileLocation, Ini, IniEntry};
use crate::kinematics::Module;
use std::path::Path;
use std::rc::Rc;
use trueaxis_model::machine::Letter;
use trueaxis_model::source::{FileError, Named};

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
pub struct JointAxis {
    /// Number.
    pub number: usize,
    /// The letter of its axis.
    pub letter: char,
}

impl JointAxis {
    /// Whether its axis rotates.
    #[must_use]
    pub fn is_rotary(self) -> bool {
        matches!(self.letter, 'A' | 'B' | 'C')
    }
}

/// LinuxCNC has no more joints.
const MOST_JOINTS: usize = 16;

impl Configuration {
    /// Reads a configuration; `open` opens the files that it names. `running` is what `halcmd save all` prints of a HAL
    /// that runs with it, to be read instead of its HAL files.
    ///
    /// # Errors
    /// [`FileError`]: files that cannot be read, and missing entries without which LinuxCNC would not start.
    pub fn read(source: Named, open: &Open<'_>, running: Option<Named>) -> Result<Self, FileError> {
        let start = FileLocation {
            source: Rc::new(source.clone()),
            span: 0..0,
        };
        let ini = Ini::read(source, open)?;
        current(&ini, &start)?;
        let joints = need(&ini, &start, "KINS", "JOINTS", "3")?;
        let whole = |(value, _): (f64, _)| (value.fract() == 0.0).then_some(value as usize);
        let count = joints.number().and_then(whole);
        let count = count.filter(|n| (1..=MOST_JOINTS).contains(n));
        let count = count.ok_or_else(|| {
            let message = format!("`{}` is not a number of joints", joints.value);
            joints
                .place
                .error(message, "here", "write JOINTS = 1 to 16")
        })?;
        let module = need(&ini, &start, "KINS", "KINEMATICS", "trivkins")?;
        need(&ini, &start, "HAL", "HALFILE", "machine.hal")?;
        let hal = match running {
            Some(running) => {
                let mut hal = Hal::default();
                hal.take(running, &ini, open)?;
                hal
            }
            None => hal_files(&ini, &start, open)?,
        };
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
    pub(crate) fn of_joint(&self, number: usize, key: &str) -> Option<&IniEntry> {
        self.ini.get(&format!("JOINT_{number}"), key)
    }

    /// Joints with an axis of a machine.
    #[must_use]
    pub fn axes(&self) -> Vec<JointAxis> {
        let letters = self.module.letters.char_indices();
        let joints = letters.map(|(number, letter)| JointAxis { number, letter });
        joints
            .filter(|joint| Letter::new(joint.letter).is_some())
            .collect()
    }

    /// `COMP_FILE` or `BACKLASH` of a joint, if it has an effect.
    #[must_use]
    pub(crate) fn compensated(&self, number: usize, key: &str) -> Option<&IniEntry> {
        let entry = self.of_joint(number, key)?;
        let is_zero = |entry: &IniEntry| entry.number().is_some_and(|(value, _)| value == 0.0);
        let none = entry.value.is_empty() || (key == "BACKLASH" && is_zero(entry));
        (!none).then_some(entry)
    }

    /// What LinuxCNC compensates on a joint: `COMP_FILE`, which takes the place of `BACKLASH`, or that.
    #[must_use]
    pub(crate) fn compensates(&self, number: usize) -> Option<&IniEntry> {
        let keys = ["COMP_FILE", "BACKLASH"];
        keys.into_iter()
            .find_map(|key| self.compensated(number, key))
    }

    /// `COMP_FILE` and `BACKLASH` that LinuxCNC must keep, because the joints of the axis differ in them and a
    /// compensation has one correction for all; none if they are the same.
    #[must_use]
    pub fn kept(&self, letter: char) -> Vec<(JointAxis, &IniEntry)> {
        let joints = self.axes().into_iter().filter(|j| j.letter == letter);
        let joints = joints.map(|joint| (joint, self.compensates(joint.number)));
        let joints: Vec<(JointAxis, Option<&IniEntry>)> = joints.collect();
        let kind = |joint: JointAxis| self.number(joint.number, "COMP_FILE_TYPE").unwrap_or(0.0);
        let is_same = |pair: &[(JointAxis, Option<&IniEntry>)]| match (pair[0], pair[1]) {
            ((_, None), (_, None)) => true,
            ((a, Some(of_a)), (b, Some(of_b))) => {
                let same = of_a.value == of_b.value;
                of_a.key == of_b.key
                    && match of_a.key.as_str() {
                        "COMP_FILE" => same && kind(a) == kind(b),
                        _ => same || of_a.number().is_some() && of_a.number() == of_b.number(),
                    }
            }
            _ => false,
        };
        match joints.windows(2).all(is_same) {
            true => Vec::new(),
            false => { joints.into_iter() }
                .filter_map(|(joint, entry)| Some((joint, entry?)))
                .collect(),
        }
    }

    /// A numeric value of a joint, if there is one.
    #[must_use]
    pub fn number(&self, joint: usize, key: &str) -> Option<f64> {
        Some(self.of_joint(joint, key)?.number()?.0)
    }

    /// A value of the axis of a joint.
    #[must_use]
    pub(crate) fn of_axis(&self, joint: JointAxis, key: &str) -> Option<&IniEntry> {
        self.ini.get(&format!("AXIS_{}", joint.letter), key)
    }

    /// `MIN_LIMIT` or `MAX_LIMIT` of a joint, or of its axis where both have the same position and the axis ends first; in
    /// the unit of the joint. `None` if it has none, or one so far away that it is none.
    #[must_use]
    pub(crate) fn limit(&self, joint: JointAxis, key: &str) -> Option<(f64, &IniEntry)> {
        let is_position = self.module.is_trivial() || joint.is_rotary();
        let of_axis = self.of_axis(joint, key).filter(|_| is_position);
        let both = [self.of_joint(joint.number, key), of_axis].into_iter();
        let inwards = if key == "MIN_LIMIT" { 1.0 } else { -1.0 };
        let most = match joint.is_rotary() {
            true => FARTHEST,
            false => FARTHEST / self.unit(joint),
        };
        let found = both.flatten().filter_map(|e| Some((e.number()?.0, e)));
        found
            .filter(|(value, _)| value.abs() <= most)
            .max_by(|a, b| (inwards * a.0).total_cmp(&(inwards * b.0)))
    }

    /// Whether a rotary axis turns without end: it has no limits, or so far apart that they are none; or a whole turn between
    /// them and `WRAPPED_ROTARY`, which versions of LinuxCNC agree about only if it is 1. It does not go past limits either.
    #[must_use]
    pub(crate) fn is_endless(&self, joint: JointAxis) -> bool {
        let limit = |key| self.limit(joint, key).map(|(value, _)| value);
        let travel = limit("MAX_LIMIT").zip(limit("MIN_LIMIT"));
        let wrapped = self.of_axis(joint, "WRAPPED_ROTARY");
        let is_wrapped = wrapped.is_some_and(|entry| entry.value == "1");
        let is_none = |(high, low)| high - low > ENDLESS || is_wrapped && high - low >= 360.0;
        joint.is_rotary() && travel.is_none_or(is_none)
    }

    /// The word for the linear unit of the machine, as the component reads it.
    #[must_use]
    pub fn unit_word(&self) -> &'static str {
        match self.ini.get("TRAJ", "LINEAR_UNITS") {
            Some(entry) if word(&entry.value).is_some() => "[TRAJ]LINEAR_UNITS",
            _ if self.mm == Some(25.4) => "inch",
            _ => "mm",
        }
    }

    /// Whether rotary positions are in degrees.
    #[must_use]
    pub fn in_degrees(&self) -> bool {
        let entry = self.ini.get("TRAJ", "ANGULAR_UNITS");
        entry.is_none_or(|entry| is_degree(&entry.value))
    }

    /// Size of a joint's unit in mm or degrees.
    #[must_use]
    pub fn unit(&self, joint: JointAxis) -> f64 {
        match joint.is_rotary() {
            true => 1.0,
            false => self.mm.unwrap_or(1.0),
        }
    }
}

/// A limit (mm, deg) farther away than this is none.
const FARTHEST: f64 = 1e5;
/// A rotary axis with more travel (deg) than this rotates without limits.
const ENDLESS: f64 = 1080.0;

/// Size of a linear unit in mm: a word, or a number of units per mm.
#[must_use]
pub(crate) fn millimetres(unit: &str) -> Option<f64> {
    let per_mm = unit.parse::<f64>().ok().filter(|value| *value > 0.0);
    // Written with four digits or more.
    let is = |mm: &f64| per_mm.is_some_and(|value| (value * mm - 1.0).abs() < 1e-4);
    word(unit).or_else(|| [1.0, 25.4].into_iter().find(is))
}

/// Size of a linear unit in mm, from its name.
#[must_use]
pub(crate) fn word(unit: &str) -> Option<f64> {
    match unit.to_ascii_lowercase().as_str() {
        "mm" | "metric" => Some(1.0),
        "inch" | "in" | "imperial" => Some(25.4),
        _ => None,
    }
}

/// Whether an angular unit is the degree.
#[must_use]
pub(crate) fn is_degree(unit: &str) -> bool {
    let unit = unit.to_ascii_lowercase();
    matches!(unit.as_str(), "deg" | "degree") || unit.parse() == Ok(1.0)
}

/// `[EMC]VERSION` of the files that LinuxCNC reads as they are, since 2.8; its script compares the text.
const CURRENT: &str = "1.1";

/// Refuses a file that LinuxCNC would convert before it reads it: one from before 2.8, in which axes were joints.
fn current(ini: &Ini, start: &FileLocation) -> Result<(), FileError> {
    let version = ini.get("EMC", "VERSION");
    let (place, is) = match version {
        Some(entry) if entry.value == CURRENT => {
            // Since 2.8 the sections of axes have letters.
            return match ini.section("AXIS_0") {
                Some(joint) if ini.get("KINS", "JOINTS").is_none() => Err(joint.error(
                    "[AXIS_0] is a joint, as before LinuxCNC 2.8, and [EMC]VERSION keeps LinuxCNC from converting the file"
                        .to_owned(),
                    "here",
                    "take VERSION out of [EMC] and start LinuxCNC once with this file: it converts the file, and asks before; then try again",
                )),
                _ => Ok(()),
            };
        }
        Some(entry) => (&entry.place, format!("is `{}`", entry.value)),
        None => (ini.section("EMC").unwrap_or(start), "is missing".to_owned()),
    };
    Err(place.error(
        format!(
            "[EMC]VERSION {is}, not {CURRENT}: LinuxCNC takes this file for one from before LinuxCNC 2.8, and converts it"
        ),
        "here",
        format!(
            "start LinuxCNC once with this file: it converts the file, and asks before; then try again. If the file is newer, write VERSION = {CURRENT} below [EMC]"
        ),
    ))
}

/// The state of HAL after the HAL files that the INI file names.
fn hal_files(ini: &Ini, start: &FileLocation, open: &Open<'_>) -> Result<Hal, FileError> {
    let mut hal = Hal::default();
    for key in ["HALFILE", "HALCMD", "POSTGUI_HALFILE"] {
        for entry in ini.all("HAL", key).filter(|entry| !entry.value.is_empty()) {
            let name = entry.value.split_whitespace().next().unwrap_or("");
            if key == "HALCMD" {
                hal.line(&entry.value, ini, &entry.place)?;
            } else if name.ends_with(".tcl") {
                // It writes the commands of all HAL files up to itself.
                let simulated = name.strip_prefix("LIB:") == Some(BASIC_SIM);
                match open(&saved_commands(start)).ok().filter(|_| simulated) {
                    Some(source) => {
                        hal = Hal::default();
                        hal.take(source, ini, open)?;
                    }
                    None => hal.programs.push((name.to_owned(), entry.place.clone())),
                }
            } else {
                let source = open(name);
                let source = source.map_err(|e| hal::missing(&entry.place, name, &e))?;
                hal.take(source, ini, open)?;
            }
        }
    }
    Ok(hal)
}

/// LinuxCNC's simulation of the drives of any machine, a program.
pub(crate) const BASIC_SIM: &str = "basic_sim.tcl";

/// The file in which [`BASIC_SIM`] leaves its commands, beside the INI file.
#[must_use]
pub(crate) fn saved_commands(start: &FileLocation) -> String {
    let stem = Path::new(&start.source.name).file_stem();
    let stem = stem.unwrap_or_default().to_string_lossy();
    format!("{stem}_cmds.hal")
}

fn need<'i>(
    ini: &'i Ini,
    start: &FileLocation,
    section: &str,
    key: &str,
    example: &str,
) -> Result<&'i IniEntry, FileError> {
    ini.get(section, key).ok_or_else(|| {
        let place = ini.section(section).unwrap_or(start);
        place.error(
            format!("the INI file has no [{section}]{key}"),
            "not here",
            format!("write {key} = {example} below [{section}]; is the file cut off?"),
        )
    })
}

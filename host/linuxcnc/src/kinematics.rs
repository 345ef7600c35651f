//! Kinematics modules of LinuxCNC: the axis of each joint, and the machine they are for.

use crate::formats::hal::{Hal, HalCommand};
use crate::formats::ini::{FileLocation, IniEntry};
use trueaxis_model::machine::{Branch, Machine};

/// The module that HAL loads, or `[KINS]KINEMATICS` if that is not visible.
#[derive(Clone, Debug)]
pub struct Module {
    /// Name of the module.
    pub name: String,
    /// The letter of each joint, if known.
    pub letters: String,
    /// Place of the module.
    pub place: FileLocation,
}

/// The assumptions of a module.
#[derive(Clone, Copy, Debug)]
pub struct ModuleShape {
    /// Default letters of the assumptions.
    pub letters: &'static str,
    /// Rotary axes of the workpiece branch, from the foundation outwards.
    pub workpiece: &'static str,
    /// Rotary axes of the tool branch.
    pub tool: &'static str,
    /// Pins for the offset between the rotary axes: component and name.
    pub offsets: [(usize, &'static str); 2],
}

impl Module {
    pub(crate) fn read(
        entry: &IniEntry,
        coordinates: Option<&IniEntry>,
        hal: &Hal,
        joints: usize,
    ) -> Self {
        let mut words = entry.value.split_whitespace();
        let named = words.next().unwrap_or("");
        let given = words.find_map(|word| word.strip_prefix("coordinates="));
        // What HAL loads is decisive; the INI file is only the usual source of it.
        let loaded = hal.load(named).or_else(|| Self::loaded(hal));
        let name = loaded.map_or(named, |command| &command.words[1]);
        let of_hal = loaded.and_then(|command| command.parameter("coordinates"));
        let letters = if loaded.is_some() { of_hal } else { given };
        let place = match loaded {
            Some(command) if name != named || of_hal != given => &command.place,
            _ => &entry.place,
        };
        let usual = match (name, ModuleShape::of(name)) {
            (_, Some(shape)) => shape.letters,
            (TRIVIAL, None) => "XYZABCUVW",
            _ => coordinates.map_or("", |entry| entry.value.as_str()),
        };
        let letters = letters.unwrap_or(usual).chars();
        let letters = letters.filter(|c| !c.is_whitespace()).take(joints);
        Self {
            name: name.to_owned(),
            letters: letters.map(|c| c.to_ascii_uppercase()).collect(),
            place: place.clone(),
        }
    }

    /// The command that loads kinematics.
    fn loaded(hal: &Hal) -> Option<&HalCommand> {
        let mut loaded = hal.loaded.iter().filter(|c| c.words[0] == "loadrt");
        loaded.find(|c| c.words.get(1).is_some_and(|name| name.ends_with("kins")))
    }

    /// Whether the positions of joints and axes are the same.
    #[must_use]
    pub(crate) fn is_trivial(&self) -> bool {
        self.name == TRIVIAL
    }

    /// Whether each linear joint is known to move along an axis of the machine.
    #[must_use]
    pub(crate) fn joints_are_axes(&self) -> bool {
        self.is_trivial() || ModuleShape::of(&self.name).is_some()
    }
}

/// The module in which each joint is an axis.
const TRIVIAL: &str = "trivkins";

impl ModuleShape {
    /// The shape of a known module with rotary axes.
    #[must_use]
    pub fn of(module: &str) -> Option<Self> {
        match module {
            "xyzac-trt-kins" => Some(Self {
                letters: "XYZAC",
                workpiece: "AC",
                tool: "",
                offsets: [(1, "y-offset"), (2, "z-offset")],
            }),
            "xyzbc-trt-kins" => Some(Self {
                letters: "XYZBC",
                workpiece: "BC",
                tool: "",
                offsets: [(0, "x-offset"), (2, "z-offset")],
            }),
            "5axiskins" => Some(Self {
                letters: "XYZBCW",
                workpiece: "",
                tool: "CB",
                offsets: [(0, ""), (0, "")],
            }),
            _ => None,
        }
    }

    /// How a positive command of a rotary axis turns the tool relative to the workpiece: 1 as the right hand, −1 against
    /// it.
    #[must_use]
    pub fn turns(self, letter: char) -> f64 {
        match letter {
            _ if self.workpiece.contains(letter) => -1.0,
            'B' => -1.0,
            _ => 1.0,
        }
    }

    /// Rotary axes of a branch, from the foundation outwards; `None` if one of them carries a linear axis.
    #[must_use]
    pub fn rotary(machine: &Machine, branch: Branch) -> Option<String> {
        let axes = machine.axes.iter().filter(|a| a.branch == branch);
        let mut found = String::new();
        for axis in axes {
            if axis.letter.is_rotary() {
                found.push(axis.letter.char());
            } else if !found.is_empty() && axis.letter.char() != 'W' {
                return None;
            }
        }
        Some(found)
    }

    /// The axes as text.
    #[must_use]
    pub fn words(self) -> String {
        let chain = |letters: &str| {
            let letters: Vec<String> = letters.chars().map(String::from).collect();
            letters.join(" carrying ")
        };
        match (self.workpiece, self.tool) {
            (workpiece, "") => format!(
                "a table with {}, and no rotary axis at the tool",
                chain(workpiece)
            ),
            (_, tool) => format!(
                "a head with {}, and no rotary axis at the table",
                chain(tool)
            ),
        }
    }
}

//! Kinematics modules of LinuxCNC: which joint has which axis, and what machine they are for.

use crate::formats::ini::{Entry, Place};
use crate::machine::{Branch, Machine};

/// The module of `[KINS]KINEMATICS`.
#[derive(Clone, Debug)]
pub struct Module {
    /// Its name.
    pub name: String,
    /// The letter of each joint, where that is known.
    pub letters: String,
    /// Where it stands.
    pub place: Place,
}

/// What a module takes for granted.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// Its letters unless told otherwise.
    pub letters: &'static str,
    /// Rotary axes of the workpiece branch, from the foundation outwards.
    pub workpiece: &'static str,
    /// Those of the tool branch.
    pub tool: &'static str,
    /// Its pins with the offset between the rotary axes: component and name.
    pub offsets: [(usize, &'static str); 2],
}

impl Module {
    pub(super) fn read(entry: &Entry, coordinates: Option<&Entry>, joints: usize) -> Self {
        let mut words = entry.value.split_whitespace();
        let name = words.next().unwrap_or("").to_owned();
        let given = words.find_map(|word| word.strip_prefix("coordinates="));
        let usual = match (name.as_str(), Shape::of(&name)) {
            (_, Some(shape)) => shape.letters,
            ("trivkins", None) => "XYZABCUVW",
            _ => coordinates.map_or("", |entry| entry.value.as_str()),
        };
        let letters = given.unwrap_or(usual).chars();
        let letters = letters.filter(|c| !c.is_whitespace()).take(joints);
        Self {
            name,
            letters: letters.map(|c| c.to_ascii_uppercase()).collect(),
            place: entry.place.clone(),
        }
    }
}

impl Shape {
    /// Of a module with rotary axes that is known here.
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

    /// Rotary axes of a branch, from the foundation outwards; `None` if a linear axis is carried by one of
    /// them.
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

    /// The axes in words.
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

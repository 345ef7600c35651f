//! Output of LinuxCNC's stand-alone interpreter for a program: canonical commands, as motions of the machine.

use programs::process::said;
use std::path::Path;
use std::process::Command;

/// A motion in machine coordinates (mm, degrees).
#[derive(Clone, Debug, PartialEq)]
pub struct Rs274Motion {
    /// `rapid`, `feed` or `arc`.
    pub kind: String,
    /// X Y Z A B C U V W.
    pub to: [f64; 9],
    /// F in units of the program; 0 for a rapid.
    pub feed: f64,
    /// Turns (negative clockwise) and centre of an arc.
    pub arc: Option<[f64; 3]>,
    /// Half of the fourth decimal printed by `rs274` (mm), for each number in a coordinate: the position and the
    /// offsets, in the unit in which each was printed.
    pub digits: f64,
}

impl Rs274Motion {
    /// Parses a line of `gcode_moves`.
    pub fn read(line: &str) -> Option<Self> {
        let mut words = line.split(' ');
        let kind = words.next()?.to_owned();
        let numbers: Vec<f64> = words.filter_map(|w| w.parse().ok()).collect();
        Some(Self {
            kind,
            to: numbers.get(..9)?.try_into().ok()?,
            feed: *numbers.get(9)?,
            arc: numbers.get(10..13).and_then(|a| a.try_into().ok()),
            digits: 0.0,
        })
    }

    /// True if it is an arc.
    pub fn is_arc(&self) -> bool {
        self.arc.is_some()
    }

    /// Reports differences larger than the printed digits.
    pub fn same(&self, rival: &Self) -> Result<(), String> {
        // A tenth more, for our fifth decimal.
        let digits = 1.1 * rival.digits;
        if self.kind != rival.kind {
            return Err(format!("{} and {}", self.kind, rival.kind));
        }
        for i in 0..6 {
            let digits = if (3..6).contains(&i) { 1.1e-4 } else { digits };
            if (self.to[i] - rival.to[i]).abs() > digits {
                return Err(format!(
                    "coordinate {i}: {} and {}",
                    self.to[i], rival.to[i]
                ));
            }
        }
        if (self.feed - rival.feed).abs() > 1e-4 * rival.feed.max(1.0) {
            return Err(format!("F{} and F{}", self.feed, rival.feed));
        }
        match (self.arc, rival.arc) {
            (Some(a), Some(b)) => {
                if a[0] != b[0] || (1..3).any(|i| (a[i] - b[i]).abs() > 2.0 * digits) {
                    return Err("other arcs".to_owned());
                }
                Ok(())
            }
            (None, None) => Ok(()),
            _ => Err("an arc and none".to_owned()),
        }
    }
}

/// Offsets between a printed coordinate and the machine.
struct Rs274Offsets {
    unit: f64,
    /// Units in which the non-zero ones were printed: `g5x`, `g92`, `tool`.
    printed: [f64; 3],
    g5x: [f64; 9],
    g92: [f64; 9],
    tool: [f64; 9],
    rotation: f64,
}

impl Rs274Offsets {
    fn machine(&self, printed: [f64; 9]) -> [f64; 9] {
        let mut at: [f64; 9] = std::array::from_fn(|i| printed[i] + self.g92[i]);
        let (s, c) = self.rotation.to_radians().sin_cos();
        (at[0], at[1]) = (c * at[0] - s * at[1], s * at[0] + c * at[1]);
        std::array::from_fn(|i| {
            let unit = if (3..6).contains(&i) { 1.0 } else { self.unit };
            (at[i] + self.g5x[i] + self.tool[i]) * unit
        })
    }

    fn set(&mut self, which: usize, to: [f64; 9]) {
        *[&mut self.g5x, &mut self.g92, &mut self.tool][which] = to;
        self.printed[which] = match to == [0.0; 9] {
            true => 0.0,
            false => self.unit,
        };
    }

    /// Half of the last digits of all numbers that make up a position (mm).
    fn digits(&self) -> f64 {
        let (s, c) = self.rotation.to_radians().sin_cos();
        0.5e-4 * (s.abs() + c.abs()) * (self.unit + self.printed.iter().sum::<f64>())
    }

    /// Printed lengths use another unit from here on; those of offsets are printed again or keep their length.
    fn change_unit(&mut self, unit: f64) {
        let factor = self.unit / unit;
        for offsets in [&mut self.g5x, &mut self.g92, &mut self.tool] {
            for (i, value) in offsets.iter_mut().enumerate() {
                *value *= if (3..6).contains(&i) { 1.0 } else { factor };
            }
        }
        self.unit = unit;
    }
}

/// Interprets a program, with further options and their files: `-i` a configuration, `-v` parameters.
///
/// # Errors
/// If `rs274` refuses it.
pub fn run(
    program: &Path,
    tools: &Path,
    options: &[(&str, &Path)],
) -> Result<Vec<Rs274Motion>, String> {
    let mut command = Command::new("rs274");
    command
        .arg("-t")
        .arg(tools)
        .args(["-n", "2", "-g"])
        .arg(program);
    for (option, file) in options {
        command.arg(option).arg(file);
    }
    // It writes a file of parameters into its working folder.
    command.current_dir(program.parent().unwrap_or(Path::new(".")));
    let said = said(&mut command)?.output;
    let mut machine = CanonicalMachine::default();
    for line in said.lines() {
        let wrong = || format!("rs274 says: {line}");
        match CanonicalCall::read(line) {
            Some(call) => machine.take(&call).ok_or_else(wrong)?,
            None if line.trim().is_empty()
                || line.starts_with("executing")
                || line.contains("file ended with no") => {}
            None => return Err(wrong()),
        }
    }
    Ok(machine.motions)
}

/// A canonical command: `   12 N0040  NAME(1.0, 2.0)`.
struct CanonicalCall<'l> {
    name: &'l str,
    inside: &'l str,
    numbers: Vec<f64>,
}

impl<'l> CanonicalCall<'l> {
    fn read(line: &'l str) -> Option<Self> {
        let (name, inside) = line.trim_end().strip_suffix(')')?.split_once('(')?;
        Some(Self {
            name: name.split_whitespace().last().unwrap_or_default(),
            inside,
            numbers: inside
                // A tool offset has spaces between the letters of a group.
                .split([',', ' '])
                .filter_map(|n| n.parse().ok())
                .collect(),
        })
    }

    fn first(&self) -> f64 {
        self.numbers.first().copied().unwrap_or_default()
    }

    /// Coordinates of all axes, without the first `skipped` numbers.
    fn axes(&self, skipped: usize) -> [f64; 9] {
        let mut all = [0.0; 9];
        for (to, from) in all.iter_mut().zip(self.numbers.iter().skip(skipped)) {
            *to = *from;
        }
        all
    }
}

/// What holds for the next canonical command, and the motions so far.
struct CanonicalMachine {
    offsets: Rs274Offsets,
    feed: f64,
    /// The axes of the plane, and the one normal to it.
    plane: [usize; 3],
    motions: Vec<Rs274Motion>,
}

impl Default for CanonicalMachine {
    fn default() -> Self {
        Self {
            offsets: Rs274Offsets {
                unit: 1.0,
                printed: [0.0; 3],
                g5x: [0.0; 9],
                g92: [0.0; 9],
                tool: [0.0; 9],
                rotation: 0.0,
            },
            feed: 0.0,
            plane: [0, 1, 2],
            motions: Vec::new(),
        }
    }
}

impl CanonicalMachine {
    /// Obeys a command; `None` if it lacks numbers.
    fn take(&mut self, call: &CanonicalCall<'_>) -> Option<()> {
        let offsets = &mut self.offsets;
        match call.name {
            "USE_LENGTH_UNITS" => {
                let is_inch = call.inside.contains("INCH");
                offsets.change_unit(if is_inch { 25.4 } else { 1.0 });
            }
            "SET_G5X_OFFSET" => offsets.set(0, call.axes(1)),
            "SET_G92_OFFSET" => offsets.set(1, call.axes(0)),
            "USE_TOOL_LENGTH_OFFSET" => offsets.set(2, call.axes(0)),
            "SET_XY_ROTATION" => offsets.rotation = call.first(),
            // In the unit that holds now: one after it in the line does not change what it means.
            "SET_FEED_RATE" => self.feed = offsets.unit * call.first(),
            "SELECT_PLANE" => {
                self.plane = match call.inside {
                    "CANON_PLANE_XZ" => [2, 0, 1],
                    "CANON_PLANE_YZ" => [1, 2, 0],
                    _ => [0, 1, 2],
                };
            }
            "STRAIGHT_TRAVERSE" => self.move_to("rapid", call.axes(0), 0.0, None),
            "STRAIGHT_FEED" => self.move_to("feed", call.axes(0), self.feed, None),
            "ARC_FEED" => self.arc(&call.numbers)?,
            _ => {}
        }
        Some(())
    }

    fn move_to(&mut self, kind: &str, to: [f64; 9], feed: f64, arc: Option<[f64; 3]>) {
        self.motions.push(Rs274Motion {
            kind: kind.to_owned(),
            to: self.offsets.machine(to),
            feed: feed / self.offsets.unit,
            arc,
            digits: self.offsets.digits(),
        });
    }

    fn arc(&mut self, numbers: &[f64]) -> Option<()> {
        let (&[first, second, centre_1, centre_2, turns, normal], others) =
            numbers.split_first_chunk()?;
        let [u, v, w] = self.plane;
        let (mut to, mut centre) = ([0.0; 9], [0.0; 9]);
        (to[u], to[v], to[w]) = (first, second, normal);
        (centre[u], centre[v]) = (centre_1, centre_2);
        to[3..6].copy_from_slice(others.get(..3)?);
        let centre = self.offsets.machine(centre);
        let arc = Some([turns, centre[u], centre[v]]);
        self.move_to("arc", to, self.feed, arc);
        Some(())
    }
}

//! Programs that compute, as LinuxCNC's own interpreter runs them: its canonical motions as a flat program.
//!
//! `rs274 -g` prints every motion with four decimals, in the coordinates of the program. Its parameters are those of the
//! setup, so that programs may read offsets and move in machine coordinates.

use super::scratch::Scratch;
use crate::commands::bad_input::BadInput;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{ErrorKind, Write as _};
use std::path::Path;
use std::process::{Command, Stdio};
use trueaxis_controllers::gcode::Setup;
use trueaxis_controllers::gcode::axes::{self, COUNT, PerLetter};
use trueaxis_controllers::gcode::modal::Units;

/// Positions that are printed differently are farther apart, in any unit.
const SAME: f64 = 0.5e-4;

/// Runs the interpreter: the flat program.
pub fn expand(program: &Path, tools: Option<&Path>, setup: &Setup) -> Result<Scratch, BadInput> {
    let failed = |what: &str, error: std::io::Error| {
        BadInput::new(
            format!("--expand: {what}: {error}"),
            "check the folder of temporary files",
        )
    };
    let scratch = || Scratch::new().map_err(|e| failed("a temporary file cannot be made", e));
    let (mut ini, mut parameters, mut table) = (scratch()?, scratch()?, scratch()?);
    let put = |file: &mut Scratch, text: &str| {
        let done = file.write_all(text.as_bytes()).and_then(|()| file.flush());
        done.map_err(|e| failed("a temporary file cannot be written", e))
    };
    put(&mut parameters, &parameters_of(setup))?;
    put(&mut table, &tools_of(setup))?;
    let text = format!(
        "[RS274NGC]\nPARAMETER_FILE = {}\n",
        parameters.path().display()
    );
    put(&mut ini, &text)?;
    let mut command = Command::new("rs274");
    command.arg("-i").arg(ini.path());
    command.arg("-t").arg(tools.unwrap_or(table.path()));
    command.args(["-n", "2", "-g"]).arg(program);
    command
        .stdin(Stdio::null())
        .current_dir(std::env::temp_dir());
    let output = command.output().map_err(|error| match error.kind() {
        ErrorKind::NotFound => BadInput::new(
            "--expand: LinuxCNC's interpreter, rs274, is not installed",
            "install linuxcnc-uspace, or write the program out flat",
        ),
        _ => failed("rs274 cannot be started", error),
    })?;
    let said = String::from_utf8_lossy(&output.stdout);
    let flat = flat(&said, setup).map_err(|cause| {
        let errors = String::from_utf8_lossy(&output.stderr);
        let mut lines = errors
            .lines()
            .map(|l| l.trim_start_matches("executing").trim());
        let first = lines.find(|l| !l.is_empty());
        let why = first.map_or(String::new(), |line| format!(" ({line})"));
        BadInput::new(
            format!("--expand: {}: {cause}{why}", program.display()),
            "write the program out flat, or use the compensation in the controller",
        )
    })?;
    let mut file = scratch()?;
    put(&mut file, &flat)?;
    Ok(file)
}

/// The parameters of a setup, in mm.
fn parameters_of(setup: &Setup) -> String {
    let mut text = String::new();
    let mut group = |first: u32, values: &PerLetter| {
        for (axis, value) in values.iter().enumerate() {
            let _ = writeln!(text, "{}\t{value:.6}", first + axis as u32);
        }
    };
    for (home, first) in setup.homes.iter().zip([5161, 5181]) {
        group(first, &home.map_or([0.0; COUNT], |home| home.at));
    }
    group(5211, &setup.g92);
    let mut rotations = Vec::new();
    for number in 1..=9_u16 {
        let system = setup.systems.get(&number).copied().unwrap_or_default();
        let first = 5201 + 20 * u32::from(number);
        group(first, &system.origin);
        rotations.push((first + 9, system.rotation));
    }
    for (parameter, rotation) in rotations {
        let _ = writeln!(text, "{parameter}\t{rotation:.6}");
    }
    let on = u8::from(setup.g92 != [0.0; COUNT]);
    let _ = writeln!(text, "5210\t{on}\n5220\t{}", setup.selected.unwrap_or(1));
    // In order, as LinuxCNC needs them.
    let mut lines: Vec<&str> = text.lines().collect();
    lines.sort_unstable();
    lines.join("\n") + "\n"
}

fn tools_of(setup: &Setup) -> String {
    let tools = setup.tools.iter();
    tools
        .map(|(number, offset)| format!("T{number} P{number} Z{:.6}\n", offset[2]))
        .collect()
}

/// What holds while canonical commands are read.
struct State<'s> {
    setup: &'s Setup,
    text: String,
    units: Units,
    plane: [usize; 3],
    /// The system that holds, and its offsets as they were printed last (in units of the program).
    system: u16,
    origins: BTreeMap<u16, PerLetter>,
    tool: PerLetter,
    /// Where the machine is, in units of the program, as far as it is printed.
    at: PerLetter,
}

/// Canonical commands as a program; the cause if there is one that is not followed.
fn flat(said: &str, setup: &Setup) -> Result<String, String> {
    let mut state = State {
        setup,
        text: String::new(),
        units: Units::Millimetre,
        plane: [0, 1, 2],
        system: 0,
        origins: BTreeMap::new(),
        tool: [0.0; COUNT],
        at: [0.0; COUNT],
    };
    let mut ended = false;
    for line in said.lines() {
        let inside = line.trim_end().strip_suffix(')');
        let Some((name, inside)) = inside.and_then(|l| l.split_once('(')) else {
            continue;
        };
        let name = name.split_whitespace().last().unwrap_or_default();
        state.command(name, inside)?;
        ended |= name == "PROGRAM_END";
    }
    match ended {
        true => Ok(state.text),
        false => Err("the interpreter does not come to its end".to_owned()),
    }
}

impl State<'_> {
    fn line(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }

    fn origin(&self) -> PerLetter {
        self.origins.get(&self.system).copied().unwrap_or_default()
    }

    /// Positions of the machine from printed ones, in units of the program.
    fn machine(&self, printed: &PerLetter) -> PerLetter {
        let origin = self.origin();
        std::array::from_fn(|i| printed[i] + origin[i] + self.tool[i])
    }

    /// Words of the axes that go elsewhere.
    fn words(&mut self, printed: &PerLetter) -> String {
        let to = self.machine(printed);
        let mut words = String::new();
        for i in 0..COUNT {
            if (to[i] - self.at[i]).abs() > SAME {
                let _ = write!(words, " {}{}", axes::name(i), printed[i]);
                self.at[i] = to[i];
            }
        }
        words
    }

    fn command(&mut self, name: &str, inside: &str) -> Result<(), String> {
        let numbers: Vec<f64> = inside
            .split([',', ' '])
            .filter_map(|n| n.parse().ok())
            .collect();
        let nine = |numbers: &[f64]| -> PerLetter {
            std::array::from_fn(|i| numbers.get(i).copied().unwrap_or_default())
        };
        let is_zero = |numbers: &[f64]| numbers.iter().all(|n| *n == 0.0);
        match name {
            "USE_LENGTH_UNITS" => {
                let inches = inside.contains("INCH");
                self.change_units(if inches {
                    Units::Inch
                } else {
                    Units::Millimetre
                });
                self.line(if inches { "G20" } else { "G21" });
            }
            "SET_G5X_OFFSET" => {
                let number = numbers.first().copied().unwrap_or_default() as u16;
                self.select(number, nine(numbers.get(1..).unwrap_or_default()));
            }
            "SET_G92_OFFSET" | "SET_XY_ROTATION" if is_zero(&numbers) => {}
            "SET_G92_OFFSET" => return Err("an offset G92 is not followed".to_owned()),
            "SET_XY_ROTATION" => return Err("a rotation is not followed".to_owned()),
            "USE_TOOL_LENGTH_OFFSET" => {
                self.tool = nine(&numbers);
                let words: String = (0..COUNT)
                    .filter(|i| self.tool[*i] != 0.0)
                    .map(|i| format!(" {}{}", axes::name(i), self.tool[i]))
                    .collect();
                match words.is_empty() {
                    true => self.line("G49"),
                    false => self.line(&format!("G43.1{words}")),
                }
            }
            "SELECT_PLANE" => {
                let (word, plane) = match inside {
                    "CANON_PLANE_XZ" => ("G18", [2, 0, 1]),
                    "CANON_PLANE_YZ" => ("G19", [1, 2, 0]),
                    _ => ("G17", [0, 1, 2]),
                };
                self.plane = plane;
                self.line(word);
            }
            "SET_FEED_MODE" => match numbers.last() {
                Some(1.0) => self.line("G95"),
                _ => self.line("G94"),
            },
            "SET_FEED_RATE" if is_zero(&numbers) => {}
            "SET_FEED_RATE" => self.line(&format!("F{inside}")),
            "STRAIGHT_TRAVERSE" | "STRAIGHT_FEED" => {
                let word = if name == "STRAIGHT_FEED" { "G1" } else { "G0" };
                let words = self.words(&nine(&numbers));
                if !words.is_empty() {
                    self.line(&format!("{word}{words}"));
                }
            }
            "ARC_FEED" => self.arc(&numbers)?,
            "DWELL" => self.line(&format!("G4 P{inside}")),
            "SET_SPINDLE_SPEED" => {
                let speed = numbers.last().copied().unwrap_or_default();
                self.line(&format!("S{speed}"));
            }
            "START_SPINDLE_CLOCKWISE" => self.line("M3"),
            "START_SPINDLE_COUNTERCLOCKWISE" => self.line("M4"),
            "STOP_SPINDLE_TURNING" => self.line("M5"),
            "FLOOD_ON" => self.line("M8"),
            "MIST_ON" => self.line("M7"),
            "FLOOD_OFF" | "MIST_OFF" => self.line("M9"),
            "SELECT_TOOL" => self.line(&format!("T{inside}")),
            "CHANGE_TOOL" => self.line("M6"),
            "SET_MOTION_CONTROL_MODE" => match inside.split_once(", ") {
                Some((_, tolerance)) => self.line(&format!("G64 P{tolerance}")),
                None if inside.contains("STOP") => self.line("G61.1"),
                None => self.line("G61"),
            },
            "COMMENT" | "MESSAGE" => {
                let text = inside.trim_matches('"');
                if !text.contains(['(', ')']) && !text.starts_with("interpreter:") {
                    let begin = if name == "MESSAGE" { "MSG, " } else { "" };
                    self.line(&format!("({begin}{text})"));
                }
            }
            "PROGRAM_STOP" => self.line("M0"),
            "OPTIONAL_PROGRAM_STOP" => self.line("M1"),
            "PROGRAM_END" => self.line("M2"),
            "ON_RESET"
            | "SET_FEED_REFERENCE"
            | "SET_SPINDLE_MODE"
            | "START_CHANGE"
            | "SET_NAIVECAM_TOLERANCE"
            | "INIT_CANON"
            | "FINISH"
            | "ENABLE_FEED_OVERRIDE"
            | "DISABLE_FEED_OVERRIDE"
            | "ENABLE_SPEED_OVERRIDE"
            | "DISABLE_SPEED_OVERRIDE" => {}
            other => return Err(format!("the canonical command {other} is not followed")),
        }
        Ok(())
    }

    fn change_units(&mut self, units: Units) {
        let factor = self.units.mm() / units.mm();
        let linear = (0..COUNT).filter(|i| !axes::is_rotary(*i));
        for i in linear {
            self.at[i] *= factor;
            self.tool[i] *= factor;
            for origin in self.origins.values_mut() {
                origin[i] *= factor;
            }
        }
        self.units = units;
    }

    /// A system, with its offsets: those of the setup, unless the program has set others.
    fn select(&mut self, number: u16, printed: PerLetter) {
        let unit = self.units.mm();
        let system = self.setup.systems.get(&number).copied().unwrap_or_default();
        let first: PerLetter = std::array::from_fn(|i| match axes::is_rotary(i) {
            true => system.origin[i],
            false => system.origin[i] / unit,
        });
        let known = self.origins.get(&number).copied().unwrap_or(first);
        let is_other = (0..COUNT).any(|i| (known[i] - printed[i]).abs() > 2.0 * SAME);
        self.origins
            .insert(number, if is_other { printed } else { known });
        if is_other {
            let words: String = (0..6)
                .filter(|i| (known[*i] - printed[*i]).abs() > 2.0 * SAME)
                .map(|i| format!(" {}{}", axes::name(i), printed[i]))
                .collect();
            self.line(&format!("G10 L2 P{number}{words}"));
        }
        if self.system != number {
            self.system = number;
            self.line(&match number {
                7..=9 => format!("G59.{}", number - 6),
                number => format!("G{}", 53 + number),
            });
        }
    }

    fn arc(&mut self, numbers: &[f64]) -> Result<(), String> {
        let [first, second, centre_1, centre_2, turns, normal, rest @ ..] = numbers else {
            return Err("an arc cannot be read".to_owned());
        };
        let [i, j, n] = self.plane;
        let offset = self.machine(&[0.0; COUNT]);
        let mut to: PerLetter = std::array::from_fn(|k| self.at[k] - offset[k]);
        let centre = [centre_1 - to[i], centre_2 - to[j]];
        (to[i], to[j], to[n]) = (*first, *second, *normal);
        for (k, value) in rest.iter().enumerate() {
            to[3 + k] = *value;
        }
        let word = if *turns < 0.0 { "G2" } else { "G3" };
        let mut line = word.to_owned() + &self.words(&to);
        for (axis, value) in [(i, centre[0]), (j, centre[1])] {
            let _ = write!(line, " {}{value:.4}", ["I", "J", "K"][axis]);
        }
        if turns.abs() > 1.0 {
            let _ = write!(line, " P{}", turns.abs());
        }
        self.line(&line);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAID: &str = "\
    1 N..... USE_LENGTH_UNITS(CANON_UNITS_MM)
    2 N..... SET_G5X_OFFSET(1, 5.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000)
    3 N..... SET_G92_OFFSET(0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000)
    4 N..... COMMENT(\"interpreter: continuing to use same coordinate system\")
    5 N..... STRAIGHT_TRAVERSE(3.0000, 1.0000, 0.0000, 0.0000, 0.0000, 0.0000)
    6 N..... USE_TOOL_LENGTH_OFFSET(0.0000 0.0000 3.0000, 0.0000 0.0000 0.0000, 0.0000 0.0000 0.0000)
    7 N..... SET_FEED_RATE(10.0000)
    8 N..... STRAIGHT_FEED(1.0000, 1.0000, -4.0000, 0.0000, 0.0000, 0.0000)
    9 N..... ARC_FEED(2.0000, 1.0000, 1.5000, 1.0000, -1, -4.0000, 0.0000, 0.0000, 0.0000)
   10 N..... SET_G5X_OFFSET(2, 7.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000)
   11 N..... STRAIGHT_FEED(1.0000, 1.0000, -4.0000, 3.0000, 0.0000, 0.0000)
   12 N..... COMMENT(\"hello\")
   13 N..... PROGRAM_END()
";

    #[test]
    fn canonical_commands_become_lines() {
        let mut setup = Setup::default();
        let mut system = trueaxis_controllers::gcode::offsets::System::default();
        system.origin[0] = 5.0;
        setup.systems.insert(1, system);
        let lines = flat(SAID, &setup).unwrap();
        let expected = "G21\nG54\nG0 X3 Y1\nG43.1 Z3\nF10.0000\nG1 X1 Z-4\nG2 X2 I0.5000 J0.0000\nG10 L2 P2 X7\nG55\n\
                        G1 X1 A3\n(hello)\nM2\n";
        assert_eq!(lines, expected);
        let probing = SAID.replace("STRAIGHT_TRAVERSE", "STRAIGHT_PROBE");
        assert!(
            flat(&probing, &setup)
                .unwrap_err()
                .contains("STRAIGHT_PROBE")
        );
        let cut_off = SAID.replace("PROGRAM_END", "ON_RESET");
        assert!(flat(&cut_off, &setup).is_err());
    }
}

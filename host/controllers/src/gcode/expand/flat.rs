//! Canonical commands as a flat program: each has its effect, or the program is refused.

use super::canonical::Line;
use super::given::{BEGIN, HOME, UNKNOWN_ROTATION};
use super::source::{CALL, Source};
use super::{DECIMALS, ExpandError, Expanded, FLAT, Given, KNOWN, failed, refusal};
use crate::gcode::axes::{self, COUNT, PerLetter};
use crate::gcode::fault::Refusal;
use crate::gcode::interpret::bits;
use crate::gcode::modal::{Plane, Units};
use crate::gcode::offsets::{Number, Offsets, system_name};
use crate::gcode::setup::Setup;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{BufRead, Write};

/// Half of the last digit that the interpreter prints, in its unit, and a little for its own rounding.
const HALF_DIGIT: f64 = 0.51e-4;

/// Why a command is refused: cause and remedy.
type Bad = (String, String);

fn bad<T>(cause: impl Into<String>, remedy: impl Into<String>) -> Result<T, Bad> {
    Err((cause.into(), remedy.into()))
}

/// A flat program while it is written.
pub struct Flat<'s> {
    setup: &'s Setup,
    axes: u16,
    source: &'s Source,
    expanded: Expanded,
    /// What waits to be written.
    text: String,
    /// True from the first line of the program on.
    begun: bool,
    /// The word at the end, once it is reached.
    end: Option<&'static str>,
    /// Commands so far.
    count: u64,
    /// The line of the program.
    line: u64,
    units: Units,
    plane: Plane,
    /// What holds in the flat program, and with the same values in the interpreter.
    offsets: Offsets,
    /// The system that the interpreter has selected, until its rotation is known too.
    system: Option<(Number, PerLetter, Option<f64>)>,
    /// True for G5X, G92 and tool offsets that are known to the interpreter's digits only.
    printed: [bool; 3],
    /// Where the flat program puts the machine (mm, degrees).
    at: PerLetter,
    /// The axes that words of the flat program have moved.
    moved: [bool; 6],
    /// The units of the words that put it there.
    at_units: PerLetter,
    /// Where the interpreter has put it last, in words (mm, degrees), and whether offsets or units have changed since.
    shown: PerLetter,
    changed: bool,
    feed: Option<String>,
    per_revolution: bool,
    shuttle: bool,
    continuous: Option<f64>,
}

impl<'s> Flat<'s> {
    /// Before the first command.
    pub fn new(given: &Given<'s>, source: &'s Source) -> Self {
        let setup = given.setup;
        let mut offsets = Offsets::new(setup.systems.clone(), setup.selected.unwrap_or(1));
        offsets.g92 = setup.g92;
        Self {
            setup,
            axes: given.axes,
            source,
            expanded: Expanded::default(),
            text: String::new(),
            begun: false,
            end: None,
            count: 0,
            line: 1,
            units: Units::Millimetre,
            plane: Plane::Xy,
            offsets,
            system: None,
            printed: [false; 3],
            at: [0.0; COUNT],
            moved: [false; 6],
            at_units: [1.0; COUNT],
            shown: [0.0; COUNT],
            changed: true,
            feed: None,
            per_revolution: false,
            shuttle: false,
            continuous: None,
        }
    }

    /// Writes the program of all commands.
    pub fn read(
        &mut self,
        mut reader: impl BufRead,
        out: &mut impl Write,
    ) -> Result<(), ExpandError> {
        let mut bytes = Vec::new();
        loop {
            bytes.clear();
            let read = reader.read_until(b'\n', &mut bytes);
            if read.map_err(failed("the interpreter's output cannot be read"))? == 0 {
                return Ok(());
            }
            let line = String::from_utf8_lossy(&bytes);
            let command = Line::parse(&line).filter(|l| l.count == self.count + 1);
            let Some(command) = command else {
                return Err(refusal(
                    self.line,
                    &line,
                    "LinuxCNC's interpreter prints something that is not a canonical command",
                    FLAT,
                )
                .into());
            };
            self.count += 1;
            self.line = self.source.line_of(command.block, self.line);
            if let Err((cause, remedy)) = self.command(&command) {
                return Err(self.refused(&command, cause, remedy).into());
            }
            if self.text.len() > 1 << 16 {
                self.flush(out)?;
            }
        }
    }

    fn flush(&mut self, out: &mut impl Write) -> Result<(), ExpandError> {
        let written = out.write_all(self.text.as_bytes());
        written.map_err(failed("the expanded program cannot be written"))?;
        self.text.clear();
        Ok(())
    }

    fn refused(&self, command: &Line<'_>, cause: String, remedy: String) -> Refusal {
        let (line, place) = match command.block {
            Some(block) => self.source.place(block, self.line),
            None => (self.line, String::new()),
        };
        let word = format!("{}({})", command.name, command.inside);
        refusal(line, &word, cause + &place, remedy)
    }

    /// What the interpreter left behind in parameters, and the end of the program.
    pub fn finish(
        mut self,
        parameters: &str,
        out: &mut impl Write,
    ) -> Result<Expanded, ExpandError> {
        let Some(end) = self.end else {
            let cause = "the interpreter's output does not come to an end";
            return Err(refusal(self.line, "", cause, FLAT).into());
        };
        let line = self.line;
        self.left_behind(parameters)
            .map_err(|(cause, remedy)| refusal(line, "", cause, remedy))?;
        if !end.is_empty() {
            self.write(end);
        }
        if self.source.percent {
            self.write("%");
        }
        self.flush(out)?;
        Ok(self.expanded)
    }

    /// Sets the systems that the program has set and not used: no command shows them. Refuses places of G28 and G30
    /// that it has stored, which cannot be set without going there.
    fn left_behind(&mut self, parameters: &str) -> Result<(), Bad> {
        let number = |line: &str| {
            let mut cells = line.split_whitespace();
            Some((
                cells.next()?.parse::<u32>().ok()?,
                cells.next()?.parse::<f64>().ok()?,
            ))
        };
        let left: BTreeMap<u32, f64> = parameters.lines().filter_map(number).collect();
        let group = |first: u32| -> PerLetter {
            std::array::from_fn(|axis| {
                let value = left
                    .get(&(first + axis as u32))
                    .copied()
                    .unwrap_or_default();
                if axes::is_rotary(axis) {
                    value
                } else {
                    value * 25.4
                }
            })
        };
        // As the values were printed, at most in inches.
        let same = |a: f64, b: f64| (a - b).abs() < 25.4 * HALF_DIGIT;
        let machine: Vec<usize> = bits(self.axes & 0b11_1111).collect();
        for (home, first) in [5161, 5181].into_iter().enumerate() {
            let at = group(first);
            let known = self.setup.homes[home].unwrap_or_default();
            let moved = |axis: &&usize| match known.knows(**axis) {
                true => !same(known.at[**axis], at[**axis]),
                false => at[**axis].abs() < KNOWN,
            };
            if machine.iter().any(|axis| moved(&axis)) {
                let name = ["G28", "G30"][home];
                return bad(
                    format!(
                        "the program stores where {name} goes ({name}.1): no canonical command shows it"
                    ),
                    format!(
                        "give it in the setup, [home.{name}], and take {name}.1 out of the program"
                    ),
                );
            }
        }
        for number in 1..=9 {
            let first = 5201 + 20 * u32::from(number);
            let origin = group(first);
            let rotation = left.get(&(first + 9)).copied().unwrap_or_default();
            let is_set = |axis: &usize| origin[*axis].abs() < KNOWN;
            let turned = !same(rotation, UNKNOWN_ROTATION);
            let (which, known) = match self.offsets.systems.get(&number) {
                Some(known) => {
                    let differs = |axis: &&usize| !same(known.origin[**axis], origin[**axis]);
                    (
                        machine.iter().filter(differs).copied().collect(),
                        Some(*known),
                    )
                }
                None if machine.iter().any(is_set) || turned => (machine.clone(), None),
                None => (Vec::new(), None),
            };
            let turns = match known {
                Some(known) => (known.rotation - rotation).abs() > HALF_DIGIT,
                None => !which.is_empty(),
            };
            if which.is_empty() && !turns {
                continue;
            }
            if !which.iter().all(is_set) || !turned {
                let name = system_name(number);
                return bad(
                    format!("the program sets a part of {name}, and the rest is not known"),
                    format!("give it in the setup: [offset.\"{name}\"]"),
                );
            }
            let words = self.words(&which, &origin);
            let rotation = if turns {
                format!(" R{rotation}")
            } else {
                String::new()
            };
            self.write(&format!("G10 L2 P{number}{words}{rotation}"));
        }
        Ok(())
    }

    /// A line of the program.
    fn write(&mut self, line: &str) {
        if !self.begun {
            return;
        }
        let number = self.line;
        // Comments have no number.
        if !line.starts_with(['(', '%']) {
            let _ = write!(self.text, "N{number} ");
        }
        self.text.push_str(line);
        self.text.push('\n');
        self.expanded
            .lines
            .push(u32::try_from(number).unwrap_or(u32::MAX));
    }

    /// The first lines: the modes that hold.
    fn begin(&mut self) {
        self.begun = true;
        self.moved = [false; 6];
        if self.source.percent {
            self.write("%");
        }
        let plane = ["G17", "G18", "G19"][self.plane as usize];
        let feed = ["G94", "G95"][usize::from(self.per_revolution)];
        self.expanded.inches = self.units == Units::Inch;
        let units = word_of_units(self.units);
        self.write(&format!("{units} {plane} G90 G91.1 {feed}"));
    }

    fn command(&mut self, command: &Line<'_>) -> Result<(), Bad> {
        let name = command.name;
        let unexpected = || bad::<()>("a canonical command with other arguments than known", FLAT);
        if self.end.is_some() && name != "ON_RESET" {
            return bad("a canonical command after the end", FLAT);
        }
        if !["SET_XY_ROTATION", "SET_G92_OFFSET"].contains(&name) {
            self.use_system();
        }
        let shuttle = std::mem::take(&mut self.shuttle);
        match name {
            "ON_RESET" | "SET_FEED_REFERENCE" | "START_CHANGE" => {}
            "COMMENT" => return self.comment(command),
            "MESSAGE" | "LOG" | "LOGOPEN" | "LOGAPPEND" => {
                let Some(text) = command.text() else {
                    return unexpected();
                };
                let kind = if name == "MESSAGE" { "MSG" } else { name };
                self.write(&format!("({kind},{text})"));
            }
            "LOGCLOSE" => self.write("(LOGCLOSE)"),
            "USE_LENGTH_UNITS" => {
                let units = match command.inside {
                    "CANON_UNITS_MM" => Units::Millimetre,
                    "CANON_UNITS_INCHES" => Units::Inch,
                    _ => return unexpected(),
                };
                if units != self.units {
                    // F counts in the unit that held when it was given, though a line may have both.
                    let feed = self.feed.take().and_then(|feed| feed.parse::<f64>().ok());
                    let feed = feed.map(|feed| feed * self.units.mm() / units.mm());
                    self.feed = feed.map(|feed| feed.to_string());
                    self.units = units;
                    self.changed = true;
                    self.expanded.inches |= units == Units::Inch;
                }
                self.write(word_of_units(units));
            }
            "SELECT_PLANE" => {
                let (plane, word) = match command.inside {
                    "CANON_PLANE_XY" => (Plane::Xy, "G17"),
                    "CANON_PLANE_XZ" => (Plane::Zx, "G18"),
                    "CANON_PLANE_YZ" => (Plane::Yz, "G19"),
                    _ => return unexpected(),
                };
                self.plane = plane;
                self.write(word);
            }
            "SET_G5X_OFFSET" => {
                let Some([number, origin @ ..]) = command.numbers::<7>() else {
                    return unexpected();
                };
                if !(1.0..=9.0).contains(&number) {
                    return unexpected();
                }
                self.system = Some((number as Number, self.lengths(&origin), None));
            }
            "SET_XY_ROTATION" => {
                let Some([rotation]) = command.numbers::<1>() else {
                    return unexpected();
                };
                let selected = self.offsets.selected();
                let here = self.offsets.active().map_or([HOME[0]; COUNT], |s| s.origin);
                self.system.get_or_insert((selected, here, None)).2 = Some(rotation);
            }
            "SET_G92_OFFSET" => match command.numbers::<6>() {
                Some(offset) => self.shift(&offset)?,
                None => return unexpected(),
            },
            "USE_TOOL_LENGTH_OFFSET" => match command.numbers::<9>() {
                Some(offset) => self.tool_offset(&offset)?,
                None => return unexpected(),
            },
            "SET_FEED_MODE" => match command.numbers::<2>() {
                Some([0.0, mode @ (0.0 | 1.0)]) => {
                    if self.per_revolution != (mode == 1.0) {
                        self.per_revolution = mode == 1.0;
                        self.write(["G94", "G95"][usize::from(self.per_revolution)]);
                    }
                }
                _ => return unexpected(),
            },
            "SET_FEED_RATE" => match command.numbers::<1>() {
                // No feed: a move needs its own, or LinuxCNC refuses it.
                Some([0.0]) => self.feed = None,
                Some([_]) => self.feed = Some(trimmed(command.inside)),
                None => return unexpected(),
            },
            "STRAIGHT_TRAVERSE" | "STRAIGHT_FEED" => {
                if command.numbers::<6>().is_none() {
                    return unexpected();
                }
                return self.straight(command, name == "STRAIGHT_FEED");
            }
            "ARC_FEED" => {
                let Some(numbers) = command.numbers::<9>() else {
                    return unexpected();
                };
                return self.arc(command, &numbers);
            }
            "DWELL" => match command.numbers::<1>() {
                Some([0.0]) => {}
                Some([_]) => self.write(&format!("G4 P{}", trimmed(command.inside))),
                None => return unexpected(),
            },
            "SET_MOTION_CONTROL_MODE" => {
                self.continuous = None;
                match command.inside.split_once(", ") {
                    Some(("CANON_CONTINUOUS", tolerance)) => {
                        let Ok(value) = tolerance.parse::<f64>() else {
                            return unexpected();
                        };
                        self.continuous = Some(value);
                        match value == 0.0 {
                            true => self.write("G64"),
                            false => self.write(&format!("G64 P{}", trimmed(tolerance))),
                        }
                    }
                    None if command.inside == "CANON_EXACT_PATH" => self.write("G61"),
                    None if command.inside == "CANON_EXACT_STOP" => self.write("G61.1"),
                    _ => return unexpected(),
                }
            }
            "SET_NAIVECAM_TOLERANCE" => match (command.numbers::<1>(), self.continuous) {
                // Exact stop and exact path do not use it; G64 P sets both.
                (Some(_), None) => {}
                (Some([naive]), Some(tolerance)) if (naive - tolerance).abs() < 1e-4 => {}
                (Some([naive]), Some(tolerance)) => {
                    self.write(&format!("G64 P{tolerance} Q{naive}"))
                }
                (None, _) => return unexpected(),
            },
            "SET_SPINDLE_MODE" => match command.numbers::<2>() {
                Some([0.0, 0.0]) => {}
                Some([0.0, _]) => {
                    return bad(
                        "constant surface speed (G96): a diameter decides the speed",
                        FLAT,
                    );
                }
                _ => return self.other_spindle(),
            },
            "SET_SPINDLE_SPEED" => match command.numbers::<2>() {
                Some([0.0, speed]) => self.write(&format!("S{speed}")),
                _ => return self.other_spindle(),
            },
            "START_SPINDLE_CLOCKWISE"
            | "START_SPINDLE_COUNTERCLOCKWISE"
            | "STOP_SPINDLE_TURNING" => {
                if command.numbers::<1>() != Some([0.0]) {
                    return self.other_spindle();
                }
                self.write(match name {
                    "START_SPINDLE_CLOCKWISE" => "M3",
                    "START_SPINDLE_COUNTERCLOCKWISE" => "M4",
                    _ => "M5",
                });
            }
            "ORIENT_SPINDLE" => match command.numbers::<3>() {
                Some([0.0, angle, way]) => self.write(&format!("M19 R{angle} P{way}")),
                _ => return self.other_spindle(),
            },
            "FLOOD_ON" => self.write("M8"),
            "MIST_ON" => self.write("M7"),
            // The one word for both, which the interpreter prints as two commands.
            "FLOOD_OFF" | "MIST_OFF" => self.write("M9"),
            "ENABLE_FEED_OVERRIDE" => self.write("M50 P1"),
            "DISABLE_FEED_OVERRIDE" => self.write("M50 P0"),
            "ENABLE_ADAPTIVE_FEED" => self.write("M52 P1"),
            "DISABLE_ADAPTIVE_FEED" => self.write("M52 P0"),
            "ENABLE_FEED_HOLD" => self.write("M53 P1"),
            "DISABLE_FEED_HOLD" => self.write("M53 P0"),
            "ENABLE_SPEED_OVERRIDE" | "DISABLE_SPEED_OVERRIDE" => {
                if command.numbers::<1>() != Some([0.0]) {
                    return self.other_spindle();
                }
                let on = u8::from(name == "ENABLE_SPEED_OVERRIDE");
                self.write(&format!("M51 P{on}"));
            }
            "SET_MOTION_OUTPUT_BIT"
            | "CLEAR_MOTION_OUTPUT_BIT"
            | "SET_AUX_OUTPUT_BIT"
            | "CLEAR_AUX_OUTPUT_BIT" => {
                let Some([pin]) = command.numbers::<1>() else {
                    return unexpected();
                };
                let word = match name {
                    "SET_MOTION_OUTPUT_BIT" => "M62",
                    "CLEAR_MOTION_OUTPUT_BIT" => "M63",
                    "SET_AUX_OUTPUT_BIT" => "M64",
                    _ => "M65",
                };
                self.write(&format!("{word} P{pin}"));
            }
            "SET_MOTION_OUTPUT_VALUE" | "SET_AUX_OUTPUT_VALUE" => {
                let Some([pin, value]) = command.numbers::<2>() else {
                    return unexpected();
                };
                let word = if name == "SET_MOTION_OUTPUT_VALUE" {
                    "M67"
                } else {
                    "M68"
                };
                self.write(&format!("{word} E{pin} Q{value}"));
            }
            "SELECT_TOOL" => match command.numbers::<1>() {
                Some([tool]) => self.write(&format!("T{tool}")),
                None => return unexpected(),
            },
            "CHANGE_TOOL" => {
                if self.begun && self.setup.tool_change.is_some() {
                    return bad(
                        "a tool change that moves the machine: the stand-alone interpreter does not follow it",
                        "leave [tool_change] out of the setup if the next moves name all axes, or write the program out flat",
                    );
                }
                self.write("M6");
            }
            "PROGRAM_STOP" => self.write(if shuttle { "M60" } else { "M0" }),
            "OPTIONAL_PROGRAM_STOP" => self.write("M1"),
            "PALLET_SHUTTLE" => self.shuttle = true,
            "PROGRAM_END" => self.end = Some(if shuttle { "M30" } else { "M2" }),
            "FINISH" => self.end = Some(""),
            _ => return bad(not_representable(name), FLAT),
        }
        if shuttle && !["PROGRAM_STOP", "PROGRAM_END"].contains(&name) {
            return unexpected();
        }
        Ok(())
    }

    fn other_spindle(&self) -> Result<(), Bad> {
        bad("another spindle than the first", FLAT)
    }

    fn comment(&mut self, command: &Line<'_>) -> Result<(), Bad> {
        let Some(text) = command.text() else {
            return bad("a comment without quotation marks", FLAT);
        };
        match text {
            BEGIN => self.begin(),
            CALL => {}
            _ if !self.begun => {}
            "interpreter: cutter radius compensation on right"
            | "interpreter: cutter radius compensation on left" => {
                return bad(
                    "cutter compensation (G41, G42): canonical motions are those of the middle of the tool",
                    "let your CAM offset the path, or use the compensation in the controller",
                );
            }
            _ if text.starts_with("interpreter: ") => {}
            text => self.write(&format!("({text})")),
        }
        Ok(())
    }

    /// What was printed in units of the program, in mm.
    fn lengths(&self, printed: &[f64]) -> PerLetter {
        std::array::from_fn(|axis| {
            let value = printed.get(axis).copied().unwrap_or(0.0);
            value * self.unit(axis)
        })
    }

    fn unit(&self, axis: usize) -> f64 {
        match axes::is_rotary(axis) {
            true => 1.0,
            false => self.units.mm(),
        }
    }

    /// Whether a value (mm, degrees) is printed as another one is.
    fn same(&self, axis: usize, value: f64, printed: f64) -> bool {
        (value - printed).abs() <= HALF_DIGIT * self.unit(axis)
    }

    /// Words of some axes.
    fn words(&self, which: &[usize], values: &PerLetter) -> String {
        let mut words = String::new();
        for axis in which {
            let value = values[*axis] / self.unit(*axis);
            let value = trimmed(&format!("{value:.DECIMALS$}"));
            let _ = write!(words, " {}{value}", axes::name(*axis));
        }
        words
    }

    /// Selects the system of the last commands, with the values that the program has given to it.
    fn use_system(&mut self) {
        let Some((number, origin, rotation)) = self.system.take() else {
            return;
        };
        let known = self.offsets.systems.get(&number).copied();
        let is_known = |axis: usize| origin[axis].abs() < KNOWN || self.axes >> axis & 1 == 0;
        let rotation = rotation.or(known.map(|k| k.rotation));
        let rotation = rotation.filter(|r| (r - UNKNOWN_ROTATION).abs() > HALF_DIGIT);
        let Some(rotation) = rotation.filter(|_| (0..6).all(is_known)) else {
            // Refused where it moves.
            self.offsets.systems.remove(&number);
            return self.select(number);
        };
        let before = known.unwrap_or_default();
        let words: Vec<usize> = (0..6)
            .filter(|axis| match known {
                Some(_) => !self.same(*axis, before.origin[*axis], origin[*axis]),
                None => self.axes >> axis & 1 == 1,
            })
            .collect();
        let turned = (before.rotation - rotation).abs() > HALF_DIGIT;
        if self.begun && (!words.is_empty() || turned || known.is_none()) {
            let mut system = before;
            let mut line = format!("G10 L2 P{number}{}", self.words(&words, &origin));
            words
                .iter()
                .for_each(|axis| system.origin[*axis] = origin[*axis]);
            if turned || known.is_none() {
                let _ = write!(line, " R{rotation}");
                system.rotation = rotation;
            }
            self.write(&line);
            self.offsets.set(number, system);
            self.printed[0] = true;
            self.changed = true;
        }
        self.select(number);
    }

    fn select(&mut self, number: Number) {
        if number != self.offsets.selected() {
            self.write(&system_name(number));
            self.changed = true;
        }
        self.offsets.select(number);
    }

    fn shift(&mut self, printed: &[f64]) -> Result<(), Bad> {
        let shift = self.lengths(printed);
        if shift.iter().any(|s| s.abs() > KNOWN) {
            return bad(
                "an offset from a position that is not known",
                "give it in the setup, under [start] or [home.G28], or move the axis before with a word of its own",
            );
        }
        let differs = |axis: &usize| !self.same(*axis, self.offsets.g92[*axis], shift[*axis]);
        let which: Vec<usize> = (0..6).filter(differs).collect();
        if which.is_empty() {
            return Ok(());
        }
        let words = self.words(&which, &shift);
        self.write(&format!("G52{words}"));
        which
            .iter()
            .for_each(|axis| self.offsets.g92[*axis] = shift[*axis]);
        self.printed[1] = true;
        self.changed = true;
        Ok(())
    }

    fn tool_offset(&mut self, printed: &[f64; 9]) -> Result<(), Bad> {
        let offset = self.lengths(printed);
        let tool = (offset[8] / 25.4).round();
        if offset[..6].iter().any(|o| o.abs() > KNOWN) {
            return bad(
                format!("the length of tool {tool} is not known"),
                format!("give it in the setup: [tool.{tool}] length = …"),
            );
        }
        self.changed = true;
        self.printed[2] = false;
        let given = self.setup.tools.get(&(tool as u32));
        let of_tool = given.filter(|g| (0..6).all(|a| self.same(a, g[a], offset[a])));
        if offset[..6] == [0.0; 6] && of_tool.is_none() {
            self.offsets.tool = [0.0; COUNT];
            self.write("G49");
        } else if let Some(of_tool) = of_tool {
            self.offsets.tool = *of_tool;
            self.write(&format!("G43 H{tool}"));
        } else {
            let named = |a: &usize| *a < 3 || offset[*a] != 0.0 || self.offsets.tool[*a] != 0.0;
            let which: Vec<usize> = (0..6).filter(named).collect();
            let words = self.words(&which, &offset);
            self.offsets.tool = offset;
            self.offsets.tool[6..].fill(0.0);
            self.printed[2] = true;
            self.write(&format!("G43.1{words}"));
        }
        Ok(())
    }

    /// How far apart positions of an axis are that may be the same after a change of offsets or units: the digits of
    /// both words and of both sums of offsets, of which a rotation may add those of two axes.
    fn digits(&self, axis: usize) -> f64 {
        let printed = self.printed.iter().filter(|printed| **printed).count();
        let unit = self.unit(axis).max(self.at_units[axis]);
        let turned = if self.offsets.is_turned() { 1.5 } else { 1.0 };
        2.0 * HALF_DIGIT * unit * turned * (1 + printed) as f64
    }

    /// The words of axes that go elsewhere, for a motion to printed places; moves there.
    ///
    /// Digits that a change of units brings are written for axes that have moved before, but not at the end of an
    /// arc in its `plane`, where they would make another arc of a full turn.
    fn go(&mut self, places: [&str; 6], plane: &[usize]) -> Result<String, Bad> {
        if self.begun && self.offsets.active().is_none() {
            let name = system_name(self.offsets.selected());
            return bad(
                format!("the offset {name} is not known"),
                format!("give it in the setup: [offset.\"{name}\"]"),
            );
        }
        let from = self.offsets.program(&self.at);
        let mut to = from;
        let mut words = String::new();
        let mut moved = [false; 6];
        let mut differs = false;
        for (axis, place) in places.into_iter().enumerate() {
            let value = place.parse().unwrap_or(f64::NAN) * self.unit(axis);
            let off = (value - from[axis]).abs();
            let is_off = off > HALF_DIGIT * self.unit(axis);
            moved[axis] = match self.changed {
                true if self.moved[axis] && !plane.contains(&axis) => is_off,
                true => off > self.digits(axis),
                false => value != self.shown[axis],
            };
            differs |= self.changed && is_off && !moved[axis];
            self.shown[axis] = value;
            if moved[axis] {
                to[axis] = value;
                self.moved[axis] = true;
                self.at_units[axis] = self.unit(axis);
                let _ = write!(words, " {}{}", axes::name(axis), trimmed(place));
            }
        }
        self.changed = differs;
        self.at = self.offsets.machine(&to);
        if self.offsets.is_turned() {
            let any = moved[0] || moved[1];
            moved[..2].fill(any);
        }
        let lost = (0..6).find(|axis| moved[*axis] && self.at[*axis].abs() > KNOWN);
        let Some(axis) = lost.filter(|_| self.begun) else {
            return Ok(words);
        };
        let name = axes::name(axis);
        let home = (0..2).find(|home| (self.at[axis] - HOME[*home]).abs() < 1e-3);
        match home.map(|home| ["G28", "G30"][home]) {
            Some(home) => bad(
                format!("where {home} takes {name} is not known"),
                format!("give it in the setup: [home.{home}] {name} = …"),
            ),
            None => bad(
                format!("the position of {name} is not known here"),
                format!("give it in the setup: [start] {name} = …"),
            ),
        }
    }

    fn straight(&mut self, command: &Line<'_>, is_feed: bool) -> Result<(), Bad> {
        let mut places = command.words();
        let places = std::array::from_fn(|_| places.next().unwrap_or("nan"));
        let words = self.go(places, &[])?;
        if words.is_empty() {
            return Ok(());
        }
        let (word, feed) = match is_feed {
            true => ("G1", self.feed_word()),
            false => ("G0", String::new()),
        };
        self.write(&format!("{word}{words}{feed}"));
        Ok(())
    }

    fn feed_word(&mut self) -> String {
        self.feed
            .take()
            .map_or(String::new(), |feed| format!(" F{feed}"))
    }

    fn arc(&mut self, command: &Line<'_>, numbers: &[f64; 9]) -> Result<(), Bad> {
        let [_, _, centre_1, centre_2, turns, ..] = *numbers;
        let [i, j, n] = self.plane.axes();
        if turns == 0.0 {
            return bad("an arc without turns", FLAT);
        }
        let from = self.offsets.program(&self.at);
        let mut words = command.words();
        let mut next = || words.next().unwrap_or("nan");
        let mut places = [""; 6];
        (places[i], places[j]) = (next(), next());
        let _ = (next(), next(), next());
        places[n] = next();
        (places[3], places[4], places[5]) = (next(), next(), next());
        let mut line = if turns < 0.0 { "G2" } else { "G3" }.to_owned();
        line += &self.go(places, &[i, j])?;
        if (from[i].abs() > KNOWN || from[j].abs() > KNOWN) && self.begun {
            return bad(
                "an arc from a place that is not known",
                "give it in the setup, under [start], or move there before with words of both axes",
            );
        }
        for (axis, centre) in [(i, centre_1), (j, centre_2)] {
            let by = centre - from[axis] / self.unit(axis);
            let _ = write!(
                line,
                " {}{}",
                ["I", "J", "K"][axis],
                trimmed(&format!("{by:.6}"))
            );
        }
        if turns.abs() > 1.0 {
            let _ = write!(line, " P{}", turns.abs());
        }
        line += &self.feed_word();
        self.write(&line);
        Ok(())
    }
}

fn word_of_units(units: Units) -> &'static str {
    match units {
        Units::Millimetre => "G21",
        Units::Inch => "G20",
    }
}

/// A number without zeros at its end.
fn trimmed(number: &str) -> String {
    let number = number.trim();
    let short = match number.contains('.') {
        true => number.trim_end_matches('0').trim_end_matches('.'),
        false => number,
    };
    if short == "-0" {
        "0".to_owned()
    } else {
        short.to_owned()
    }
}

/// Why a canonical command has no words of its own.
fn not_representable(name: &str) -> String {
    let what = match name {
        "STRAIGHT_PROBE" | "TURN_PROBE_ON" | "TURN_PROBE_OFF" => {
            "probing (G38): where it ends, only the machine knows"
        }
        "START_SPEED_FEED_SYNC"
        | "START_SPEED_FEED_SYNCH"
        | "STOP_SPEED_FEED_SYNCH"
        | "RIGID_TAP" => "motion with the spindle (G33, G33.1, G76)",
        "NURBS_FEED" => "a spline (G5, G5.1, G5.2): the interpreter does not print its points",
        "SET_TOOL_TABLE_ENTRY" | "RELOAD_TOOLDATA" => {
            "the tool table is changed (G10 L1, L10, L11)"
        }
        "CHANGE_TOOL_NUMBER" => "M61: the stand-alone interpreter does not follow it",
        _ => return format!("the canonical command {name} is not known"),
    };
    what.to_owned()
}

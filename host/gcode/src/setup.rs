//! What a program does not say: offsets, tools, where the machine stands.

mod linuxcnc;

use super::axes::{self, COUNT, PerLetter, Position};
use super::modal::{Distance, FeedMode, Motion, Plane, Retract, Units};
use super::offsets::{Number, System};
use super::words::number_of_name;
use serde::Deserialize;
use std::collections::BTreeMap;
use toml::Spanned;
use trueaxis::Travel;
use trueaxis_model::source::FileError;

/// All of it. Lengths in mm, angles in degrees.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Setup {
    /// The unit before a program gives one.
    pub units: Option<Units>,
    /// Where the machine stands before the first line.
    pub start: Position,
    /// Which way each axis has moved last, before the first line.
    pub travel: [Travel; COUNT],
    /// G17, G18 or G19 before the first line, where it is not that of the dialect.
    pub plane: Option<Plane>,
    /// G90 or G91 before the first line.
    pub distance: Option<Distance>,
    /// G93, G94 or G95 before the first line.
    pub feed_mode: Option<FeedMode>,
    /// G90.1 or G91.1 before the first line, where it is not G91.1.
    pub arc_distance: Option<Distance>,
    /// The motion that holds before the first line.
    pub motion: Option<Motion>,
    /// What a length without a point counts, where the controller has a parameter for it.
    pub decimals: Option<Decimals>,
    /// G98 or G99, where it is known which of them holds before the first line.
    pub retract: Option<Retract>,
    /// The tool in the spindle before the first line.
    pub tool: Option<u32>,
    /// Work coordinate systems.
    pub systems: BTreeMap<Number, System>,
    /// The one that holds before the first line.
    pub selected: Option<Number>,
    /// G92 offsets that hold before the first line.
    pub g92: PerLetter,
    /// Those that G92.3 brings back, if they are known.
    pub g92_stored: Option<PerLetter>,
    /// Offset of each tool; that of Z is its length.
    pub tools: BTreeMap<u32, PerLetter>,
    /// Lengths of tools (mm) whose offsets are others: those of tools that were touched off.
    pub lengths: BTreeMap<u32, f64>,
    /// Where G28 and G30 go.
    pub homes: [Option<Position>; 2],
    /// Where M6 goes, of each axis that it moves.
    pub tool_change: Option<Position>,
    /// LinuxCNC's parameters #1 to #5000 that programs read, as they are stored.
    pub parameters: BTreeMap<u32, f64>,
    /// Diameters of tools, in the units of LinuxCNC's tool table.
    pub diameters: BTreeMap<u32, f64>,
    /// Whether words of a rotary axis mean an angle of whichever turn, where that is said.
    pub wrapped: [Option<bool>; COUNT],
}

/// What a length without a point counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decimals {
    /// Whole mm, inches and degrees.
    Calculator,
    /// Least increments: 1 µm, 0.0001 inch, 0.001 degrees.
    Least,
}

type Letters = BTreeMap<String, Spanned<f64>>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    units: Spanned<String>,
    decimals: Option<Spanned<String>>,
    start: Option<Start>,
    #[serde(default)]
    offset: BTreeMap<Spanned<String>, Letters>,
    #[serde(default)]
    tool: BTreeMap<Spanned<String>, Tool>,
    #[serde(default)]
    home: BTreeMap<Spanned<String>, Letters>,
    tool_change: Option<Letters>,
    #[serde(default)]
    axis: BTreeMap<Spanned<String>, AxisEntry>,
}

#[derive(Deserialize)]
struct Start {
    tool: Option<u32>,
    retract: Option<Spanned<String>>,
    plane: Option<Spanned<String>>,
    distance: Option<Spanned<String>>,
    feed: Option<Spanned<String>>,
    motion: Option<Spanned<String>>,
    arcs: Option<Spanned<String>>,
    travel: Option<BTreeMap<String, Spanned<String>>>,
    #[serde(flatten)]
    at: BTreeMap<String, f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Tool {
    length: Spanned<f64>,
    offset: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AxisEntry {
    wrapped: bool,
}

impl Setup {
    /// Reads a setup file.
    ///
    /// # Errors
    /// What is wrong with it, and where.
    pub fn from_toml(text: &str) -> Result<Self, FileError> {
        let file: File = toml::from_str(text).map_err(|e| FileError::syntax(&e, text))?;
        let units = units_of(&file.units)?;
        let mut setup = Self {
            units: Some(units),
            decimals: mode(
                file.decimals,
                &[
                    ("calculator", Decimals::Calculator),
                    ("least", Decimals::Least),
                ],
            )?,
            ..Self::default()
        };
        if let Some(start) = file.start {
            setup.start_with(start, units)?;
        }
        for (name, letters) in &file.offset {
            let (number, system) = system(name, letters, units)?;
            setup.systems.insert(number, system);
        }
        for (name, tool) in &file.tool {
            setup.add_tool(name, tool, units)?;
        }
        for (name, letters) in &file.home {
            setup.homes[home(name)?] = Some(position(letters, units)?);
        }
        if let Some(letters) = &file.tool_change {
            setup.tool_change = Some(position(letters, units)?);
        }
        for (letter, entry) in &file.axis {
            setup.wrapped[rotary_axis(letter)?] = Some(entry.wrapped);
        }
        Ok(setup)
    }

    /// Takes what holds before the first line.
    fn start_with(&mut self, start: Start, units: Units) -> Result<(), FileError> {
        self.tool = start.tool;
        let retracts = [("G98", Retract::Initial), ("G99", Retract::Plane)];
        self.retract = mode(start.retract, &retracts)?;
        let planes = [("G17", Plane::Xy), ("G18", Plane::Zx), ("G19", Plane::Yz)];
        self.plane = mode(start.plane, &planes)?;
        let distances = [("G90", Distance::Absolute), ("G91", Distance::Incremental)];
        self.distance = mode(start.distance, &distances)?;
        let feeds = [
            ("G93", FeedMode::InverseTime),
            ("G94", FeedMode::PerMinute),
            ("G95", FeedMode::PerRevolution),
        ];
        self.feed_mode = mode(start.feed, &feeds)?;
        let arcs = [
            ("G90.1", Distance::Absolute),
            ("G91.1", Distance::Incremental),
        ];
        self.arc_distance = mode(start.arcs, &arcs)?;
        let motions = [
            ("G0", Motion::Rapid),
            ("G1", Motion::Feed),
            ("G2", Motion::Clockwise),
            ("G3", Motion::Counterclockwise),
        ];
        self.motion = mode(start.motion, &motions)?;
        for (letter, value) in &start.at {
            let axis = started(letter, *value)?;
            self.start.set(axis, in_mm(axis, *value, units));
        }
        for (letter, sign) in start.travel.unwrap_or_default() {
            let (axis, travel) = travelled(&letter, &sign)?;
            self.travel[axis] = travel;
        }
        Ok(())
    }

    fn add_tool(
        &mut self,
        name: &Spanned<String>,
        tool: &Tool,
        units: Units,
    ) -> Result<(), FileError> {
        let known = name.get_ref().parse().ok();
        let number = known.unwrap_or_else(|| number_of_name(name.get_ref()));
        if self.tools.contains_key(&number) {
            return Err(wrong(
                name,
                "this tool is there already",
                "write it once, or give it another name: this one cannot be told from the other",
            ));
        }
        let mut offset = [0.0; COUNT];
        let length = finite(&tool.length)? * units.mm();
        offset[2] = match &tool.offset {
            None => length,
            Some(offset) => {
                self.lengths.insert(number, length);
                finite(offset)? * units.mm()
            }
        };
        self.tools.insert(number, offset);
        Ok(())
    }
}

/// The axis of a coordinate at which the machine stands.
fn started(letter: &str, value: f64) -> Result<usize, FileError> {
    let axis = axis_of(letter).ok_or_else(|| {
        FileError::whole(
            format!("[start] {letter}: no axis"),
            "write X, Y, Z, A, B, C, U, V, W, `tool`, `travel`, `retract`, `plane`, `distance`, `arcs`, `feed` or `motion`",
        )
    })?;
    match axes::can_be(value) {
        true => Ok(axis),
        false => Err(FileError::whole(
            format!(
                "[start] {letter}: not a finite number, or beyond {:.0e}",
                axes::LARGEST
            ),
            "write the machine's position",
        )),
    }
}

/// An axis, and which way it has moved.
fn travelled(letter: &str, sign: &Spanned<String>) -> Result<(usize, Travel), FileError> {
    let travel = match sign.get_ref().as_str() {
        "+" => Some(Travel::Positive),
        "-" => Some(Travel::Negative),
        _ => None,
    };
    axis_of(letter).zip(travel).ok_or_else(|| {
        wrong(
            sign,
            "no direction of travel of an axis",
            "write for example travel = { X = \"+\", Y = \"-\" }",
        )
    })
}

fn system(
    name: &Spanned<String>,
    letters: &Letters,
    units: Units,
) -> Result<(Number, System), FileError> {
    let number = number_of(name.get_ref()).ok_or_else(|| {
        wrong(
            name,
            format!("`{}` is not a work coordinate system", name.get_ref()),
            "write [offset.G54] to [offset.G59], [offset.\"G59.1\"] or [offset.\"G54.1 P1\"]",
        )
    })?;
    let mut system = System::default();
    for (letter, value) in letters {
        match axis_of(letter) {
            Some(axis) => system.origin[axis] = in_mm(axis, finite(value)?, units),
            None if letter == "R" => system.rotation = finite(value)?,
            None => return Err(no_axis(value)),
        }
    }
    Ok((number, system))
}

/// The place of G28 or G30.
fn home(name: &Spanned<String>) -> Result<usize, FileError> {
    match name.get_ref().as_str() {
        "G28" => Ok(0),
        "G30" => Ok(1),
        _ => Err(wrong(
            name,
            "no place to go home to",
            "write [home.G28] or [home.G30]",
        )),
    }
}

fn position(letters: &Letters, units: Units) -> Result<Position, FileError> {
    let mut position = Position::default();
    for (letter, value) in letters {
        let axis = axis_of(letter).ok_or_else(|| no_axis(value))?;
        position.set(axis, in_mm(axis, finite(value)?, units));
    }
    Ok(position)
}

/// A mode by its word.
fn mode<T: Copy>(
    word: Option<Spanned<String>>,
    modes: &[(&str, T)],
) -> Result<Option<T>, FileError> {
    let Some(word) = word else {
        return Ok(None);
    };
    let found = modes.iter().find(|(name, _)| name == word.get_ref());
    let names: Vec<String> = modes
        .iter()
        .map(|(name, _)| format!("\"{name}\""))
        .collect();
    match found {
        Some((_, mode)) => Ok(Some(*mode)),
        None => Err(wrong(
            &word,
            "no mode of this kind",
            format!("write {}", names.join(" or ")),
        )),
    }
}

/// What is wrong at a place of the file.
fn wrong<T>(at: &Spanned<T>, cause: impl Into<String>, remedy: impl Into<String>) -> FileError {
    FileError::at(at.span(), cause, "here", remedy)
}

fn no_axis(value: &Spanned<f64>) -> FileError {
    wrong(
        value,
        "this key names no axis",
        "write X, Y, Z, A, B, C, U, V or W; of an offset also R, its rotation in degrees",
    )
}

fn finite(value: &Spanned<f64>) -> Result<f64, FileError> {
    let number = *value.get_ref();
    if axes::can_be(number) {
        return Ok(number);
    }
    let cause = format!("not a finite number, or beyond {:.0e}", axes::LARGEST);
    Err(wrong(value, cause, "write a number"))
}

fn axis_of(letter: &str) -> Option<usize> {
    match letter.as_bytes() {
        [letter] => axes::index(*letter),
        _ => None,
    }
}

fn in_mm(axis: usize, value: f64, units: Units) -> f64 {
    match axes::is_rotary(axis) {
        true => value,
        false => value * units.mm(),
    }
}

/// The number of a system by its name.
fn number_of(name: &str) -> Option<Number> {
    if let Some(number) = name.strip_prefix("G54.1 P") {
        let number: Number = number.parse().ok()?;
        return (1..=300).contains(&number).then_some(100 + number);
    }
    let tenths = name.strip_prefix('G')?.parse::<f64>().ok()? * 10.0;
    let whole = (tenths - tenths.round()).abs() < 1e-6;
    super::codes::system(tenths.round() as u16).filter(|_| whole)
}

/// The unit of lengths of a setup.
fn units_of(name: &Spanned<String>) -> Result<Units, FileError> {
    match name.get_ref().as_str() {
        "mm" => Ok(Units::Millimetre),
        "inch" => Ok(Units::Inch),
        _ => Err(wrong(name, "no unit of length", "write \"mm\" or \"inch\"")),
    }
}

fn rotary_axis(letter: &Spanned<String>) -> Result<usize, FileError> {
    let axis = axis_of(letter.get_ref()).filter(|axis| axes::is_rotary(*axis));
    axis.ok_or_else(|| {
        wrong(
            letter,
            "no rotary axis",
            "write [axis.A], [axis.B] or [axis.C]",
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_setup_gives_offsets_in_its_units_and_leaves_the_rest_unknown() {
        let setup = Setup::from_toml(
            "units = \"inch\"\n[start]\nX = 1\nA = 2.0\ntool = 3\nretract = \"G99\"\n\
             travel = { X = \"-\" }\n\
             [offset.G54]\nX = -10\nR = 5\n[offset.\"G59.1\"]\nA = 4\n[offset.\"G54.1 P7\"]\n\
             [tool.3]\nlength = 2\n[home.G28]\nZ = 0\n",
        )
        .unwrap();
        assert_eq!(setup.start.at[0], 25.4);
        assert_eq!(setup.start.at[3], 2.0);
        assert_eq!(setup.start.known, 0b1001);
        assert_eq!(setup.travel[0], Travel::Negative);
        assert_eq!(setup.retract, Some(Retract::Plane));
        assert_eq!(setup.systems[&1].origin[0], -254.0);
        assert_eq!(setup.systems[&1].rotation, 5.0);
        assert_eq!(
            setup.systems.keys().copied().collect::<Vec<_>>(),
            [1, 7, 107]
        );
        assert_eq!(setup.tools[&3][2], 50.8);
        assert_eq!(setup.homes[0].unwrap().known, 0b100);
        assert!(setup.homes[1].is_none());
    }

    #[test]
    fn what_is_wrong_in_a_setup_is_shown_at_its_place() {
        for (text, part) in [
            ("[start]\nX = 1\n", "units"),
            ("units = \"m\"", "no unit"),
            (
                "units = \"mm\"\n[offset.G53]\nX = 1",
                "not a work coordinate system",
            ),
            ("units = \"mm\"\n[offset.G54]\nQ = 1", "no axis"),
            ("units = \"mm\"\n[offset.G54]\nX = nan", "finite"),
            ("units = \"mm\"\n[start]\nx = 1", "no axis"),
            ("units = \"mm\"\n[offset.G54]\nC = 1e40", "beyond 1e8"),
            ("units = \"mm\"\n[start]\nX = inf", "finite"),
            ("units = \"mm\"\n[tool.1]\nlength = nan", "finite"),
            (
                "units = \"mm\"\n[offset.\"G54.04\"]\nX = 1",
                "not a work coordinate system",
            ),
            ("units = \"mm\"\n[axis.X]\nwrapped = true", "no rotary axis"),
            ("units = \"mm\"\n[axis.C]\n", "missing field"),
            (
                "units = \"mm\"\n[tool.1]\nlength = 1\n[tool.01]\nlength = 1",
                "there already",
            ),
            ("units = \"mm\"\n[tool.1]\nlenght = 1", "unknown field"),
            (
                "units = \"mm\"\n[start]\nretract = \"R\"",
                "no mode of this kind",
            ),
            (
                "units = \"mm\"\n[start]\ntravel = { X = \"up\" }",
                "direction of travel",
            ),
        ] {
            let error = Setup::from_toml(text).unwrap_err();
            assert!(error.message.contains(part), "{text}: {error}");
        }
    }
}

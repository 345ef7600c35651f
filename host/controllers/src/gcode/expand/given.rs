//! The setup in the interpreter's files, and as lines before the program.
//!
//! The stand-alone interpreter takes parameters and tool tables in inches, whatever the machine is, and begins at zero
//! in G21.

use super::{Given, UNKNOWN};
use crate::gcode::axes::{self, COUNT, PerLetter, Position};
use crate::gcode::interpret::bits;
use crate::gcode::modal::{Distance, FeedMode, Plane, Units};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// The comment after the prelude.
pub const BEGIN: &str = "trueaxis: the program begins";
/// mm in the unit of its files.
const INCH: f64 = 25.4;
/// A rotation (degrees) that no system has.
pub const UNKNOWN_ROTATION: f64 = 123.456_789;
/// What must be among the parameters, beside those of offsets.
const MAKES_KNOWN: std::ops::RangeInclusive<u32> = 1..=5000;

/// Lengths as the interpreter's files have them.
fn in_inches(axis: usize, value: f64) -> f64 {
    match axes::is_rotary(axis) {
        true => value,
        false => value / INCH,
    }
}

/// Where G28 and G30 go where the setup does not say it, and where the machine stands then: each kind of [`UNKNOWN`]
/// its own, so that a motion from one to another shows.
pub const HOME: [f64; 2] = [1.25 * UNKNOWN, 1.5 * UNKNOWN];
const START: f64 = 2.0 * UNKNOWN;

/// A position, with another value for those axes of the machine that it does not know, and 0 for others.
fn filled(position: Option<&Position>, machine: u16, unknown: f64) -> PerLetter {
    std::array::from_fn(|axis| match position.filter(|p| p.knows(axis)) {
        Some(position) => position.at[axis],
        None if machine >> axis & 1 == 1 => unknown,
        None => 0.0,
    })
}

/// The file of parameters; `others`: the value of every parameter that a program may set and the setup does not give.
pub fn parameters(given: &Given<'_>, others: Option<f64>) -> String {
    let setup = given.setup;
    let mut all: BTreeMap<u32, f64> = BTreeMap::new();
    if let Some(value) = others {
        all.extend(MAKES_KNOWN.chain(5061..=5070).map(|number| (number, value)));
    }
    all.extend(&setup.parameters);
    let mut group = |first: u32, values: &PerLetter| {
        let values = values.iter().enumerate();
        all.extend(values.map(|(axis, value)| (first + axis as u32, in_inches(axis, *value))));
    };
    for ((home, unknown), first) in setup.homes.iter().zip(HOME).zip([5161, 5181]) {
        group(first, &filled(home.as_ref(), given.axes, unknown));
    }
    group(5211, &setup.g92);
    let mut rotations = Vec::new();
    for number in 1..=9_u16 {
        let system = setup.systems.get(&number);
        let origin = system.map_or_else(|| filled(None, given.axes, UNKNOWN), |s| s.origin);
        let first = 5201 + 20 * u32::from(number);
        group(first, &origin);
        rotations.push((first + 9, system.map_or(UNKNOWN_ROTATION, |s| s.rotation)));
    }
    all.extend(rotations);
    let shifted = setup.g92 != [0.0; COUNT];
    all.insert(5210, f64::from(u8::from(shifted)));
    all.insert(5220, f64::from(setup.selected.unwrap_or(1)));
    let mut text = String::new();
    for (number, value) in all {
        let _ = writeln!(text, "{number}\t{value}");
    }
    text
}

/// The tool table: the tools of the setup, and those that the program names. W is the number of the tool, so that its
/// offset says which tool it is of.
pub fn tools(given: &Given<'_>, named: &BTreeSet<u32>) -> String {
    let setup = given.setup;
    let mut numbers = named.clone();
    numbers.extend(setup.tools.keys());
    numbers.extend(setup.tool);
    numbers.remove(&0);
    let mut text = String::new();
    for (pocket, number) in numbers.into_iter().enumerate() {
        let unknown = [0.0, 0.0, UNKNOWN, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let offset = setup.tools.get(&number).unwrap_or(&unknown);
        let _ = write!(text, "T{number} P{}", pocket + 1);
        for (axis, value) in offset.iter().enumerate().take(6) {
            let value = in_inches(axis, *value);
            let _ = write!(text, " {}{value}", axes::name(axis));
        }
        let diameter = setup.diameters.get(&number).unwrap_or(&0.0);
        let _ = writeln!(text, " W{number} D{diameter}");
    }
    text
}

/// What holds before the first line of the program, as lines.
pub fn prelude(given: &Given<'_>) -> String {
    let setup = given.setup;
    let units = setup.units.unwrap_or(Units::Millimetre);
    let mut text = match units {
        Units::Millimetre => "G21\n".to_owned(),
        Units::Inch => "G20\n".to_owned(),
    };
    if let Some(tool) = setup.tool.filter(|tool| *tool > 0) {
        let _ = writeln!(text, "T{tool} M6");
    }
    text += "G53 G0";
    let start = filled(Some(&setup.start), given.axes, START);
    for axis in bits(0b11_1111) {
        let unit = if axes::is_rotary(axis) {
            1.0
        } else {
            units.mm()
        };
        let _ = write!(text, " {}{}", axes::name(axis), start[axis] / unit);
    }
    text += "\nG80\n";
    text += match setup.plane {
        Some(Plane::Zx) => "G18\n",
        Some(Plane::Yz) => "G19\n",
        Some(Plane::Xy) | None => "G17\n",
    };
    text += match setup.distance {
        Some(Distance::Incremental) => "G91\n",
        Some(Distance::Absolute) | None => "G90\n",
    };
    text += match setup.feed_mode {
        Some(FeedMode::InverseTime) => "G93\n",
        Some(FeedMode::PerRevolution) => "G95\n",
        Some(FeedMode::PerMinute) | None => "G94\n",
    };
    if let Some(crate::gcode::modal::Retract::Plane) = setup.retract {
        text += "G99\n";
    }
    let _ = writeln!(text, "({BEGIN})");
    text
}

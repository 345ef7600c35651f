//! Direct measurements as CSV: lines that begin with `#` describe the setup in TOML, followed by a header and the
//! readings, a line for each target and a column for each run.
//!
//! ```csv
//! # axis = "X"                     the command that moved
//! # reads = "tool +X"              what the instrument counts as positive
//! # unit = "um"
//! # at = { Y = 150.0, Z = -40.0 }  where the other axes stood
//! target,+1,-1,+2,-2
//! 0,0.1,-1.2,0.0,-1.3
//! 100,2.2,1.0,2.1,1.1
//! ```

mod heading;
mod table;

use crate::{AxisRuns, MeasuredRuns, MeasurementSetup, Square};
use heading::RunHeading;
use std::fmt::Write;
use trueaxis_model::explain::Sense;
use trueaxis_model::machine::Machine;
use trueaxis_model::source::FileError;

/// Reads one file.
///
/// # Errors
/// [`FileError`] with line, cause and remedy: a heading that is incomplete or belongs to another machine, unknown
/// axes, an invalid direction; whatever [`CsvTable`](trueaxis_model::formats::csv::CsvTable) refuses, a column without
/// direction, targets that do not increase or are outside the travel.
pub fn read(text: &str, machine: &Machine) -> Result<MeasuredRuns, FileError> {
    opened(text, machine, true)
}

/// Like `read`, for an evaluation of the readings by themselves: the file need not say where the other axes stood, which are
/// then at their positions nearest to zero.
///
/// # Errors
/// As for [`read`].
pub fn read_anywhere(text: &str, machine: &Machine) -> Result<MeasuredRuns, FileError> {
    opened(text, machine, false)
}

fn opened(text: &str, machine: &Machine, needs_place: bool) -> Result<MeasuredRuns, FileError> {
    let (heading, start) = RunHeading::read(text, machine, needs_place)?;
    let lines = table::read(text, start, machine, &heading.setups, heading.readings)?;
    match (<[AxisRuns; 2]>::try_from(lines), heading.square) {
        (Ok(lines), Some(over)) => Ok(MeasuredRuns::Square(Square { lines, over })),
        (Err(mut line), None) if line.len() == 1 => Ok(MeasuredRuns::Line(line.remove(0))),
        _ => Err(heading::missing("axis")),
    }
}

/// Writes a measurement: readings in µm or µrad with four decimals.
#[must_use]
pub fn write(measured: &MeasuredRuns, machine: &Machine) -> String {
    let name = toml::Value::from(machine.name.as_str());
    let letter = |line: &AxisRuns| machine.axes[line.setup.moved].letter;
    match measured {
        MeasuredRuns::Line(line) => {
            let (letter, reads) = (letter(line), line.setup.words(machine));
            let mut text =
                format!("# machine = {name}\n# axis = \"{letter}\"\n# reads = \"{reads}\"\n");
            text += &common(&line.setup, machine, &[line.setup.moved]);
            if line.setup.keeps_slope {
                text += "# slope = \"keep\"\n";
            }
            let _ = writeln!(text, "target,{}", directions(line));
            rows(&mut text, "", line);
            text
        }
        MeasuredRuns::Square(square) => {
            let [a, b] = &square.lines;
            let [of_a, of_b] =
                [a, b].map(|line| format!("{} = \"{}\"", letter(line), line.setup.words(machine)));
            let mut text = format!("# machine = {name}\n# reads_along = {{ {of_a}, {of_b} }}\n");
            text += &common(&a.setup, machine, &[]);
            if square.over != 0.0 {
                let _ = writeln!(text, "# square_urad = {:?}", square.over * 1e6);
            }
            let _ = writeln!(text, "line,target,{}", directions(a));
            for line in [a, b] {
                rows(&mut text, &format!("{},", letter(line)), line);
            }
            text
        }
    }
}

/// Unit, position and measured point.
fn common(setup: &MeasurementSetup, machine: &Machine, without: &[usize]) -> String {
    let unit = if setup.is_angular() { "urad" } else { "um" };
    let mut text = format!("# unit = \"{unit}\"\n");
    let at = machine.to_command(&setup.at);
    let others = (0..machine.axes.len()).filter(|i| !without.contains(i));
    // Degrees without rounding errors from radians.
    let place = |i: usize| (at[i] * 1e9).round() / 1e9 + 0.0;
    let others = others.map(|i| format!("{} = {:?}", machine.axes[i].letter, place(i)));
    let others: Vec<String> = others.collect();
    let _ = writeln!(text, "# at = {{ {} }}", others.join(", "));
    if setup.offset.norm() > 0.0 {
        let [x, y, z]: [f64; 3] = setup.offset.into();
        let _ = writeln!(text, "# offset_mm = [{x:?}, {y:?}, {z:?}]");
    }
    text
}

fn directions(line: &AxisRuns) -> String {
    let mut counts = [0, 0];
    let names = line.columns.iter().map(|column| {
        let (count, sign) = match column.direction > 0.0 {
            true => (&mut counts[0], '+'),
            false => (&mut counts[1], '-'),
        };
        *count += 1;
        format!("{sign}{count}")
    });
    names.collect::<Vec<_>>().join(",")
}

fn rows(text: &mut String, first: &str, line: &AxisRuns) {
    let factor = if line.setup.is_angular() { 1e6 } else { 1e3 };
    for (k, target) in line.targets.iter().enumerate() {
        let _ = write!(text, "{first}{target}");
        for column in &line.columns {
            let reading = column.readings[k] * factor * line.setup.counts;
            // Avoids "-0.0000".
            let reading = (reading * 1e4).round() / 1e4 + 0.0;
            let _ = write!(text, ",{reading:.4}");
        }
        text.push('\n');
    }
}

/// Parses the direction of a reading: `tool +X`, `workpiece -C`, `tool +Y to +Z`. Returns the sense and +1 or −1.
///
/// # Errors
/// A description of what is wrong.
pub fn sense(words: &str, machine: &Machine) -> Result<(Sense, f64), String> {
    let parts: Vec<&str> = words.split_whitespace().collect();
    let who = match parts.first() {
        Some(&"tool") => 1.0,
        Some(&"workpiece") => -1.0,
        _ => return Err(format!("`{words}` does not begin with tool or workpiece")),
    };
    let axis = |part: &str| signed_axis(part, machine);
    let is_rotary = |i: usize| machine.axes[i].letter.is_rotary();
    match parts[1..] {
        [one] => {
            let (i, sign) = axis(one)?;
            let sense = match is_rotary(i) {
                true => Sense::About(i),
                false => Sense::In(i),
            };
            Ok((sense, who * sign))
        }
        [a, "to", b] => {
            let ((a, sign_a), (b, sign_b)) = (axis(a)?, axis(b)?);
            if a == b || is_rotary(a) || is_rotary(b) {
                return Err(format!(
                    "`{words}` does not turn from one linear axis towards another"
                ));
            }
            Ok((Sense::From(a, b), who * sign_a * sign_b))
        }
        _ => Err(format!("`{words}` names no direction")),
    }
}

/// An axis with a sign, as in `+X`.
fn signed_axis(part: &str, machine: &Machine) -> Result<(usize, f64), String> {
    let sign = match part.as_bytes().first() {
        Some(b'+') => 1.0,
        Some(b'-') => -1.0,
        _ => return Err(format!("`{part}` has no sign")),
    };
    let mut letters = part[1..].chars();
    let index = letters.next().and_then(|letter| machine.index(letter));
    match (index, letters.next()) {
        (Some(index), None) => Ok((index, sign)),
        _ => Err(format!("the machine has no axis `{}`", &part[1..])),
    }
}

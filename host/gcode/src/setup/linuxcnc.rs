//! Offsets and tools as LinuxCNC stores them.

use super::Setup;
use crate::axes::{self, COUNT, PerLetter, Position};
use crate::modal::Units;
use crate::offsets::System;
use std::collections::BTreeMap;
use std::ops::{Range, RangeInclusive};
use trueaxis_model::source::FileError;

/// Order of the axes in parameters: X Y Z A B C U V W, as everywhere here.
type Parameters = BTreeMap<u32, (f64, Range<usize>)>;

/// Parameters that are positions and offsets; the others are a program's own.
const COORDINATES: RangeInclusive<u32> = 5161..=5390;

impl Setup {
    /// Adds what a file of parameters (`.var`) says, whose lengths are in the units of the machine.
    ///
    /// # Errors
    /// A line that is not a number and a value.
    pub fn add_var(&mut self, text: &str, units: Units) -> Result<(), FileError> {
        let parameters = read_parameters(text)?;
        let stored = parameters.range(1..=5000);
        self.parameters
            .extend(stored.map(|(number, (value, _))| (*number, *value)));
        let number = |place: u32| parameters.get(&place).map(|(value, _)| *value);
        let group = |first: u32| group(&parameters, first, units);
        for (place, first) in [5161, 5181].into_iter().enumerate() {
            if let Some(at) = group(first) {
                let known = (1 << COUNT) - 1;
                self.homes[place] = Some(Position { at, known });
            }
        }
        self.g92_stored = group(5211);
        if let (Some(on), Some(g92)) = (number(5210), self.g92_stored)
            && on != 0.0
        {
            self.g92 = g92;
        }
        for system in 1..=9 {
            if let Some(origin) = group(5201 + 20 * system) {
                let rotation = number(5210 + 20 * system).unwrap_or(0.0);
                self.systems
                    .insert(system as u16, System { origin, rotation });
            }
        }
        if let Some((selected, span)) = parameters.get(&5220) {
            let number = (1..=9).find(|n| f64::from(*n) == *selected);
            self.selected = Some(number.ok_or_else(|| {
                FileError::at(
                    span.clone(),
                    "parameter 5220, the active coordinate system, is none of 1 to 9",
                    "here",
                    "give the file as LinuxCNC has written it",
                )
            })?);
        }
        Ok(())
    }

    /// Adds the tools of a tool table (`.tbl`), whose lengths are in the units of the machine. Returns the numbers, from
    /// 1, of lines that do not begin as a tool does, which LinuxCNC skips: headings.
    ///
    /// # Errors
    /// A tool without a number, or with a word without a number.
    pub fn add_tools(&mut self, text: &str, units: Units) -> Result<Vec<usize>, FileError> {
        let (mut start, mut skipped) = (0, Vec::new());
        for (place, line) in text.split_inclusive('\n').enumerate() {
            let span = start..start + line.trim_end().len();
            start += line.len();
            let words = line.split_once(';').map_or(line, |(words, _)| words);
            if words.trim().is_empty() {
                continue;
            }
            let first = words.split_whitespace().next().unwrap_or_default();
            let number = first.get(1..).and_then(|value| value.parse::<f64>().ok());
            if number.is_none() || !first.as_bytes()[0].is_ascii_alphabetic() {
                skipped.push(place + 1);
                continue;
            }
            let bad = |cause: String| {
                FileError::at(
                    span.clone(),
                    cause,
                    "here",
                    "give the TOOL_TABLE of LinuxCNC: T1 P1 Z51.2 D6 in each line",
                )
            };
            let (number, offset, diameter) = read_tool(words, units).map_err(bad)?;
            self.tools.insert(number, offset);
            self.diameters.insert(number, diameter);
        }
        Ok(skipped)
    }
}

/// The parameters of a file, with the bytes of their lines.
fn read_parameters(text: &str) -> Result<Parameters, FileError> {
    let mut parameters = Parameters::new();
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        let span = start..start + line.trim_end().len();
        start += line.len();
        let mut cells = line.split_whitespace();
        let Some(number) = cells.next().filter(|c| !c.starts_with(['#', ';'])) else {
            continue;
        };
        let value = cells.next().and_then(|value| value.parse::<f64>().ok());
        let value = value.filter(|value| value.is_finite());
        let Some((number, value)) = number.parse::<u32>().ok().zip(value) else {
            return Err(FileError::at(
                span,
                "no parameter and its value",
                "here",
                "give the PARAMETER_FILE of LinuxCNC: a number and a value in each line",
            ));
        };
        if COORDINATES.contains(&number) && !axes::can_be(value) {
            return Err(FileError::at(
                span,
                format!("a coordinate beyond {:.0e}", axes::LARGEST),
                "here",
                "give the file as LinuxCNC has written it",
            ));
        }
        parameters.insert(number, (value, span));
    }
    Ok(parameters)
}

/// The coordinates that begin at a parameter, if it is there.
fn group(parameters: &Parameters, first: u32, units: Units) -> Option<PerLetter> {
    let value = |axis: usize| Some(parameters.get(&(first + axis as u32))?.0);
    value(0)?;
    // As LinuxCNC itself: what the file leaves out is 0.
    let in_mm = |axis| super::in_mm(axis, value(axis).unwrap_or(0.0), units);
    Some(std::array::from_fn(in_mm))
}

/// The number of a tool, its offsets, and its diameter in the units of the table.
fn read_tool(words: &str, units: Units) -> Result<(u32, PerLetter, f64), String> {
    let (mut number, mut offset, mut diameter) = (None, [0.0; COUNT], 0.0);
    for word in words.split_whitespace() {
        let letter = word.as_bytes()[0].to_ascii_uppercase();
        let value = word.get(1..).and_then(|v| v.parse::<f64>().ok());
        let value = value.filter(|v| v.is_finite());
        let value = value.ok_or("a word without a number")?;
        match letter {
            b'T' if value >= 0.0 && value.fract() == 0.0 && value < 1e6 => {
                number = Some(value as u32);
            }
            b'T' => return Err("a tool number that is negative or not whole".to_owned()),
            b'D' => diameter = value,
            b'P' | b'I' | b'J' | b'Q' => {}
            _ if !axes::can_be(value) => {
                return Err(format!("a number beyond {:.0e}", axes::LARGEST));
            }
            letter => {
                let axis = axes::index(letter);
                let axis = axis.ok_or("a letter that tool tables do not have")?;
                offset[axis] = super::in_mm(axis, value, units);
            }
        }
    }
    let number = number.ok_or("a tool without a number")?;
    Ok((number, offset, diameter))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_and_tools_of_linuxcnc_are_read() {
        let mut setup = Setup::default();
        let var = "5161\t1\n5162 2\n5210 1\n5211 0.5\n5220 2.0\n5241 -10\n5243\t-3.25\n5250 15\n";
        setup.add_var(var, Units::Inch).unwrap();
        assert_eq!(setup.homes[0].unwrap().at[..2], [25.4, 50.8]);
        assert_eq!(setup.g92[0], 12.7);
        assert_eq!(setup.selected, Some(2));
        assert_eq!(setup.systems[&2].origin[2], -82.55);
        assert_eq!(setup.systems[&2].rotation, 15.0);
        assert!(!setup.systems.contains_key(&1));
        let table =
            "Tools of the mill\n-----\nT1 P1 Z0.511 D0.125 ;1/8 end mill\n\n;\nT99999 P3 X1 Z+2\n";
        assert_eq!(setup.add_tools(table, Units::Inch).unwrap(), [1, 2]);
        assert_eq!(setup.tools[&1][2], 0.511 * 25.4);
        assert_eq!(setup.tools[&99999][0], 25.4);
        assert_eq!(setup.diameters[&1], 0.125);
        assert!(setup.add_var("5161 a\n", Units::Inch).is_err());
        assert!(setup.add_tools("P1 Z2\n", Units::Inch).is_err());
        // What a program keeps in other parameters may be as large as it likes.
        assert!(setup.add_var("5000 1e40\n", Units::Inch).is_ok());
        assert_eq!(setup.parameters[&5000], 1e40);
        assert!(setup.add_var("5226 1e40\n", Units::Inch).is_err());
        assert!(setup.add_tools("T1 Z1e40\n", Units::Inch).is_err());
        assert!(setup.add_tools("T1 Zlong\n", Units::Inch).is_err());
    }
}

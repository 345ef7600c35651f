//! Offsets and tools as LinuxCNC stores them.

use super::Setup;
use crate::axes::{self, COUNT, PerLetter, Position};
use crate::modal::Units;
use crate::offsets::System;
use std::collections::BTreeMap;
use std::ops::{Range, RangeInclusive};
use trueaxis_model::source::{FileError, leading_number};

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

    /// Adds the tools of a tool table (`.tbl`), whose lengths are in the units of the machine, as LinuxCNC reads them. Returns
    /// the numbers, from 1, of lines of which LinuxCNC does not take all, with what it does.
    pub fn add_tools(&mut self, text: &str, units: Units) -> Vec<(usize, String)> {
        let mut lines: BTreeMap<u32, usize> = BTreeMap::new();
        let mut remarks = Vec::new();
        for (line, text) in (1..).zip(text.split_inclusive('\n')) {
            let words = text.split(';').next().unwrap_or_default();
            if words.trim().is_empty() {
                continue;
            }
            let mut remark = |remark| remarks.push((line, remark));
            let tool = match read_tool(words, units, &mut remark) {
                Ok(tool) => tool,
                Err(cause) => {
                    remark(format!("left out: {cause}"));
                    continue;
                }
            };
            if let Some(first) = lines.get(&tool.number) {
                remark(format!(
                    "left out: LinuxCNC uses the first tool {}, in line {first}",
                    tool.number
                ));
                continue;
            }
            lines.insert(tool.number, line);
            self.tools.insert(tool.number, tool.offset);
            self.diameters.insert(tool.number, tool.diameter);
        }
        remarks
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

/// A line of a tool table.
struct Tool {
    number: u32,
    offset: PerLetter,
    /// In the units of the table.
    diameter: f64,
}

/// Reads a line up to its comment as `tooldata_read_entry` of LinuxCNC does: words end at blanks, not at tabs; each is a
/// letter and what `sscanf` reads after it, and the rest of the word is ignored, which is remarked.
///
/// # Errors
/// Why there is no such tool.
fn read_tool(words: &str, units: Units, remark: &mut dyn FnMut(String)) -> Result<Tool, String> {
    let (mut number, mut has_pocket, mut diameter) = (None, false, 0.0);
    let mut offset = [0.0; COUNT];
    for word in words.split(' ').filter(|w| !w.is_empty() && *w != "\n") {
        let letter = word.as_bytes()[0].to_ascii_uppercase();
        let axis = axes::index(letter);
        let value = match letter {
            b'T' | b'P' | b'Q' => leading_integer(&word[1..]),
            b'D' | b'I' | b'J' => leading_number(&word[1..]),
            _ => axis.and_then(|_| leading_number(&word[1..])),
        };
        let Some((value, rest)) = value else {
            return Err(format!(
                "LinuxCNC skips the line, because `{}` is not a letter of a tool and its number; comments go after `;`",
                word.escape_debug()
            ));
        };
        if !rest.trim().is_empty() {
            remark(format!(
                "LinuxCNC ignores `{}` in `{}`: words end at blanks",
                rest.trim_end().escape_debug(),
                word.trim_end().escape_debug()
            ));
        }
        match (letter, axis) {
            (b'T', _) => number = Some(value),
            (b'P', _) => has_pocket = true,
            (b'D', _) => diameter = value,
            (_, Some(_)) if !axes::can_be(value) => {
                return Err(format!("a number beyond {:.0e}", axes::LARGEST));
            }
            (_, Some(axis)) => offset[axis] = super::in_mm(axis, value, units),
            _ => {}
        }
    }
    let number = number.filter(|number| (0.0..1e6).contains(number));
    let number = number.ok_or("no T with the number of a tool")? as u32;
    if !has_pocket {
        return Err(format!(
            "tool {number} has no P, and LinuxCNC forgets it when another tool comes into the spindle"
        ));
    }
    Ok(Tool {
        number,
        offset,
        diameter,
    })
}

/// The whole number at the start of a text, as `%d` of `sscanf` reads it, and the text after it.
fn leading_integer(text: &str) -> Option<(f64, &str)> {
    let text = text.trim_start();
    let end = text.find(|c: char| !c.is_ascii_digit() && c != '+' && c != '-');
    let end = end.unwrap_or(text.len());
    let (value, rest) = leading_number(&text[..end])?;
    Some((value, &text[end - rest.len()..]))
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
        let table = "T1 P1 Z0.511 D0.125 ;1/8 end mill\n\n;\nT99999 P3 X1 Z+2\n";
        assert_eq!(setup.add_tools(table, Units::Inch), []);
        assert_eq!(setup.tools[&1][2], 0.511 * 25.4);
        assert_eq!(setup.tools[&99999][0], 25.4);
        assert_eq!(setup.diameters[&1], 0.125);
        assert!(setup.add_var("5161 a\n", Units::Inch).is_err());
        // What a program keeps in other parameters may be as large as it likes.
        assert!(setup.add_var("5000 1e40\n", Units::Inch).is_ok());
        assert_eq!(setup.parameters[&5000], 1e40);
        assert!(setup.add_var("5226 1e40\n", Units::Inch).is_err());
    }
    /// Offsets that G43 gets from the tables under `rs274 -t` of LinuxCNC 2.9, in the units of the table; `None` where it says
    /// "Requested tool not found in the tool table".
    #[test]
    fn tools_are_those_that_linuxcnc_reads() {
        for (table, tool, offset, said) in [
            (
                "T15 P15 Z21\nT15 P16 Z22\n",
                15,
                Some(21.0),
                "first tool 15, in line 1",
            ),
            ("T4, P4, Z40\n", 4, Some(40.0), "ignores `,` in `T4,`"),
            ("T9 P9 Z15mm\n", 9, Some(15.0), "ignores `mm` in `Z15mm`"),
            ("T3.7 P3.7 Z1,5\n", 3, Some(1.0), "ignores `,5` in `Z1,5`"),
            ("T3 P3 Z1e\n", 3, Some(1.0), "ignores `e` in `Z1e`"),
            ("t3 p3 z4 z5\r\n", 3, Some(5.0), ""),
            ("P3 T3 Z5 \n", 3, Some(5.0), ""),
            ("T3 P-1 Z4 ;t\n", 3, Some(4.0), ""),
            ("T1.5 P1 Z4\n", 1, Some(4.0), "ignores `.5` in `T1.5`"),
            ("T2 P2 Z 30 D6\n", 2, None, "skips the line, because `Z`"),
            (
                "T5 P5 Z25.5 D3 roughing tool\n",
                5,
                None,
                "because `roughing`",
            ),
            ("T11 P11 Z17 #18 mill\n", 11, None, "because `#18`"),
            ("T12 P12 Z18 D=6\n", 12, None, "because `D=6"),
            ("T3 P3 Z3 \r\n", 3, None, "because `\\r\\n`"),
            ("T3 P3 Z4 \t\n", 3, None, "because `\\t\\n`"),
            ("T3 P3 Z5 E3\n", 3, None, "because `E3"),
            ("T\u{e4} P3 Z5\n", 3, None, "because `T\u{e4}`"),
            ("T-3 P1 Z4\n", 3, None, "no T with the number"),
            ("T99999999999 P1 Z4\n", 3, None, "no T with the number"),
            ("T3 Z3\nT4 Z4\n", 3, None, "tool 3 has no P"),
        ] {
            let mut setup = Setup::default();
            let remarks = setup.add_tools(table, Units::Millimetre);
            let found = setup.tools.get(&tool).map(|offset| offset[2]);
            assert_eq!(found, offset, "{table:?}: {remarks:?}");
            let is_said = |(_, remark): &(usize, String)| remark.contains(said);
            assert!(
                remarks.iter().any(is_said) || said.is_empty(),
                "{remarks:?}"
            );
            assert_eq!(remarks.is_empty(), said.is_empty(), "{remarks:?}");
        }
        // Words do not end at tabs: these get the offset 0, until another tool takes pocket 0. They are left out.
        for table in ["T8\tP8\tZ14\tD6\n", "T8P8Z14\n"] {
            let mut setup = Setup::default();
            let remarks = setup.add_tools(table, Units::Millimetre);
            let [(1, ignored), (1, left_out)] = &remarks[..] else {
                panic!("{remarks:?}");
            };
            assert!(
                ignored.contains("in `T8") && ignored.contains("P8"),
                "{ignored}"
            );
            assert!(left_out.contains("tool 8 has no P"), "{left_out}");
            assert!(setup.tools.is_empty());
        }
        let mut setup = Setup::default();
        let lines = [
            "Tools of the mill",
            "-----",
            "T1 P1 Z1e40",
            "P1 Z2",
            "T2 P2 Z2",
        ];
        let remarks = setup.add_tools(&lines.join("\n"), Units::Millimetre);
        let left_out: Vec<usize> = remarks.iter().map(|(line, _)| *line).collect();
        assert_eq!((left_out, setup.tools.len()), (vec![1, 2, 3, 4], 1));
    }
}

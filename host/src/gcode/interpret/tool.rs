//! Tools: changes, offsets, and words of lengths.

use super::{Asked, Step, bits, whole};
use crate::gcode::axes::{self, COUNT};
use crate::gcode::codes::Length;
use crate::gcode::dialect::Dialect;
use crate::gcode::fault::Fault;
use crate::gcode::modal::Units;
use crate::gcode::state::{Rules, State};
use crate::gcode::words::Word;

impl State {
    /// M6: where it goes, and the tool in the spindle.
    pub(super) fn change_tool(&mut self, rules: &Rules, step: &mut Step) {
        self.tool = self.next_tool.or(self.tool);
        self.length = None;
        match rules.setup.tool_change {
            Some(to) => {
                for axis in bits(to.known & rules.axes) {
                    self.position.set(axis, to.at[axis]);
                }
                step.passed = Some("tool changes that move");
            }
            // The change of Fanuc controllers is a program of the maker, which moves the axes.
            None if rules.dialect == Dialect::Fanuc => {
                bits(rules.axes).for_each(|axis| self.position.forget(axis));
                step.passed = Some("tool changes that move");
            }
            None => {}
        }
    }

    /// G43, G43.1, G49 and what they do to the offsets.
    pub(super) fn tool_length_word(
        &mut self,
        asked: &Asked<'_>,
        word: &Word,
        length: Length,
    ) -> Result<(), Fault> {
        match length {
            Length::Off => {
                self.offsets.tool = [0.0; COUNT];
            }
            Length::OfWords => {
                for axis in 0..COUNT {
                    if asked.word(axes::LETTERS[axis]).is_some() {
                        self.offsets.tool[axis] = self.value(asked, axis)?;
                        if axis == 2 {
                            self.length = Some(self.offsets.tool[2]);
                        }
                    }
                }
            }
            Length::OfTool => {
                let number = match asked.word(b'H') {
                    Some(word) => Some(whole(word)?),
                    None if asked.rules.dialect == Dialect::LinuxCnc => self.tool,
                    None => None,
                };
                let Some(number) = number else {
                    return Err(Fault::new(
                        word.span(),
                        "G43 without H: which tool it means is not known",
                        "write H, or give the setup the tool in the spindle: [start] tool = …",
                    ));
                };
                let Some(offset) = asked.rules.setup.tools.get(&number) else {
                    return Err(Fault::new(
                        word.span(),
                        format!("the length of tool {number} is not known"),
                        format!("give it in the setup: [tool.{number}] length = …"),
                    ));
                };
                self.offsets.tool = *offset;
                self.length = Some(offset[2]);
            }
        }
        Ok(())
    }

    /// The value of an axis' word: mm, degrees.
    pub(super) fn value(&self, asked: &Asked<'_>, axis: usize) -> Result<f64, Fault> {
        let Some(word) = asked.word(axes::LETTERS[axis]) else {
            return Ok(0.0);
        };
        if axes::is_rotary(axis) {
            let counts = asked.rules.least_increments && !word.point;
            return Ok(if counts {
                word.value * 1e-3
            } else {
                word.value
            });
        }
        self.length_of(asked, word)
    }

    /// A word that is a length, in mm.
    pub(super) fn length_of(&self, asked: &Asked<'_>, word: &Word) -> Result<f64, Fault> {
        let Some(units) = self.units else {
            return Err(Fault::new(
                word.span(),
                "mm or inches: that is not known here",
                "write G20 or G21 before it, or give the setup with its units",
            ));
        };
        let counts = asked.rules.least_increments && !word.point;
        let least = match (counts, units) {
            (false, _) => 1.0,
            (true, Units::Millimetre) => 1e-3,
            (true, Units::Inch) => 1e-4,
        };
        Ok(word.value * least * units.mm())
    }
}

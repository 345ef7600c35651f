//! Tools: changes, offsets, and words of lengths.

use super::{Asked, Step, bits, unknown, whole};
use crate::axes::{self, COUNT, PerLetter};
use crate::codes::Length;
use crate::fault::Fault;
use crate::modal::Units;
use crate::state::{Lost, Rules, State, length_of_tool};
use crate::words::Word;

impl State {
    /// M6: where it goes, and the tool in the spindle.
    pub(super) fn change_tool(
        &mut self,
        asked: &Asked<'_>,
        word: &Word,
        step: &mut Step,
    ) -> Result<(), Fault> {
        let rules = asked.rules;
        // Without any T before, which tool it takes is not known.
        self.tool = self.next_tool;
        self.length = None;
        // By hand, or a program of the maker: who knows where it stands then.
        self.commanded = 0;
        self.doubt_offset(asked.rules.axes);
        if rules.dialect.table().has_names && asked.word(b'D').is_none() {
            // D1 holds after a change.
            self.offset_of_spindle(word, rules)?;
        }
        match rules.setup.tool_change {
            Some(to) => {
                bits(to.known & rules.axes).for_each(|axis| self.position.set(axis, to.at[axis]))
            }
            // The change of Fanuc controllers is a program of the maker, which moves the axes.
            None if rules.dialect.table().tool_change_moves => {
                bits(rules.axes).for_each(|axis| self.lose(axis, Lost::ToolChange));
            }
            None => return Ok(()),
        }
        step.passed = Some("tool changes that move");
        self.not_with_tip(word)?;
        if asked.axes != 0 {
            return Err(word.fault(
                "a tool change that moves the axes, in a line with words of axes",
                "write two lines",
            ));
        }
        Ok(())
    }

    /// G43, G43.1, G49 and what they do to the offsets.
    pub(super) fn tool_length_word(
        &mut self,
        asked: &Asked<'_>,
        word: &Word,
        length: Length,
    ) -> Result<(), Fault> {
        match length {
            // The end of tool-centre-point control too: words are axis positions from here on.
            Length::Off if asked.rules.dialect.table().doubts_tool_offset => {
                self.offsets.tool = [0.0; COUNT];
                self.offset_in_doubt = false;
            }
            Length::Off => self.set_tool_offset(word, [0.0; COUNT], self.length)?,
            Length::OfWords => {
                let (mut offset, mut length) = (self.offsets.tool, self.length);
                for axis in bits(asked.axes) {
                    offset[axis] = self.value(asked, axis)?;
                    if axis == 2 {
                        length = Some(offset[2]).filter(|l| *l > 0.0);
                    }
                }
                self.set_tool_offset(word, offset, length)?;
            }
            Length::OfTool => self.length_by_number(asked, word)?,
        }
        Ok(())
    }

    /// G43 with the number of a tool, H.
    fn length_by_number(&mut self, asked: &Asked<'_>, word: &Word) -> Result<(), Fault> {
        let number = match asked.word(b'H') {
            Some(word) => Some(whole(word)?),
            None if asked.rules.dialect.table().g43_takes_spindle => self.tool,
            None => None,
        };
        let Some(number) = number else {
            return Err(word.fault(
                "G43 without H: its tool is unknown",
                "write H, or give the setup the tool in the spindle: [start] tool = …",
            ));
        };
        // Fanuc's H0 is not an offset; LinuxCNC's the tool in the spindle, or none.
        match (number, asked.rules.dialect.table().h0_is_none) {
            (0, true) => {
                return self.set_tool_offset(word, [0.0; COUNT], self.length);
            }
            (0, _) => {
                return Err(word.fault(
                    "H0: that is the tool in the spindle, or none, as the tool changer is",
                    "write the number of the tool, or G49",
                ));
            }
            _ => {}
        }
        let Some(offset) = self.tool_offset(number, asked.rules) else {
            return Err(word.fault(
                format!("the length of tool {number} is unknown"),
                format!("give it in the setup: [tool.{number}] length = …"),
            ));
        };
        let length = length_of_tool(&asked.rules.setup, number, &offset);
        self.set_tool_offset(word, offset, length)
    }

    /// D of a Sinumerik: the offset of the tool in the spindle, or none.
    pub(super) fn cutting_edge(&mut self, word: &Word, rules: &Rules) -> Result<(), Fault> {
        match whole(word)? {
            0 => self.set_tool_offset(word, [0.0; COUNT], None),
            1 => self.offset_of_spindle(word, rules),
            _ => Err(unknown(
                word,
                "a further cutting edge of a tool: D2 and those after it are not followed",
                "post the part with a tool of its own for each edge, and D1",
            )),
        }
    }

    /// The offset of the tool in the spindle holds.
    fn offset_of_spindle(&mut self, word: &Word, rules: &Rules) -> Result<(), Fault> {
        let Some(tool) = self.tool else {
            return Err(word.fault(
                "the tool in the spindle is unknown",
                "write T and M6 before it, or give the setup [start] tool = …",
            ));
        };
        let Some(offset) = self.tool_offset(tool, rules) else {
            return Err(word.fault("the length of the tool in the spindle is unknown",
                "give it in the setup, by its number or name: [tool.1] length = …, or [tool.\"MILL 10\"]",
            ));
        };
        let length = length_of_tool(&rules.setup, tool, &offset);
        self.set_tool_offset(word, offset, length)
    }

    /// Offsets of a tool, if they are known: those that the program has set, otherwise those of the setup.
    pub(super) fn tool_offset(&self, tool: u32, rules: &Rules) -> Option<PerLetter> {
        let set = self
            .tools
            .get(&tool)
            .or_else(|| rules.setup.tools.get(&tool));
        set.copied()
    }

    /// Under tool-centre-point control another offset would move the tip of a turned tool while no axis moves.
    fn set_tool_offset(
        &mut self,
        word: &Word,
        offset: PerLetter,
        length: Option<f64>,
    ) -> Result<(), Fault> {
        // Corrections alone turn an axis by a few hundredths of a degree.
        let turned = (3..6).any(|i| self.position.at[i].abs() > 0.1);
        if self.tip && turned && offset != self.offsets.tool {
            return Err(unknown(
                word,
                "another tool offset under tool-centre-point control, while rotary axes are not at 0",
                "write it before tool-centre-point control is switched on, or turn the axes to 0",
            ));
        }
        self.offsets.tool = offset;
        self.offset_in_doubt = false;
        self.length = length;
        Ok(())
    }

    /// The value of an axis' word: mm, degrees.
    pub(super) fn value(&self, asked: &Asked<'_>, axis: usize) -> Result<f64, Fault> {
        let Some(word) = asked.word(axes::LETTERS[axis]) else {
            return Ok(0.0);
        };
        if axes::is_rotary(axis) {
            return Ok(word.value * asked.rules.counts(word, true, Units::Millimetre));
        }
        self.length_of(asked, word)
    }

    /// A word that is a length, in mm.
    pub(super) fn length_of(&self, asked: &Asked<'_>, word: &Word) -> Result<f64, Fault> {
        let units = self.needs_units(word.span())?;
        Ok(word.value * asked.rules.counts(word, false, units) * units.mm())
    }
}

//! Feed, tools, and everything else that holds until another word of its group.

use super::asked::is_passed;
use super::{Asked, Step, unknown, whole};
use crate::gcode::codes::{self, Code, Length, Machine};
use crate::gcode::dialect::Dialect;
use crate::gcode::fault::{FLAT, Fault, Kind};
use crate::gcode::modal::FeedMode;
use crate::gcode::state::{Rules, State};
use crate::gcode::words::Word;

impl State {
    /// What stands before modes in the order of execution: F's mode, F, T, M.
    pub(super) fn feed_and_tool(
        &mut self,
        asked: &Asked<'_>,
        step: &mut Step,
    ) -> Result<(), Fault> {
        for word in asked.coded() {
            if let Some(Code::Feed(mode)) = asked.code(word)
                && mode != self.feed_mode
            {
                self.feed_mode = mode;
                self.feed = None;
            }
        }
        if self.feed_mode == FeedMode::InverseTime {
            // Every move needs its own.
            self.feed = None;
        }
        if let Some(word) = asked.word(b'F') {
            if word.value < 0.0 {
                return Err(Fault::new(
                    word.span(),
                    "a negative feed",
                    "write F with a positive number",
                ));
            }
            self.feed = Some(word.value);
        }
        if let Some(word) = asked.word(b'T') {
            self.next_tool = Some(whole(word)?);
        }
        let machine_words = asked.coded().iter().filter(|w| w.letter == b'M');
        for (place, word) in machine_words.enumerate() {
            let Some(machine) = codes::machine(word, asked.rules.dialect) else {
                if is_passed(word, asked.rules) {
                    continue;
                }
                return Err(unknown_m(word));
            };
            if place >= 4 {
                return Err(Fault::new(
                    word.span(),
                    "more than four M words in a line",
                    "write two lines",
                ));
            }
            self.machine_word(asked, word, machine, step)?;
        }
        Ok(())
    }

    fn machine_word(
        &mut self,
        asked: &Asked<'_>,
        word: &Word,
        machine: Machine,
        step: &mut Step,
    ) -> Result<(), Fault> {
        if let Some(spindle) = word.tenths().and_then(codes::spindle) {
            self.spindle = spindle;
        }
        match machine {
            Machine::Pause | Machine::End | Machine::After => step.after = true,
            Machine::Neutral => {}
            Machine::ToolChange => self.change_tool(asked, word, step)?,
            Machine::ToolNumber => {
                let Some(number) = asked.word(b'Q') else {
                    return Err(Fault::new(
                        word.span(),
                        "M61 without Q: which tool is in the spindle is not known",
                        "write Q with its number",
                    ));
                };
                self.tool = Some(whole(number)?);
                self.length = None;
            }
            Machine::Tip(on) => {
                if on {
                    needs_machine(word, asked.rules)?;
                }
                step.tip = (on != self.tip).then_some(on);
            }
        }
        Ok(())
    }

    /// Plane, units, cutter and tool offsets, systems, distances, retracting.
    pub(super) fn set_modes(&mut self, asked: &Asked<'_>, step: &mut Step) -> Result<(), Fault> {
        if let Some((units, word)) = asked.units
            && self.units != Some(units)
        {
            if self.units.is_some() && asked.word(b'F').is_some() {
                return Err(Fault::new(
                    word.span(),
                    "another unit and F in one line: controllers differ in the unit of that F",
                    "write the unit in a line before",
                ));
            }
            if self.units.is_some() && self.feed_mode != FeedMode::InverseTime {
                self.feed = None;
            }
            self.units = Some(units);
        }
        for word in asked.coded() {
            let Some(code) = asked.code(word) else {
                continue;
            };
            match code {
                Code::Plane(plane) => self.plane = Some(plane),
                Code::Cutter(on) => {
                    // Also to the other side, or by another radius.
                    self.cutter_changes |= on || self.cutter;
                    self.cutter = on;
                }
                Code::ToolLength(length) => self.tool_length_word(asked, word, length)?,
                Code::TipOn => {
                    needs_machine(word, asked.rules)?;
                    self.tool_length_word(asked, word, Length::OfTool)?;
                    step.tip = (!self.tip).then_some(true);
                }
                Code::System(100) => {
                    let p = asked.word(b'P').map(whole).transpose()?;
                    let p = p.filter(|p| (1..=300).contains(p)).ok_or_else(|| {
                        Fault::new(
                            word.span(),
                            "G54.1 without P1 to P300",
                            "write the P of the system",
                        )
                    })?;
                    self.offsets.select(100 + p as u16);
                }
                Code::System(number) => self.offsets.select(number),
                Code::Distance(distance) => self.distance = Some(distance),
                Code::ArcDistance(distance) => self.arc_distance = distance,
                Code::Retract(retract) => self.retract = Some(retract),
                _ => {}
            }
            if asked.rules.dialect == Dialect::Fanuc
                && code == Code::ToolLength(Length::Off)
                && self.tip
            {
                step.tip = Some(false);
            }
        }
        Ok(())
    }
}

fn unknown_m(word: &Word) -> Fault {
    let pass = format!(
        "pass it as it is with --pass M{}, if it moves nothing and changes no coordinates",
        word.value
    );
    match word.tenths() {
        Some(700 | 710 | 720 | 730) => unknown(
            word,
            "modes that are stored and brought back (M70 to M73) are not followed",
            "write the modes in the place of M72, and take M70 to M73 out",
        ),
        Some(970 | 980 | 990) => {
            Fault::new(word.span(), "a subprogram: the program computes", FLAT).kind(Kind::Flow)
        }
        _ => unknown(
            word,
            "no M word that is known: it may move the machine",
            &pass,
        ),
    }
}

/// Tool-centre-point control needs the machine.
fn needs_machine(word: &Word, rules: &Rules) -> Result<(), Fault> {
    match rules.has_machine {
        true => Ok(()),
        false => Err(unknown(
            word,
            "tool-centre-point control: words are workpiece coordinates from here on",
            "give the machine that turns them into axis positions: --machine machine.toml",
        )),
    }
}

//! Feed, tools, and everything else that holds until another word of its group.

use super::asked::is_passed;
use super::{Asked, Step, unknown, whole};
use crate::codes::{self, Code, Length, Machine};
use crate::dialect::FeedUnit;
use crate::fault::{FLAT, Fault, Kind};
use crate::modal::{Distance, FeedMode, Motion, Units};
use crate::offsets::Number;
use crate::state::{Lost, Rules, State};
use crate::words::Word;

/// Words M of spindle and coolant that a line has had.
#[derive(Default)]
struct SpindleAndCoolant {
    turns: bool,
    cools: bool,
    dries: bool,
}

impl SpindleAndCoolant {
    /// True if a word before it acts on the same thing: which of both acts last is the choice of the controller.
    fn is_second(&mut self, word: &Word) -> bool {
        match word.tenths() {
            // M5 and M9 may wait for the end of the motion.
            Some(30 | 40 | 50) => std::mem::replace(&mut self.turns, true),
            // Mist and flood may run together.
            Some(70 | 80) => {
                self.cools = true;
                self.dries
            }
            Some(90) => std::mem::replace(&mut self.dries, true) || self.cools,
            _ => false,
        }
    }
}

impl State {
    /// What stands before modes in the order of execution: F's mode, F, T, M.
    pub(super) fn feed_and_tool(
        &mut self,
        asked: &Asked<'_>,
        step: &mut Step,
    ) -> Result<(), Fault> {
        self.set_feed(asked)?;
        if let Some(word) = asked.word(b'T') {
            self.next_tool = Some(whole(word)?);
        }
        let machine_words = asked.coded().iter().filter(|w| w.letter == b'M');
        let mut switched = SpindleAndCoolant::default();
        for (place, word) in machine_words.enumerate() {
            if switched.is_second(word) {
                return Err(word.fault(
                    "a second word of spindle or coolant in the line",
                    "write two lines",
                ));
            }
            let Some(machine) = word.machine(asked.rules.dialect) else {
                if is_passed(word, asked.rules) {
                    continue;
                }
                return Err(unknown_m(word));
            };
            if place >= 4 {
                return Err(word.fault("more than four M words in a line", "write two lines"));
            }
            self.machine_word(asked, word, machine, step)?;
        }
        Ok(())
    }

    /// F and what it counts.
    fn set_feed(&mut self, asked: &Asked<'_>) -> Result<(), Fault> {
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
        self.feed_unit = 1.0;
        let named = asked.rules.dialect.table().has_names;
        // A Sinumerik's G4 waits for F or S.
        let waits = named && matches!(asked.once, Some((Code::Dwell, _)));
        if let Some(word) = asked.word(b'F').filter(|_| !waits) {
            if word.value < 0.0 {
                return Err(word.fault("a negative feed", "write F with a positive number"));
            }
            self.feed = Some(word.value);
            self.feed_has_point = word.point || word.value == 0.0;
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
            Machine::Extruder(distance) => self.extruder.set(distance),
            Machine::ToolChange => self.change_tool(asked, word, step)?,
            Machine::ToolNumber => {
                let Some(number) = asked.word(b'Q') else {
                    return Err(word.fault(
                        "M61 without Q: the tool in the spindle is unknown",
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
        if let Some((units, word)) = asked.units {
            self.set_units(asked, units, word)?;
        }
        if let Some(word) = asked.cancels {
            self.cancel_cycles(asked, word)?;
        }
        let table = asked.rules.dialect.table();
        // In doubt it may be cancelled already: then cancelling moves nothing.
        let tool_before = match self.offset_in_doubt {
            true => 0.0,
            false => self.offsets.tool[2],
        };
        if table.has_names
            && let Some(word) = asked.word(b'D')
        {
            self.cutting_edge(word, asked.rules)?;
        }
        for word in asked.coded() {
            match asked.code(word) {
                Some(Code::ToolLength(length)) => {
                    self.tool_length_word(asked, word, length)?;
                    self.may_move(asked, tool_before, step);
                    if table.doubts_tool_offset && length == Length::Off && self.tip {
                        step.tip = Some(false);
                    }
                }
                Some(Code::TipOn) => {
                    needs_machine(word, asked.rules)?;
                    self.tool_length_word(asked, word, Length::OfTool)?;
                    step.tip = (!self.tip).then_some(true);
                }
                Some(code) => self.set_mode(asked, word, code)?,
                None => {}
            }
        }
        Ok(())
    }

    /// Modes that depend on nothing but their word.
    fn set_mode(&mut self, asked: &Asked<'_>, word: &Word, code: Code) -> Result<(), Fault> {
        let has_further = asked.rules.dialect.table().further_systems;
        match code {
            Code::Plane(plane) => self.plane = Some(plane),
            Code::Cutter(on) => {
                // Also to the other side, or by another radius.
                self.cutter_changes |= on || self.cutter;
                self.cutter = on;
            }
            Code::System(100) => {
                self.offsets.select(further_system(asked, word)?);
            }
            // G54 P is G54.1 P.
            Code::System(1) if has_further && asked.word(b'P').is_some() => {
                self.offsets.select(further_system(asked, word)?);
            }
            Code::System(number) => self.offsets.select(number),
            Code::Distance(distance) => self.distance = Some(distance),
            Code::ArcDistance(distance) => self.arc_distance = distance,
            Code::Retract(retract) => self.retract = Some(retract),
            _ => {}
        }
        Ok(())
    }
}

impl State {
    /// Another unit, and what F counts in it.
    fn set_units(&mut self, asked: &Asked<'_>, units: Units, word: &Word) -> Result<(), Fault> {
        let rules = asked.rules;
        let table = rules.dialect.table();
        let of_lengths = matches!(word.tenths(), Some(700 | 710));
        if table.has_names && of_lengths && rules.setup.units.is_some_and(|own| own != units) {
            return Err(unknown(
                word,
                "G70 and G71 leave F in the unit of the machine, which is another one",
                "write G700 or G710",
            ));
        }
        let before = self.units.filter(|before| *before != units);
        let before = before.filter(|_| self.feed_mode != FeedMode::InverseTime);
        match (before, asked.word(b'F'), table.feed_unit) {
            (None, _, _) | (Some(_), Some(_), FeedUnit::After) => {}
            (Some(_), None, _) => self.feed = None,
            (Some(before), Some(f), FeedUnit::Before) => {
                self.feed_unit = before.mm() / units.mm();
                self.feed = Some(f.value * self.feed_unit);
            }
            (Some(_), Some(_), FeedUnit::Unknown) => {
                return Err(word.fault(
                    "another unit and F in one line: controllers differ in the unit of that F",
                    "write the unit in a line before",
                ));
            }
        }
        self.units = Some(units);
        Ok(())
    }

    /// G80 where cycles are a group of their own: what held before them holds again.
    fn cancel_cycles(&mut self, asked: &Asked<'_>, word: &Word) -> Result<(), Fault> {
        if let Some((Code::Motion(Motion::Cycle(_)), _)) = asked.motion {
            return Err(word.fault("G80 and a cycle in one line", "write two lines"));
        }
        self.cycle = None;
        if let Some(Motion::Cycle(_)) = self.motion {
            self.motion = self.before_cycles;
        }
        Ok(())
    }

    /// Another tool offset in a line without an absolute Z moves some of Fanuc's kin by it, and others not.
    fn may_move(&mut self, asked: &Asked<'_>, before: f64, step: &mut Step) {
        let moves = asked.rules.dialect.table().doubts_tool_offset
            && self.offsets.tool[2] != before
            && (asked.word(b'Z').is_none() || self.distance != Some(Distance::Absolute));
        if moves && !self.tip {
            self.lose(2, Lost::ToolOffset);
            step.passed = Some("G43 and G49 without Z");
        }
    }
}

/// The number of the system of G54.1 P.
fn further_system(asked: &Asked<'_>, word: &Word) -> Result<Number, Fault> {
    let p = asked.word(b'P').map(whole).transpose()?;
    let p = p
        .filter(|p| (1..=300).contains(p))
        .ok_or_else(|| word.fault("G54.1 without P1 to P300", "write the P of the system"))?;
    Ok(100 + p as Number)
}

fn unknown_m(word: &Word) -> Fault {
    let pass = format!(
        "pass it unchanged with --pass M{}, if it moves nothing and changes no coordinates",
        word.value
    );
    match word.tenths() {
        Some(700 | 710 | 720 | 730) => unknown(
            word,
            "modes that are stored and brought back (M70 to M73) are not followed",
            "write the modes in the place of M72, and take M70 to M73 out",
        ),
        Some(970 | 980 | 990) => word
            .fault("a subprogram: the program computes", FLAT)
            .kind(Kind::Flow),
        _ => unknown(
            word,
            "no M word that is known: it may move the machine",
            &pass,
        ),
    }
}

/// Tool-centre-point control needs the machine.
fn needs_machine(word: &Word, rules: &Rules) -> Result<(), Fault> {
    if let Some(cause) = &rules.no_tip {
        return Err(unknown(
            word,
            &format!("tool-centre-point control, and of this machine it is not followed: {cause}"),
            "describe the machine in the workpiece frame that the controller uses, or post the program without \
             tool-centre-point control",
        ));
    }
    match rules.has_machine {
        true => Ok(()),
        false => Err(unknown(
            word,
            "tool-centre-point control: words are workpiece coordinates from here on",
            "give the machine that turns them into axis positions: --machine machine.toml",
        )),
    }
}

//! The motion of a line: straight moves, and what leads to arcs and cycles.

use super::{Asked, Step, bits};
use crate::axes::{self, Position};
use crate::codes::Code;
use crate::fault::Fault;
use crate::modal::{Distance, FeedMode, Motion};
use crate::moves::{Move, Rate, Straight};
use crate::state::{Lost, State};
use crate::words::Word;

impl State {
    /// Words of axes that the machine does not have: they are passed if they never move.
    ///
    /// # Errors
    /// One that moves.
    pub(super) fn pass_others(&mut self, asked: &mut Asked<'_>) -> Result<(), Fault> {
        let others = asked.free & !asked.rules.axes;
        for axis in bits(others) {
            let Some(word) = asked.word(axes::LETTERS[axis]) else {
                continue;
            };
            let stays = match word.distance.or(self.distance) {
                Some(Distance::Incremental) => word.value == 0.0,
                _ => self.others[axis].is_none_or(|before| before == word.value),
            };
            if !stays {
                let letter = axes::name(axis);
                return Err(word.fault(
                    format!("the compensation has no axis {letter}, and it moves here"),
                    "give the compensation of the machine that the program is for",
                ));
            }
            self.others[axis] = Some(word.value);
        }
        asked.free &= !others;
        Ok(())
    }

    /// Moves, with the axes that no other word of the line has taken.
    pub(super) fn do_motion(&mut self, asked: &Asked<'_>, step: &mut Step) -> Result<(), Fault> {
        let motion = self.motion_of(asked);
        match asked.motion {
            Some((Code::NoMotion, word)) => return self.end_motion(asked, word),
            Some((Code::Probe, word)) => return self.probe(asked, word, step),
            Some((Code::Threading(tenths), word)) => {
                asked.machine_coordinates.map_or(Ok(()), alone)?;
                step.motion = Some(self.thread(asked, tenths, word)?);
                return Ok(());
            }
            Some((Code::Motion(motion), _)) => self.hold_motion(motion),
            _ => {}
        }
        let Some(motion) = self.motion_to_do(asked, motion)? else {
            return Ok(());
        };
        if self.move_before_known(asked, step)? {
            return Ok(());
        }
        step.motion = Some(match motion {
            Motion::Rapid | Motion::Feed => self.straight(asked, motion)?,
            Motion::Clockwise | Motion::Counterclockwise => {
                let rate = self.rate(asked)?;
                let arc = self.arc(asked, motion == Motion::Clockwise)?;
                self.position.at = arc.to;
                self.command(asked, false);
                Move::Arc(arc, rate)
            }
            Motion::Cycle(code) => {
                let cycle = self.canned(asked, code)?;
                self.position.at = cycle.to();
                self.command(asked, false);
                if self.distance == Some(Distance::Absolute) {
                    self.commanded |= 1 << cycle.axes[2];
                }
                Move::Cycle(Box::new(cycle))
            }
        });
        Ok(())
    }

    /// G80 where cycles are motions.
    fn end_motion(&mut self, asked: &Asked<'_>, word: &Word) -> Result<(), Fault> {
        self.motion = None;
        self.cycle = None;
        match asked.free {
            0 => Ok(()),
            _ => Err(word.fault("axes in a line with G80", "write two lines")),
        }
    }

    /// G38: where it ends is not known.
    fn probe(&mut self, asked: &Asked<'_>, word: &Word, step: &mut Step) -> Result<(), Fault> {
        asked.machine_coordinates.map_or(Ok(()), alone)?;
        self.not_with_tip(word)?;
        bits(asked.free).for_each(|axis| self.lose(axis, Lost::Probed));
        self.lose_turned(asked.free);
        step.passed = Some("probing");
        self.motion = None;
        Ok(())
    }

    /// A motion holds until another one.
    fn hold_motion(&mut self, motion: Motion) {
        self.motion = Some(motion);
        if !matches!(motion, Motion::Cycle(_)) {
            self.cycle = None;
            self.before_cycles = Some(motion);
        }
    }

    /// The motion that a line does; `None` if it does not move.
    fn motion_to_do(
        &self,
        asked: &Asked<'_>,
        motion: Option<Motion>,
    ) -> Result<Option<Motion>, Fault> {
        let is_arc = matches!(motion, Some(Motion::Clockwise | Motion::Counterclockwise));
        if asked.free == 0 && !(is_arc && asked.may_turn_fully()) {
            return Ok(None);
        }
        // A full turn beside G43.1, whose words are not those of the arc.
        if asked.free == 0 && asked.axes & asked.rules.axes != 0 {
            return Err(asked.fault(
                "an arc in a line whose axes another word takes",
                "write two lines",
            ));
        }
        let Some(motion) = motion else {
            return Err(asked.fault(
                "axes without a motion word, and none is active",
                "write G0, G1, G2 or G3, or give the setup the active one: [start] motion = \"G0\"",
            ));
        };
        if let Some(word) = asked.machine_coordinates {
            self.allows_machine_coordinates(asked, word, motion)?;
        }
        Ok(Some(match motion {
            // Printers do not tell G0 and G1 apart.
            Motion::Rapid if asked.word(b'E').is_some() => Motion::Feed,
            motion => motion,
        }))
    }

    /// The words of axes of a line have been done.
    fn command(&mut self, asked: &Asked<'_>, machine: bool) {
        let words = asked.free;
        if machine {
            // A way out of the way: what holds behind it, the program says again.
            self.commanded &= !words;
            self.doubt_offset(words);
            return;
        }
        let is_absolute = |axis: &usize| {
            self.distance_of(asked.word(axes::LETTERS[*axis])) == Some(Distance::Absolute)
        };
        let absolute = bits(words).filter(is_absolute);
        let absolute = absolute.fold(0, |mask, axis| mask | 1 << axis);
        self.commanded |= self.together(absolute);
    }

    /// What a word of an axis counts from: its own AC or IC, or what holds.
    pub(crate) fn distance_of(&self, word: Option<&Word>) -> Option<Distance> {
        word.and_then(|word| word.distance).or(self.distance)
    }

    /// Axes (bits) that move where these have words: under a rotation X and Y both, or none.
    pub(crate) fn together(&self, words: u16) -> u16 {
        match self.offsets.is_turned() && words & 0b11 != 0 {
            true => words | 0b11,
            false => words,
        }
    }

    /// Axes (bits) that a rapid with these words is to bring to their corrected places.
    fn due(&self, words: u16, machine: bool) -> u16 {
        match self.distance {
            _ if machine => words,
            Some(Distance::Absolute) => self.together(self.commanded | words),
            // Increments drag nothing along.
            _ => u16::MAX,
        }
    }

    /// Fanuc's controllers cancel the tool offset of an axis that goes home or in machine coordinates, for that motion
    /// or for good.
    pub(super) fn doubt_offset(&mut self, axes: u16) {
        self.offset_in_doubt |=
            axes & 0b100 != 0 && self.offsets.tool[2] != 0.0 && self.doubts_tool_offset;
    }

    /// The motion that words of axes go on with.
    pub(super) fn motion_of(&self, asked: &Asked<'_>) -> Option<Motion> {
        match asked.motion {
            Some((Code::Motion(motion), _)) => Some(motion),
            Some(_) => None,
            None => self.motion,
        }
    }

    /// G53 holds with G0 and G1 under G90 only.
    fn allows_machine_coordinates(
        &self,
        asked: &Asked<'_>,
        word: &Word,
        motion: Motion,
    ) -> Result<(), Fault> {
        if !matches!(motion, Motion::Rapid | Motion::Feed) {
            return alone(word);
        }
        if self.distance != Some(Distance::Absolute) {
            return Err(word.fault("G53 under G91", "write G90 before it"));
        }
        if asked.rules.dialect.table().has_names && self.offsets.tool != [0.0; axes::COUNT] {
            return Err(word.fault("SUPA, G53 or G153 while a tool offset is active: whether it counts is a setting of the machine",
                "write D0 in the line",
            ));
        }
        self.not_with_tip(word)
    }

    /// G0, G1.
    fn straight(&mut self, asked: &Asked<'_>, motion: Motion) -> Result<Move, Fault> {
        let machine = asked.machine_coordinates.is_some();
        let from = self.position;
        let to = self.target(asked, asked.free, machine)?;
        let rate = match motion {
            Motion::Rapid => Rate::Rapid,
            _ => self.rate(asked)?,
        };
        let all = asked.rules.axes;
        let needed = match motion {
            Motion::Rapid => to.missing(all),
            _ if asked.rules.dialect.table().printer => to.missing(all),
            _ => to.missing(all).or(from.missing(all)),
        };
        if let Some(axis) = needed {
            return Err(self.missing(asked, axis));
        }
        self.position = to;
        self.command(asked, machine);
        let due = match motion {
            Motion::Rapid => self.due(asked.free, machine),
            _ => all,
        };
        let straight = Straight {
            from,
            to: to.at,
            machine,
            due,
            with_spindle: false,
            comes_back: false,
        };
        Ok(Move::Straight(straight, rate))
    }

    /// G33, G33.1.
    fn thread(&mut self, asked: &Asked<'_>, tenths: u16, word: &Word) -> Result<Move, Fault> {
        if asked.word(b'K').is_none_or(|k| k.value <= 0.0) {
            return Err(Fault::new(
                asked.word(b'K').map_or(word.span(), Word::span),
                "G33 without K, the way per revolution, which is positive",
                "write K",
            ));
        }
        let from = self.position;
        if let Some(axis) = from.missing(asked.rules.axes) {
            return Err(self.missing(asked, axis));
        }
        let to = self.target(asked, asked.free, false)?;
        let straight = Straight {
            from,
            to: to.at,
            machine: false,
            due: asked.rules.axes,
            with_spindle: true,
            comes_back: tenths == 331,
        };
        self.motion = None;
        self.cycle = None;
        if !straight.comes_back {
            self.command(asked, false);
            self.position = to;
        }
        Ok(Move::Straight(straight, Rate::Rapid))
    }

    /// Where words of some axes lead.
    pub(super) fn target(
        &self,
        asked: &Asked<'_>,
        words: u16,
        machine: bool,
    ) -> Result<Position, Fault> {
        let mut to = self.position;
        let Some(first) = asked.block.first_axis() else {
            return Ok(to);
        };
        if machine {
            for axis in bits(words) {
                if asked.rules.setup.wrapped[axis] == Some(true) {
                    return Err(first.fault(
                        format!("G53 with {}, which is wrapped", axes::name(axis)),
                        "turn it in a line without G53",
                    ));
                }
                to.set(axis, self.value(asked, axis)?);
            }
            return Ok(to);
        }
        let relative = self.needs_distance(asked.block)? == Distance::Incremental;
        self.needs_system(first)?;
        if words & 0b100 != 0 && self.offset_in_doubt {
            let word = asked.word(b'Z').unwrap_or(first);
            return Err(offset_in_doubt(word.span()));
        }
        let turned = self.offsets.is_turned() && words & 0b11 != 0;
        if turned {
            let [x, y] = self.turned_target(asked, words & 0b11, relative, first)?;
            to.set(0, x);
            to.set(1, y);
        }
        for axis in bits(if turned { words & !0b11 } else { words }) {
            to.set(axis, self.target_of_axis(asked, axis, first)?);
        }
        Ok(to)
    }

    /// Where words of X and Y (bits) lead under a rotation.
    fn turned_target(
        &self,
        asked: &Asked<'_>,
        words: u16,
        relative: bool,
        first: &Word,
    ) -> Result<[f64; 2], Fault> {
        // A word of X moves both, so both must be known unless both are given.
        let needed = if relative || words != 0b11 { 0b11 } else { 0 };
        if let Some(axis) = self.position.missing(needed) {
            return Err(self.not_known(asked.rules, first, axis));
        }
        let mut program = self.offsets.program(&self.position.at);
        for axis in bits(words) {
            let value = self.value(asked, axis)?;
            program[axis] = if relative {
                program[axis] + value
            } else {
                value
            };
        }
        let at = self.offsets.machine(&program);
        Ok([at[0], at[1]])
    }

    /// Where the word of an axis leads that no rotation mixes with another.
    fn target_of_axis(&self, asked: &Asked<'_>, axis: usize, first: &Word) -> Result<f64, Fault> {
        let word = asked.word(axes::LETTERS[axis]);
        let own = word.filter(|word| word.distance.is_some());
        if let (Some(word), Some(true)) = (own, asked.rules.setup.wrapped[axis]) {
            return Err(word.fault(
                format!("AC or IC of {}, which is wrapped", axes::name(axis)),
                "write the angle alone, under G90",
            ));
        }
        if self.distance_of(word) != Some(Distance::Incremental) {
            return self.absolute(asked, axis);
        }
        if !self.position.knows(axis) {
            return Err(self.not_known(asked.rules, first, axis));
        }
        Ok(self.position.at[axis] + self.value(asked, axis)?)
    }

    /// F as it holds for a move.
    fn rate(&self, asked: &Asked<'_>) -> Result<Rate, Fault> {
        let feed = self.feed.filter(|f| *f > 0.0);
        let Some(feed) = feed else {
            let cause = match self.feed_mode {
                FeedMode::InverseTime => "a move without F under G93",
                _ => "an unknown feed",
            };
            return Err(asked.fault(cause, "write F in this line or before it"));
        };
        Ok(match self.feed_mode {
            FeedMode::InverseTime => Rate::Inverse(feed),
            FeedMode::PerMinute => Rate::PerMinute(feed),
            FeedMode::PerRevolution => Rate::PerRevolution(feed),
        })
    }
}

/// A place along Z that depends on the controller.
pub(crate) fn offset_in_doubt(span: std::ops::Range<usize>) -> Fault {
    Fault::new(
        span,
        "Z after G28, G30, G53 or M6: whether the tool offset of G43 is still active depends on the controller",
        "write G43 with H, or G49, before Z moves again",
    )
}

/// G53 with what it does not hold with.
fn alone(word: &Word) -> Result<(), Fault> {
    Err(word.fault("G53 without G0 or G1", "write G0 or G1"))
}

//! What a program moves, motion by motion: for whoever checks it.

use super::axes::{PerLetter, Position};
use super::cycle::Part;
use super::fault::{Fault, Refusal};
use super::modal::Cutter;
use super::moves::{Move, Rate};
use super::state::{Rules, State};
use super::stream::{Lines, StreamError};
use super::tables::Tables;
use super::tip::Tip;
use super::trace::Path;
use super::words::Block;
use std::collections::VecDeque;
use std::io::BufRead;

/// A motion of a program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Line, from 1.
    pub line: u64,
    /// The way, in words' coordinates (mm, degrees).
    pub path: Path,
    /// False if it is not known where it comes from.
    pub whole: bool,
    /// How fast.
    pub rate: Rate,
    /// mm per unit of length of the program, for what [`Self::rate`] counts.
    pub unit: f64,
    /// True under tool-centre-point control.
    pub tip: bool,
    /// Tool length (mm), if it is known.
    pub length: Option<f64>,
    /// The same for poses and for the compensation: `State::field_length`.
    pub field_length: Option<f64>,
    /// True under G41 or G42.
    pub cutter: bool,
    /// True if it is a part of a cycle.
    pub in_cycle: bool,
    /// True if it goes above R with the feed of a cycle: the way out of a tapped hole.
    pub above: bool,
    /// Axes (bits) that are to arrive at their corrected places.
    pub due: u16,
}

/// Where a program goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// A motion.
    Moved(Segment),
    /// The machine is elsewhere now, by a motion that is not corrected.
    Jumped(Position),
}

/// Motions of a program, one after the other.
pub struct Program<'a, R> {
    lines: Lines<R>,
    rules: &'a Rules,
    tables: &'a Tables<'a>,
    tip: Option<&'a Tip<'a>>,
    state: State,
    block: Block,
    waiting: VecDeque<Event>,
}

impl<'a, R: BufRead> Program<'a, R> {
    /// From its beginning.
    pub fn new(
        reader: R,
        rules: &'a Rules,
        tables: &'a Tables<'a>,
        tip: Option<&'a Tip<'a>>,
    ) -> Self {
        let mut state = State::new(rules);
        if let Some(tip) = tip.filter(|_| rules.tip) {
            let length = state.field_length(rules, tables.takes_length);
            state.position.at = tip.world(&state.position.at, length);
        }
        Self {
            lines: Lines::new(reader),
            rules,
            tables,
            tip,
            state,
            block: Block::default(),
            waiting: VecDeque::new(),
        }
    }

    /// Lines read.
    pub fn lines(&self) -> u64 {
        self.lines.number()
    }

    /// Axis positions behind the last line that was read, if all are known.
    pub fn axes(&self) -> Option<PerLetter> {
        let state = &self.state;
        let at = state.position.at;
        match (state.position.missing(self.tables.axes), self.tip) {
            (Some(_), _) => None,
            (None, Some(tip)) if state.tip => tip.axes(
                &at,
                state.field_length(self.rules, self.tables.takes_length),
            ),
            (None, _) => Some(at),
        }
    }

    /// The next motion, which stays the next one.
    ///
    /// # Errors
    /// What is refused in the program.
    pub fn peek(&mut self) -> Result<Option<Event>, StreamError> {
        let next = self.next_event()?;
        if let Some(event) = next {
            self.waiting.push_front(event);
        }
        Ok(next)
    }

    /// The next motion.
    ///
    /// # Errors
    /// What is refused in the program.
    pub fn next_event(&mut self) -> Result<Option<Event>, StreamError> {
        while self.waiting.is_empty() {
            let number = self.lines.number() + 1;
            let Some((line, _)) = self.lines.next_line()? else {
                return Ok(None);
            };
            if self.state.ended {
                continue;
            }
            let scanned = self.block.scan(line, self.rules.dialect);
            let done = scanned.and_then(|()| self.state.step(&self.block, self.rules));
            let step = done.map_err(|fault| Refusal::at(fault, number, line))?;
            if let (Some(on), Some(tip)) = (step.tip, self.tip) {
                let takes = self.tables.takes_length;
                let length = self.state.field_length(self.rules, takes);
                let at = self.state.position.at;
                let there = match on {
                    true => Some(tip.world(&at, length)),
                    false => tip.axes(&at, length),
                };
                self.state.position.at = there
                    .ok_or_else(|| Refusal::at(Fault::no_pose(0..line.len()), number, line))?;
                self.state.tip = on;
                self.waiting.push_back(Event::Jumped(self.state.position));
            }
            if step.passed.is_some() {
                self.waiting.push_back(Event::Jumped(self.state.position));
            }
            self.split(number, step.motion);
        }
        Ok(self.waiting.pop_front())
    }

    fn split(&mut self, line: u64, motion: Option<Move>) {
        let state = &self.state;
        let segment = |path: Path, rate: Rate, whole: bool| {
            Event::Moved(Segment {
                line,
                path,
                whole,
                rate,
                // Not known only where nothing but angles is moved.
                unit: state.units.map_or(1.0, super::modal::Units::mm),
                tip: state.tip,
                length: state.tool_length(&self.rules.setup),
                field_length: state.field_length(self.rules, self.tables.takes_length),
                cutter: state.under != Cutter::Off,
                in_cycle: matches!(motion, Some(Move::Cycle(_))),
                above: false,
                due: match &motion {
                    Some(Move::Straight(straight, _)) => straight.due,
                    _ => u16::MAX,
                },
            })
        };
        match &motion {
            None => {}
            Some(Move::Straight(straight, rate)) => {
                let (straight, rate) = (*straight, *rate);
                let whole = straight.from.missing(self.tables.axes).is_none();
                let path = Path::Line(straight.from.at, straight.to);
                self.waiting.push_back(segment(path, rate, whole));
                if straight.comes_back {
                    self.waiting.push_back(Event::Jumped(state.position));
                }
            }
            Some(Move::Arc(arc, rate)) => {
                self.waiting
                    .push_back(segment(Path::Arc(*arc), *rate, true));
            }
            Some(Move::Cycle(cycle)) => {
                let rate = cycle.rate;
                let mut at = cycle.from;
                let mut go = |to: PerLetter, rate: Rate| {
                    let event = segment(Path::Line(at, to), rate, true);
                    at = to;
                    event
                };
                match cycle.parts() {
                    // A hole without any depth, where the axes stand.
                    Some(parts) if parts.iter().all(|p| matches!(p, Part::Dwell(_))) => {
                        self.waiting.push_back(go(cycle.from, Rate::Rapid));
                    }
                    Some(parts) => {
                        for part in parts {
                            match part {
                                Part::Rapid(to) => self.waiting.push_back(go(to, Rate::Rapid)),
                                Part::Feed(to) => self.waiting.push_back(go(to, rate)),
                                Part::Dwell(_) | Part::SpindleStops | Part::SpindleTurns => {}
                            }
                        }
                    }
                    // With the spindle: down, and out again.
                    None => {
                        let n = cycle.axes[2];
                        for hole in cycle.holes() {
                            let mut to = hole;
                            let mut along = |height: f64, rate: Rate| {
                                to[n] = height;
                                go(to, rate)
                            };
                            let r = along(cycle.r, Rate::Rapid);
                            let ways = [r, along(cycle.bottom, rate), along(cycle.r, rate)];
                            self.waiting.extend(ways);
                            if let (true, Event::Moved(out)) =
                                (cycle.clear() > cycle.r, along(cycle.clear(), rate))
                            {
                                self.waiting
                                    .push_back(Event::Moved(Segment { above: true, ..out }));
                            }
                        }
                    }
                }
            }
        }
    }
}

impl Segment {
    /// Minutes (or revolutions) that it takes; 0 for a rapid.
    #[must_use]
    pub fn minutes(&self, dialect: super::Dialect) -> f64 {
        let by = self.path.by();
        let by: PerLetter = std::array::from_fn(|i| {
            if super::axes::is_rotary(i) {
                by[i]
            } else {
                by[i] / self.unit
            }
        });
        let length = match &self.path {
            Path::Line(..) => dialect.length(&by),
            Path::Arc(arc) => dialect.arc_length(arc.length() / self.unit, &by),
        };
        match self.rate {
            Rate::Rapid => 0.0,
            Rate::PerMinute(f) | Rate::PerRevolution(f) => length / f,
            Rate::Inverse(f) => 1.0 / f,
        }
    }

    /// Where it ends.
    #[must_use]
    pub fn to(&self) -> PerLetter {
        self.path.at(1.0)
    }
}

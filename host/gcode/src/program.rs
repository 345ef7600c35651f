//! What a program moves, line by line and motion by motion: for whoever checks it.

use super::axes::{PerLetter, Position, is_rotary};
use super::cycle::{Cycle, Part};
use super::fault::Refusal;
use super::interpret::Step;
use super::modal::{Cutter, Units};
use super::moves::{Move, Rate};
use super::state::{Rules, State};
use super::stream::{Lines, StreamError};
use super::tables::Tables;
use super::tip::Tip;
use super::trace::{Lost, Path};
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
    /// Like `length`, for poses and for the compensation: `State::field_length`.
    pub field_length: Option<f64>,
    /// True under G41 or G42.
    pub cutter: bool,
    /// True for a rapid to machine coordinates, which ends within the travel.
    pub retracts: bool,
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

/// A program while it is read.
pub struct Reading<'a, R> {
    lines: Lines<R>,
    rules: &'a Rules,
    tables: &'a Tables<'a>,
    tip: Option<&'a Tip<'a>>,
    /// What holds after the last line that was read.
    pub state: State,
    block: Block,
}

impl<'a, R: BufRead> Reading<'a, R> {
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
        }
    }

    /// Number of the last line that was read.
    pub fn number(&self) -> u64 {
        self.lines.number()
    }

    /// Does the next line, also behind the end of the program, where lines do nothing.
    ///
    /// # Errors
    /// What is refused in the program.
    pub(crate) fn next_step(&mut self) -> Result<Option<Step>, StreamError> {
        let number = self.lines.number() + 1;
        let Some((line, _)) = self.lines.next_line()? else {
            return Ok(None);
        };
        if self.state.ended {
            return Ok(Some(Step::default()));
        }
        let takes = self.tables.takes_length;
        let refused = |fault| Refusal::at(fault, number, line);
        self.block.scan(line, self.rules.dialect).map_err(refused)?;
        let (state, block) = (&mut self.state, &self.block);
        let enters = match self.tip {
            Some(tip) => tip
                .enter(state, block, self.rules, takes)
                .map_err(refused)?,
            None => false,
        };
        let step = state.step(block, self.rules).map_err(refused)?;
        if enters && step.tip.is_some() {
            self.state.tip = true;
        } else if let (Some(on), Some(tip)) = (step.tip, self.tip) {
            let length = self.state.field_length(self.rules, takes);
            let at = self.state.position.at;
            let there = match on {
                true => Some(tip.world(&at, length)),
                false => tip.axes(&at, length),
            };
            self.state.position.at = there.ok_or_else(|| refused(Lost::NoPose.into()))?;
            self.state.tip = on;
        }
        Ok(Some(step))
    }

    /// The single motions of the line that was read last: those of a cycle as LinuxCNC does them.
    pub fn segments(&self, motion: &Move) -> Vec<Segment> {
        match motion {
            Move::Straight(straight, rate) => {
                let path = Path::Line(straight.from.at, straight.to);
                vec![Segment {
                    whole: straight.from.missing(self.tables.axes).is_none(),
                    due: straight.due,
                    retracts: straight.machine && *rate == Rate::Rapid,
                    ..self.segment(path, *rate)
                }]
            }
            Move::Arc(arc, rate) => vec![self.segment(Path::Arc(*arc), *rate)],
            Move::Cycle(cycle) => self.segments_of_cycle(cycle),
        }
    }

    fn segment(&self, path: Path, rate: Rate) -> Segment {
        let state = &self.state;
        Segment {
            line: self.number(),
            path,
            whole: true,
            rate,
            // Not known only where nothing but angles is moved.
            unit: state.units.map_or(1.0, Units::mm),
            tip: state.tip,
            length: state.tool_length(&self.rules.setup),
            field_length: state.field_length(self.rules, self.tables.takes_length),
            cutter: state.under != Cutter::Off,
            retracts: false,
            due: u16::MAX,
        }
    }

    fn segments_of_cycle(&self, cycle: &Cycle) -> Vec<Segment> {
        let mut segments = Vec::new();
        let mut at = cycle.from;
        let mut go = |to: PerLetter, rate: Rate| {
            segments.push(self.segment(Path::Line(at, to), rate));
            at = to;
        };
        match cycle.parts() {
            Some(parts) => {
                for part in parts {
                    match part {
                        Part::Rapid(to) => go(to, Rate::Rapid),
                        Part::Feed(to) => go(to, cycle.rate),
                        Part::Dwell(_) | Part::SpindleStops | Part::SpindleTurns => {}
                    }
                }
            }
            // With the spindle: down, and out again.
            None => {
                for hole in cycle.holes() {
                    let with = |height: f64| {
                        let mut to = hole;
                        to[cycle.axes[2]] = height;
                        to
                    };
                    go(with(cycle.r), Rate::Rapid);
                    go(with(cycle.bottom), cycle.rate);
                    go(with(cycle.clear()), cycle.rate);
                }
            }
        }
        segments
    }
}

/// Motions of a program, one after the other.
pub struct Program<'a, R> {
    reading: Reading<'a, R>,
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
        Self {
            reading: Reading::new(reader, rules, tables, tip),
            waiting: VecDeque::new(),
        }
    }

    /// The next motion.
    ///
    /// # Errors
    /// What is refused in the program.
    pub fn next_event(&mut self) -> Result<Option<Event>, StreamError> {
        while self.waiting.is_empty() {
            let Some(step) = self.reading.next_step()? else {
                return Ok(None);
            };
            let jumped = Event::Jumped(self.reading.state.position);
            if (step.tip.is_some() && step.motion.is_none()) || step.passed.is_some() {
                self.waiting.push_back(jumped);
            }
            if let Some(motion) = &step.motion {
                let segments = self.reading.segments(motion);
                self.waiting.extend(segments.into_iter().map(Event::Moved));
                if matches!(motion, Move::Straight(straight, _) if straight.comes_back) {
                    self.waiting.push_back(jumped);
                }
            }
        }
        Ok(self.waiting.pop_front())
    }
}

impl Segment {
    /// Minutes (or revolutions) that it takes; 0 for a rapid, and where F counts a length whose start is unknown.
    #[must_use]
    pub fn minutes(&self, dialect: super::Dialect) -> f64 {
        let by = self.path.by();
        let by: PerLetter = std::array::from_fn(|i| {
            if is_rotary(i) {
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
            Rate::PerMinute(_) | Rate::PerRevolution(_) if !self.whole => 0.0,
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

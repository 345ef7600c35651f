//! A program corrected, line by line.

mod cycles;
mod piece;
mod write;

use super::axes::{PerLetter, Position, is_rotary};
use super::codes::{self, Code, Group};
use super::cut::{self, Limits};
use super::dialect::Dialect;
use super::edit::Edits;
use super::fault::{Fault, Refusal};
use super::interpret::{Step, bits};
use super::moves::{Move, Rate, Straight};
use super::report::Report;
use super::state::{Rules, State};
use super::tables::{Tables, Ways};
use super::tip::Tip;
use super::trace::{Field, Node, Path};
use super::words::{Block, Word};
use piece::{Piece, Shape, Timing, direction_unknown, lost_at, span_of};

/// What becomes of the step where an axis turns round.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Backlash {
    /// A move of its own before the reversal.
    #[default]
    Move,
    /// Part of the next move.
    Blend,
    /// Left out: corrections are those of the direction before.
    Leave,
}

/// How a program is corrected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// How far straight moves may be from the corrected path (mm).
    pub tolerance: f64,
    /// How far the direction of the tool may be (rad).
    pub direction: f64,
    /// Sagitta of the chords that arcs become (mm).
    pub chord: f64,
    /// Reversals.
    pub backlash: Backlash,
    /// Take corrections away again.
    pub undo: bool,
}

impl Default for Options {
    /// 0.5 µm, 1 µrad, chords of 1 µm.
    fn default() -> Self {
        Self {
            tolerance: 0.5e-3,
            direction: 1e-6,
            chord: 1e-3,
            backlash: Backlash::Move,
            undo: false,
        }
    }
}

/// Corrects a program.
pub struct Corrector<'a> {
    rules: &'a Rules,
    tables: &'a Tables<'a>,
    tip: Option<&'a Tip<'a>>,
    options: Options,
    /// What the program says.
    nominal: State,
    /// What the corrected program says.
    written: State,
    ways: Ways,
    /// The same before the move that is looked at.
    start_ways: Ways,
    /// What was done so far.
    pub report: Report,
    line: u64,
    block: Block,
    edits: Edits,
    nodes: Vec<Node>,
    breaks: Vec<usize>,
    ends: Vec<usize>,
    text: Vec<u8>,
    check: Block,
    eol: &'static [u8],
    /// What the corrected program says before this line, while the modes of the line itself are in `written`.
    before_modes: Option<State>,
    /// The cycle (tenths) of a series that is being written out.
    written_out: Option<u16>,
    /// The first comment, until it is written.
    mark: Option<String>,
}

impl<'a> Corrector<'a> {
    /// `mark` is the first comment, without brackets.
    pub fn new(
        rules: &'a Rules,
        tables: &'a Tables<'a>,
        tip: Option<&'a Tip<'a>>,
        options: Options,
        mark: Option<String>,
    ) -> Result<Self, String> {
        let mut nominal = State::new(rules);
        let ways = Ways::new(tables, &nominal.position, &rules.setup.travel);
        if rules.tip {
            if let Some(axis) = nominal.position.missing(tables.axes) {
                return Err(format!(
                    "the position of {} before the first line is not known: give it in the setup under [start]",
                    super::axes::name(axis)
                ));
            }
            let length = nominal
                .tool_length(&rules.setup)
                .filter(|_| tables.takes_length);
            if let Some(tip) = tip {
                nominal.position.at = tip.world(&nominal.position.at, length);
            }
        }
        Ok(Self {
            rules,
            tables,
            tip,
            options,
            written: nominal.clone(),
            nominal,
            start_ways: ways.clone(),
            ways,
            report: Report::default(),
            line: 0,
            block: Block::default(),
            edits: Edits::default(),
            nodes: Vec::new(),
            breaks: Vec::new(),
            ends: Vec::new(),
            text: Vec::new(),
            check: Block::default(),
            eol: b"\n",
            before_modes: None,
            written_out: None,
            mark,
        })
    }

    /// Corrects the next line; `eol` is how it ends. What is to be written goes to the end of `out`.
    ///
    /// # Errors
    /// What is refused; nothing that was written before is of use then.
    pub fn next(&mut self, line: &[u8], eol: &[u8], out: &mut Vec<u8>) -> Result<(), Refusal> {
        self.line += 1;
        let done = self.do_line(line, eol, out);
        done.map_err(|fault| Refusal::at(fault, self.line, line))
    }

    /// The end of the program.
    ///
    /// # Errors
    /// A program without any line.
    pub fn finish(&mut self) -> Result<(), Refusal> {
        if self.line > 0 {
            return Ok(());
        }
        let fault = Fault::new(
            0..0,
            "the program is empty",
            "give a program with at least one line",
        );
        Err(Refusal::at(fault, 1, b""))
    }

    fn do_line(&mut self, line: &[u8], eol: &[u8], out: &mut Vec<u8>) -> Result<(), Fault> {
        self.report.lines[0] += 1;
        self.report.lines[1] += 1;
        if eol == b"\r\n" {
            self.eol = b"\r\n";
        }
        if self.nominal.ended {
            out.extend_from_slice(line);
            out.extend_from_slice(eol);
            return Ok(());
        }
        let mut block = std::mem::take(&mut self.block);
        block.scan(line, self.rules.dialect)?;
        if block.marked {
            if self.options.undo {
                // The line is nothing but the mark.
                self.block = block;
                self.report.lines[1] -= 1;
                return Ok(());
            }
            return Err(Fault::new(
                0..line.len(),
                "the program is corrected already",
                "correct the program that it was made from, or take the correction away first with --undo",
            ));
        }
        self.begin(&block, out);
        let done = self.correct_block(&block, line, eol, out);
        self.block = block;
        done
    }

    /// Writes the mark before the first line that may follow it.
    fn begin(&mut self, block: &Block, out: &mut Vec<u8>) {
        if self.mark.is_none() || block.percent {
            return;
        }
        if self.rules.dialect == Dialect::Fanuc && block.word(b'O').is_some() {
            return;
        }
        if let Some(mark) = self.mark.take() {
            out.push(b'(');
            out.extend_from_slice(mark.as_bytes());
            out.push(b')');
            out.extend_from_slice(self.eol);
            self.report.lines[1] += 1;
        }
    }

    fn correct_block(
        &mut self,
        block: &Block,
        line: &[u8],
        eol: &[u8],
        out: &mut Vec<u8>,
    ) -> Result<(), Fault> {
        let before = self.nominal.position;
        let step = self.nominal.step(block, self.rules)?;
        if self.nominal.cycle.is_none() {
            self.written_out = None;
        }
        if let Some(on) = step.tip {
            self.switch_tip(block, &step, on)?;
        }
        match &step.motion {
            None => self.pass(block, &step, line, eol, out, &before),
            Some(motion) => {
                self.report.moves += 1;
                self.motion(block, &step, motion, line, eol, out)
            }
        }
    }

    /// A line without motion: as it is, but for words that say where the machine is.
    fn pass(
        &mut self,
        block: &Block,
        step: &Step,
        line: &[u8],
        eol: &[u8],
        out: &mut Vec<u8>,
        before: &Position,
    ) -> Result<(), Fault> {
        if let Some(what) = step.passed {
            *self.report.passed.entry(what).or_default() += 1;
        }
        if let Some(system) = step.reference {
            return self.reference(block, system, line, eol, out);
        }
        if step.tip.is_none() {
            self.written.step(block, self.rules)?;
        }
        if step.passed.is_some() {
            for axis in bits(self.tables.axes) {
                if !self.nominal.position.knows(axis) {
                    self.ways.forget(axis);
                }
            }
            if self.nominal.position != *before
                && self.nominal.position.missing(self.tables.axes).is_none()
            {
                let at = self.nominal.position.at;
                self.ways.come_to(self.tables, &at);
            }
        }
        out.extend_from_slice(line);
        out.extend_from_slice(eol);
        Ok(())
    }

    /// M428, M429: the same place in other coordinates.
    fn switch_tip(&mut self, block: &Block, step: &Step, on: bool) -> Result<(), Fault> {
        let span = block.words.first().map_or(0..block.end, Word::span);
        let Some(tip) = self.tip else {
            return Err(Fault::new(
                span,
                "tool-centre-point control",
                "give --machine machine.toml",
            ));
        };
        if step.motion.is_some() {
            return Err(Fault::new(
                span,
                "tool-centre-point control is switched in a line with a motion",
                "write two lines",
            ));
        }
        if let Some(axis) = self.nominal.position.missing(self.tables.axes) {
            return Err(super::interpret::not_known(&block.words[0], axis));
        }
        let length = self.length(&span)?.filter(|_| self.tables.takes_length);
        self.written.step(block, self.rules)?;
        for state in [&mut self.nominal, &mut self.written] {
            let at = &state.position.at;
            state.position.at = if on {
                tip.world(at, length)
            } else {
                tip.axes(at, length).ok_or_else(|| {
                    Fault::new(
                        span.clone(),
                        "no axis positions put the tip there",
                        "check the machine",
                    )
                })?
            };
            state.tip = on;
        }
        Ok(())
    }

    /// The tool length, where it is needed.
    fn length(&self, span: &std::ops::Range<usize>) -> Result<Option<f64>, Fault> {
        let length = self.nominal.tool_length(&self.rules.setup);
        if self.tables.takes_length && length.is_none() {
            return Err(Fault::new(
                span.clone(),
                "the compensation depends on the tool length, which is not known here",
                "give the setup the tool in the spindle, [start] tool = 1, and its length, [tool.1] length = …",
            ));
        }
        Ok(length)
    }

    fn motion(
        &mut self,
        block: &Block,
        step: &Step,
        motion: &Move,
        line: &[u8],
        eol: &[u8],
        out: &mut Vec<u8>,
    ) -> Result<(), Fault> {
        let span = span_of(block);
        let length = self.length(&span)?;
        if let Some(length) = length {
            self.report.lengths.insert((length * 1e3).round() as i64);
        }
        self.modes_first(block)?;
        let mut pieces = Vec::new();
        match motion {
            Move::Straight(straight, rate) => {
                self.straight(straight, *rate, &span, length, &mut pieces)?;
                self.write_all(block, step, &pieces, line, eol, out)
            }
            Move::Arc(arc, rate) => {
                self.arc(arc, *rate, &span, length, &mut pieces)?;
                self.write_all(block, step, &pieces, line, eol, out)
            }
            Move::Cycle(cycle) => self.cycle(block, step, cycle, length, line, eol, out),
        }
    }

    /// Modes and offsets of a line hold for its own motion: words are written as they mean them.
    fn modes_first(&mut self, block: &Block) -> Result<(), Fault> {
        let dialect = self.rules.dialect;
        let is_motion = |word: &Word| {
            let code = word.tenths().and_then(|t| codes::g(t, dialect));
            code.is_some_and(|c| c.group() == Group::Motion || c == Code::MachineCoordinates)
        };
        let changes = |word: &&Word| match word.letter {
            b'G' => !is_motion(word),
            b'M' | b'T' => true,
            _ => false,
        };
        if !block.words.iter().any(|w| changes(&w)) {
            return Ok(());
        }
        let mut modes = Block::default();
        let stays = |word: &&Word| {
            let moves = super::axes::index(word.letter).is_some() || b"IJKR".contains(&word.letter);
            let goes = moves || (word.letter == b'G' && is_motion(word));
            !goes
        };
        block
            .words
            .iter()
            .filter(stays)
            .for_each(|word| modes.push(*word));
        let mut state = self.written.clone();
        state.step(&modes, self.rules)?;
        state.ended = false;
        self.before_modes = Some(std::mem::replace(&mut self.written, state));
        Ok(())
    }

    fn field(&self, length: Option<f64>) -> Field<'a> {
        Field {
            tables: self.tables,
            tip: self.tip.filter(|_| self.nominal.tip),
            length: length.filter(|_| self.tables.takes_length),
            undo: self.options.undo,
        }
    }

    /// How far from the corrected path it may be.
    fn limits(&self) -> Limits {
        let rotary = bits(self.tables.axes).any(is_rotary);
        Limits::new(
            self.options.tolerance,
            self.options.direction,
            rotary,
            !self.nominal.tip,
        )
    }

    /// The nodes of a path, and the direction of each axis at its end.
    fn traced(
        &mut self,
        path: &Path,
        finer: usize,
        span: &std::ops::Range<usize>,
        length: Option<f64>,
    ) -> Result<(), Fault> {
        let field = self.field(length);
        let leave = self.options.backlash == Backlash::Leave;
        let limits = self.limits();
        let before = self.ways.clone();
        self.start_ways = before.clone();
        let (nodes, breaks) = (&mut self.nodes, &mut self.breaks);
        let mut ways = before.clone();
        let done = field.trace(path, &limits, &mut ways, finer, nodes, breaks);
        done.map_err(|lost| lost_at(span.clone(), lost))?;
        let known = before.missing(self.tables).is_none();
        if leave && known {
            // As if no axis had turned.
            return Ok(());
        }
        self.ways = ways;
        if let Some(axis) = self.ways.missing(self.tables) {
            return Err(direction_unknown(span.clone(), axis));
        }
        Ok(())
    }

    fn straight(
        &mut self,
        straight: &Straight,
        rate: Rate,
        span: &std::ops::Range<usize>,
        length: Option<f64>,
        pieces: &mut Vec<Piece>,
    ) -> Result<(), Fault> {
        let shape = match rate {
            Rate::Rapid if !straight.with_spindle => Shape::Rapid,
            _ => Shape::Feed,
        };
        let to = straight.to;
        if straight.from.missing(self.tables.axes).is_some() || self.options.undo {
            // Where it comes from is not known, only where it ends.
            let field = self.field(length);
            let q = field
                .axes(&to)
                .map_err(|lost| lost_at(span.clone(), lost))?;
            self.ways.come_to(self.tables, &q);
            if let Some(axis) = self.ways.missing(self.tables) {
                return Err(direction_unknown(span.clone(), axis));
            }
            let node = field
                .node(1.0, &to, &self.ways)
                .map_err(|lost| lost_at(span.clone(), lost))?;
            field
                .reaches(&node)
                .map_err(|lost| lost_at(span.clone(), lost))?;
            self.corrected(&node);
            pieces.push(Piece::whole(
                shape,
                node.to,
                self.timing(rate, &Path::Line(straight.from.at, to)),
            ));
            return Ok(());
        }
        let path = Path::Line(straight.from.at, to);
        if straight.from.at == to {
            // Nothing moves, and no axis turns.
            let field = self.field(length);
            let node = field
                .node(1.0, &to, &self.ways)
                .map_err(|lost| lost_at(span.clone(), lost))?;
            field
                .reaches(&node)
                .map_err(|lost| lost_at(span.clone(), lost))?;
            self.corrected(&node);
            pieces.push(Piece::whole(shape, node.to, Timing::None));
            return Ok(());
        }
        self.traced(&path, 0, span, length)?;
        let last = self.nodes[self.nodes.len() - 1];
        self.corrected(&last);
        let field = self.field(length);
        field
            .reaches(&last)
            .map_err(|lost| lost_at(span.clone(), lost))?;
        let timing = self.timing(rate, &path);
        let limits = self.limits();
        if straight.with_spindle {
            if !self.breaks.is_empty() || !cut::is_straight(&self.nodes, &limits) {
                return Err(Fault::new(
                    span.clone(),
                    "a thread that would have to be cut into several moves",
                    "give a larger --tolerance, or use the compensation in the controller",
                ));
            }
            pieces.push(Piece::whole(shape, last.to, Timing::None));
            return Ok(());
        }
        if self.nominal.cutter {
            self.note_cutter(&limits);
            pieces.push(Piece::whole(shape, last.to, timing));
            return Ok(());
        }
        let field = self.field(length);
        self.runs(&field, shape, &limits, timing, pieces)
            .map_err(|lost| lost_at(span.clone(), lost))?;
        self.report.cut +=
            u64::from(pieces.iter().filter(|p| p.timing != Timing::TakeUp).count() > 1);
        Ok(())
    }

    /// End points under cutter compensation: what it costs that their moves are not cut.
    fn note_cutter(&mut self, limits: &Limits) {
        self.report.under_cutter += 1;
        let (Some(first), Some(last)) = (self.nodes.first(), self.nodes.last()) else {
            return;
        };
        let mut off = 0.0_f64;
        for node in &self.nodes {
            let part: PerLetter = std::array::from_fn(|i| {
                node.to[i]
                    - node.q[i]
                    - (1.0 - node.t) * (first.to[i] - first.q[i])
                    - node.t * (last.to[i] - last.q[i])
            });
            off = off.max(limits.of(&part) * limits.linear);
        }
        self.report.under_cutter_off = self.report.under_cutter_off.max(off);
    }

    fn arc(
        &mut self,
        arc: &super::arc::Arc,
        rate: Rate,
        span: &std::ops::Range<usize>,
        length: Option<f64>,
        pieces: &mut Vec<Piece>,
    ) -> Result<(), Fault> {
        let path = Path::Arc(*arc);
        self.traced(&path, 0, span, length)?;
        let last = self.nodes[self.nodes.len() - 1];
        self.corrected(&last);
        let field = self.field(length);
        let reaches = self.nodes[1..]
            .iter()
            .try_for_each(|node| field.reaches(node));
        reaches.map_err(|lost| lost_at(span.clone(), lost))?;
        let timing = self.timing(rate, &path);
        let mut limits = self.limits();
        if self.options.undo {
            limits = limits.plus(1e6);
            limits.rotary = 1e6;
        }
        if self.nominal.cutter || self.options.undo {
            if self.nominal.cutter {
                self.report.under_cutter += 1;
            }
            let from = self.written.position.at;
            let whole = match self.breaks.last() {
                _ if self.options.undo => &self.nodes[self.breaks.last().copied().unwrap_or(0)..],
                None => &self.nodes[..],
                Some(_) => &[],
            };
            let shifted = match self.nominal.tip {
                true => None,
                false => cut::arc(arc, &from, whole, &limits),
            };
            let Some(shifted) = shifted else {
                return Err(Fault::new(
                    span.clone(),
                    "an arc under cutter compensation that cannot stay one",
                    "give a larger --tolerance, or write the path out without G41 and G42",
                ));
            };
            self.report.arcs[0] += 1;
            pieces.push(Piece::whole(Shape::Arc(shifted), shifted.to, timing));
            return Ok(());
        }
        if !self.nominal.tip {
            let mut trial = Vec::new();
            if self.arc_runs(arc, &limits, timing, &mut trial) {
                self.report.arcs[0] += 1;
                pieces.append(&mut trial);
                return Ok(());
            }
        }
        // Chords: nodes as close as a quarter of one.
        let [r0, r1] = arc.radii();
        let sagitta = (self.options.chord / r0.max(r1)).min(0.5);
        let chord = 2.0 * (1.0 - sagitta).acos();
        let finer = (4.0 * arc.sweep.abs() / chord).ceil().min(1e6) as usize;
        // From the directions at its start again.
        self.ways = self.start_ways.clone();
        self.traced(&path, finer, span, length)?;
        let limits = limits.plus(self.options.chord);
        let field = self.field(length);
        self.runs(&field, Shape::Feed, &limits, timing, pieces)
            .map_err(|lost| lost_at(span.clone(), lost))?;
        self.report.arcs[1] += 1;
        Ok(())
    }
}

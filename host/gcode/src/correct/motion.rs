//! A motion of a line: what it needs, and the way it is corrected.

use super::given::Given;
use super::{Backlash, Corrector};
use crate::axes::is_rotary;
use crate::codes::{Code, Group};
use crate::fault::Fault;
use crate::interpret::bits;
use crate::limits::Limits;
use crate::moves::Move;
use crate::trace::{Field, Lost, Node, Path, Stretch};
use crate::words::{Block, Word};

impl<'a> Corrector<'a> {
    /// A line with a motion.
    pub(super) fn motion(&mut self, given: &Given<'_>, motion: &Move) -> Result<(), Fault> {
        // Words of linear axes are added where only others are commanded.
        self.nominal.needs_units(given.block.axis_span())?;
        if let Some(length) = self.nominal.tool_length(&self.rules.setup) {
            self.report.used(length);
            self.reaches_length(length)?;
        }
        self.modes_first(given.block)?;
        let mut pieces = std::mem::take(&mut self.pieces);
        pieces.clear();
        let timing = match motion {
            Move::Straight(straight, rate) => {
                self.straight(straight, *rate, &mut pieces)?;
                let mut timing = self.timing(*rate, &Path::Line(straight.from.at, straight.to));
                if straight.from.missing(self.tables.axes).is_some() {
                    // Nobody knows how long it is: F stays.
                    timing.minutes = 0.0;
                }
                timing
            }
            Move::Arc(arc, rate) => {
                pieces.extend(self.arc(arc)?);
                self.timing(*rate, &Path::Arc(*arc))
            }
            Move::Cycle(cycle) => return self.cycle(given, cycle),
        };
        let done = self.write_all(given, &pieces, &timing);
        self.pieces = pieces;
        done?;
        let (comes_back, holds) = match motion {
            Move::Straight(straight, rate) => {
                (straight.comes_back, self.held(straight, *rate) != 0)
            }
            _ => (false, false),
        };
        // It stands where it stood, and axes have turned round since; or some are not corrected yet.
        self.joined = !comes_back && !holds;
        if comes_back {
            self.come_back()?;
        }
        Ok(())
    }

    /// Tables that depend on the tool length must reach it.
    fn reaches_length(&self, length: f64) -> Result<(), Fault> {
        let [low, high] = self.tables.lengths;
        // Lengths have decimals, tables are f32.
        let is_beyond = length < low - 1e-3 || length > high + 1e-3;
        if !is_beyond || !self.tables.takes_length {
            return Ok(());
        }
        Err(Fault::of_motion(
            format!(
                "a tool of {length:.3} mm, and the compensation is for {low:.0} to {high:.0} mm"
            ),
            "compile it with a length_range_mm of the machine file that has this tool",
        ))
    }

    /// G33.1 ends where it began.
    fn come_back(&mut self) -> Result<(), Lost> {
        let at = self.nominal.position.at;
        if self.axes_turn() {
            let field = self.field();
            let q = field.axes(&at)?;
            self.ways.come_to(self.tables, &field.middle(&q));
        }
        Ok(())
    }

    /// Modes and offsets of a line hold for its own motion: words are written as they mean them.
    pub(super) fn modes_first(&mut self, block: &Block) -> Result<(), Fault> {
        let dialect = self.rules.dialect;
        // A Sinumerik's D is an offset.
        let has_edge = dialect.table().has_names && block.word(b'D').is_some();
        if !block.has_codes && block.word(b'T').is_none() && !has_edge {
            return Ok(());
        }
        let is_motion = |word: &Word| {
            let code = word.code(dialect);
            code.is_some_and(|c| c.group() == Group::Motion || c == Code::MachineCoordinates)
        };
        let changes = |word: &&Word| match word.letter {
            b'G' => !is_motion(word),
            b'M' | b'T' => true,
            b'D' => has_edge,
            _ => false,
        };
        if !block.words.iter().any(|w| changes(&w)) {
            return Ok(());
        }
        let mut state = self.written.clone();
        state.modes(block, self.rules)?;
        self.before_modes = Some(std::mem::replace(&mut self.written, state));
        Ok(())
    }

    pub(super) fn field(&self) -> Field<'a> {
        Field {
            tables: self.tables,
            tip: self.tip.filter(|_| self.nominal.tip),
            length: self
                .nominal
                .field_length(self.rules, self.tables.takes_length),
            turns: self.axes_turn(),
        }
    }

    /// How far from the corrected path it may be.
    pub(super) fn limits(&self) -> Limits {
        let rotary = bits(self.tables.axes).any(is_rotary);
        Limits::new(
            self.options.tolerance,
            self.options.direction,
            rotary,
            !self.nominal.tip,
        )
    }

    /// The stretches of a path between reversals; directions are those at its end then.
    pub(super) fn stretches(&mut self, path: &Path) -> Result<Vec<Stretch>, Lost> {
        let field = self.field();
        self.start_travel = self.ways.travel;
        let stretches = field.stretches(path, &mut self.ways)?;
        self.knows_directions()?;
        Ok(stretches)
    }

    /// The nodes of a path.
    pub(super) fn trace(&mut self, path: &Path) -> Result<(), Lost> {
        let stretches = self.stretches(path)?;
        let (field, limits) = (self.field(), self.limits());
        field.trace(path, &limits, &stretches, &mut self.traced)
    }

    /// The directions of all axes whose tables need them must be known.
    pub(super) fn knows_directions(&self) -> Result<(), Lost> {
        match self.ways.missing(self.tables) {
            Some(axis) => Err(Lost::Direction(axis)),
            None => Ok(()),
        }
    }

    /// False where directions stay what they are, whichever way axes go: reversals are left out.
    pub(super) fn axes_turn(&self) -> bool {
        self.options.backlash != Backlash::Leave || self.ways.missing(self.tables).is_some()
    }

    /// Takes in how far a position was corrected.
    pub(super) fn corrected(&mut self, node: &Node) {
        let by = std::array::from_fn(|i| node.moved[i] - node.q[i]);
        self.report.corrected(&by, self.line);
    }
}

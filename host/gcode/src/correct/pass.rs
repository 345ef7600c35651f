//! Lines without a motion: as they are, but for words that say where the machine is.

use super::Corrector;
use super::given::Given;
use super::write::replace_number;
use crate::axes::{self, Position, is_rotary};
use crate::fault::Fault;
use crate::interpret::bits;
use crate::line_map::Role;
use crate::number;
use crate::trace::Lost;
use crate::words::Block;

impl Corrector<'_> {
    /// A line without motion; `before` is where the program was.
    pub(super) fn pass(&mut self, given: &Given<'_>, before: &Position) -> Result<(), Fault> {
        let step = given.step;
        if let Some(what) = step.passed {
            *self.report.passed.entry(what).or_default() += 1;
        }
        if let Some(system) = step.reference {
            return self.reference(given, system);
        }
        if step.tip.is_none() {
            self.written.step(given.block, self.rules)?;
        }
        if step.passed.is_some() {
            self.joined = false;
            for axis in bits(self.tables.axes) {
                if !self.nominal.position.knows(axis) {
                    self.ways.forget(axis);
                }
            }
            if self.nominal.position != *before
                && self.nominal.position.missing(self.tables.axes).is_none()
                && self.axes_turn()
            {
                let at = self.nominal.position.at;
                self.ways.come_to(self.tables, &at);
            }
        }
        self.out.extend_from_slice(given.line);
        self.end_line(given.eol, Role::Plain);
        Ok(())
    }

    /// A line that switches tool-centre-point control on and moves: both programs stand at the tip before it.
    pub(super) fn enter_tip(&mut self, block: &Block) -> Result<bool, Fault> {
        let Some(tip) = self.tip else {
            return Ok(false);
        };
        let takes = self.tables.takes_length;
        let enters = tip.enter(&mut self.nominal, block, self.rules, takes)?;
        if !enters {
            return Ok(false);
        }
        if let Some(axis) = self.nominal.position.missing(self.tables.axes) {
            return Err(self.nominal.not_known(self.rules, &block.words[0], axis));
        }
        tip.enter(&mut self.written, block, self.rules, takes)?;
        // The offset holds before control is on: it moves nothing then.
        self.written.modes(block, self.rules)?;
        Ok(true)
    }

    /// M428, M429: the same place in other coordinates.
    pub(super) fn switch_tip(&mut self, given: &Given<'_>, on: bool) -> Result<(), Fault> {
        let block = given.block;
        let span = block.words[0].span();
        let Some(tip) = self.tip else {
            return Err(Fault::new(
                span,
                "tool-centre-point control",
                "give --machine machine.toml",
            ));
        };
        if given.step.motion.is_some() || given.step.reference.is_some() {
            // G92 would count from the axes in one, and from the tip in another controller.
            return Err(Fault::new(
                span,
                "tool-centre-point control is switched in a line with a motion, or with G92",
                "write two lines",
            ));
        }
        if let Some(axis) = self.nominal.position.missing(self.tables.axes) {
            return Err(self.nominal.not_known(self.rules, &block.words[0], axis));
        }
        let takes = self.tables.takes_length;
        let length = self.nominal.field_length(self.rules, takes);
        if takes && length.is_none() {
            return Err(Lost::NoLength.into());
        }
        self.written.step(block, self.rules)?;
        for state in [&mut self.nominal, &mut self.written] {
            let at = &state.position.at;
            state.position.at = if on {
                tip.world(at, length)
            } else {
                tip.axes(at, length).ok_or(Lost::NoPose)?
            };
            state.tip = on;
        }
        Ok(())
    }

    /// G92 and G10 L20: the words say where the machine is, which is elsewhere now.
    fn reference(&mut self, given: &Given<'_>, system: Option<u16>) -> Result<(), Fault> {
        let mut offsets = self.nominal.offsets.clone();
        if let Some(number) = system {
            offsets.select(number);
        }
        let meant = offsets.program(&self.written.position.at);
        let mut edits = std::mem::take(&mut self.edits);
        edits.clear();
        for word in &given.block.words {
            let Some(axis) = axes::index(word.letter) else {
                continue;
            };
            let unit = if is_rotary(axis) { 1.0 } else { self.unit() };
            // More decimals: what is lost here is lost everywhere behind it.
            let decimals = self.kept(word.decimals);
            let more = usize::from(self.options.decimals.is_none());
            let decimals = decimals.max(self.options.decimals(axis, self.units()) + more);
            let value = number::rounded(meant[axis] / unit, decimals);
            replace_number(&mut edits, self.rules, word, value, decimals);
        }
        let from = self.out.len();
        edits.apply(given.line, &mut self.out);
        self.edits = edits;
        self.follow(from, None)?;
        self.end_line(given.eol, Role::Plain);
        Ok(())
    }
}

//! What printers have and other machines have not: E, commands that are not read, and moves before all axes have a place.

use super::{Asked, Step, bits};
use crate::codes::Code;
use crate::fault::Fault;
use crate::modal::Distance;
use crate::state::{Lost, Rules, State};
use crate::words::Command;

impl State {
    /// A command that is not read.
    pub(super) fn command_of_printer(&mut self, command: Command, rules: &Rules, step: &mut Step) {
        if command == Command::Stays {
            return;
        }
        for axis in bits(rules.axes) {
            self.lose(axis, Lost::Command);
        }
        step.passed = Some("homing, probing and stored positions");
        if command == Command::Restores {
            self.distance = None;
            self.extruder.forget();
        }
    }

    /// E of a line, and the words that say what it means.
    pub(super) fn extrude(&mut self, asked: &Asked<'_>, step: &mut Step) {
        for word in asked.coded() {
            match asked.code(word) {
                Some(Code::Distance(distance)) => self.extruder.set_axes(distance),
                // It may count E in other units from here on.
                Some(Code::Units(_)) => self.extruder.set_at(None),
                _ => {}
            }
        }
        let Some(word) = asked.word(b'E') else {
            return;
        };
        if matches!(asked.once, Some((Code::Shift(_), _))) {
            self.extruder.set_at(Some(word.value));
            return;
        }
        let distance = self.extruder.distance(self.distance);
        step.extruded = self.extruder.extrude(word.value, distance);
    }

    /// Does a move after which an axis is still at an unknown place, as between homing and the first layer: it passes.
    ///
    /// # Errors
    /// Words that cannot be read.
    pub(super) fn move_before_known(
        &mut self,
        asked: &Asked<'_>,
        step: &mut Step,
    ) -> Result<bool, Fault> {
        let all = asked.rules.axes;
        if !asked.rules.dialect.table().printer || self.position.missing(all).is_none() {
            return Ok(false);
        }
        let relative = self.needs_distance(asked.block)? == Distance::Incremental;
        let told = if relative { 0 } else { asked.free };
        if all & !(self.position.known | told) == 0 {
            return Ok(false);
        }
        for axis in bits(asked.free) {
            if !relative {
                let to = self.absolute(asked, axis)?;
                self.position.set(axis, to);
            } else if self.position.knows(axis) {
                let to = self.position.at[axis] + self.value(asked, axis)?;
                self.position.set(axis, to);
            }
        }
        if !relative {
            self.commanded |= asked.free;
        }
        step.passed = Some("moves before all axes have a known position");
        Ok(true)
    }
}

//! G10: offsets and tools that a program sets itself.

use super::{Asked, Step, bits, unknown, whole};
use crate::axes::COUNT;
use crate::fault::Fault;
use crate::modal::Distance;
use crate::offsets::{Number, System, system_name};
use crate::state::State;
use crate::words::Word;

impl State {
    /// G10 L1, L2, L20.
    pub(super) fn set_data(
        &mut self,
        asked: &Asked<'_>,
        word: &Word,
        step: &mut Step,
    ) -> Result<(), Fault> {
        let kind = asked.word(b'L').map(whole).transpose()?;
        let p = asked.word(b'P').map(whole).transpose()?;
        let table = asked.rules.dialect.table();
        let further = table.further_systems;
        if let (Some(1), Some(tool), true) = (kind, p, table.sets_tools) {
            return self.set_tool(asked, word, tool);
        }
        let number = match (kind, p) {
            (Some(2 | 20), Some(p @ 1..=9)) if !further => p as Number,
            (Some(2 | 20), Some(0)) if !further => self.offsets.selected(),
            (Some(2), Some(p @ 1..=6)) if further => p as Number,
            (Some(20), Some(p @ 1..=300)) if further => 100 + p as Number,
            _ => return Err(sets_no_system(word, kind)),
        };
        if further && self.needs_distance(asked.block)? != Distance::Absolute {
            return Err(unknown(word, "G10 under G91", "write G90 before it"));
        }
        let mut system = self.system_before(asked, word, number)?;
        if let Some(rotation) = asked.word(b'R') {
            self.may_turn(rotation, number, &system)?;
            system.rotation = rotation.value;
        }
        if kind == Some(20) && !further {
            self.origin_here(asked, word, number, &mut system)?;
            step.reference = Some(Some(number));
        } else {
            for axis in bits(asked.axes) {
                system.origin[axis] = self.value(asked, axis)?;
            }
        }
        self.offsets.set(number, system);
        Ok(())
    }

    /// A system before some of its values are set: those that are not given stay, and must be known.
    fn system_before(
        &self,
        asked: &Asked<'_>,
        word: &Word,
        number: Number,
    ) -> Result<System, Fault> {
        if let Some(known) = self.offsets.systems.get(&number) {
            return Ok(*known);
        }
        let all = asked.rules.axes;
        let name = system_name(number);
        if asked.axes & all != all {
            return Err(word.fault(
                format!("{name} is set for some axes, and its value for the others is unknown"),
                format!("give the setup [offset.\"{name}\"], or write all axes here"),
            ));
        }
        if asked.rules.dialect.table().systems_turn && asked.word(b'R').is_none() {
            return Err(word.fault(
                format!("{name} is set, and its rotation is unknown"),
                format!("give the setup [offset.\"{name}\"], or write R, its rotation, here"),
            ));
        }
        Ok(System::default())
    }

    /// The active system must not get another rotation under G92.
    fn may_turn(&self, rotation: &Word, number: Number, system: &System) -> Result<(), Fault> {
        let [x, y, ..] = self.offsets.g92;
        let holds = number == self.offsets.selected();
        if !holds || rotation.value == system.rotation || (x == 0.0 && y == 0.0) {
            return Ok(());
        }
        Err(unknown(
            rotation,
            "another rotation of the active system, under G92: LinuxCNC then takes the position for \
             another one",
            "write G92.1 before it",
        ))
    }

    /// G10 L1: the offsets of a tool, as they are written. They hold from its next G43 on.
    fn set_tool(&mut self, asked: &Asked<'_>, word: &Word, tool: u32) -> Result<(), Fault> {
        let Some(mut offset) = self.tool_offset(tool, asked.rules) else {
            return Err(word.fault(
                format!("tool {tool} is set, and is perhaps missing from the tool table"),
                format!("give it in the setup: [tool.{tool}] length = …"),
            ));
        };
        for axis in bits(asked.axes) {
            offset[axis] = self.value(asked, axis)?;
        }
        self.tools.insert(tool, offset);
        Ok(())
    }

    /// The origin with which the position has the coordinates that are written: G10 L20.
    fn origin_here(
        &self,
        asked: &Asked<'_>,
        word: &Word,
        number: Number,
        system: &mut System,
    ) -> Result<(), Fault> {
        self.not_with_tip(word)?;
        let mut trial = self.offsets.clone();
        let mut bare = *system;
        bare.origin = [0.0; COUNT];
        trial.set(number, bare);
        trial.select(number);
        let turned = trial.is_turned() && asked.axes & 0b11 != 0;
        if turned && asked.axes & 0b11 != 0b11 {
            return Err(unknown(
                word,
                "G10 L20 of X or Y alone under a rotation",
                "write both",
            ));
        }
        if let Some(axis) = self.position.missing(asked.axes) {
            return Err(self.not_known(asked.rules, word, axis));
        }
        // origin = machine − tool − Rz · (word + g92)
        let mut words = [0.0; COUNT];
        for axis in bits(asked.axes) {
            words[axis] = self.value(asked, axis)?;
        }
        let meant = trial.machine(&words);
        for axis in bits(asked.axes) {
            system.origin[axis] = self.position.at[axis] - meant[axis];
        }
        Ok(())
    }
}

/// A G10 of another kind than those that set a system.
fn sets_no_system(word: &Word, kind: Option<u32>) -> Fault {
    match kind {
        Some(10..=13) => unknown(
            word,
            "G10 L10, L11, L12, L13: tool lengths set from the machine's position, or in parts",
            "write the lengths into the setup instead, and take the words out",
        ),
        _ => unknown(
            word,
            "G10 that is not followed: only L2 and L20 with P are, and LinuxCNC's L1",
            "set the offset in the setup instead",
        ),
    }
}

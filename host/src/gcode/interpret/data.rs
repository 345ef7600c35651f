//! G10: offsets that a program sets itself.

use super::needs::not_known;
use super::{Asked, Step, bits, unknown, whole};
use crate::gcode::axes::COUNT;
use crate::gcode::dialect::Dialect;
use crate::gcode::fault::Fault;
use crate::gcode::modal::Distance;
use crate::gcode::offsets::{Number, System, system_name};
use crate::gcode::state::State;
use crate::gcode::words::Word;

impl State {
    /// G10 L2, G10 L20.
    pub(super) fn set_data(
        &mut self,
        asked: &Asked<'_>,
        word: &Word,
        step: &mut Step,
    ) -> Result<(), Fault> {
        let kind = asked.word(b'L').map(whole).transpose()?;
        let p = asked.word(b'P').map(whole).transpose()?;
        let fanuc = asked.rules.dialect == Dialect::Fanuc;
        let number = match (kind, p) {
            (Some(2 | 20), Some(p @ 1..=9)) if !fanuc => p as Number,
            (Some(2 | 20), Some(0)) if !fanuc => self.offsets.selected(),
            (Some(2), Some(p @ 1..=6)) if fanuc => p as Number,
            (Some(20), Some(p @ 1..=300)) if fanuc => 100 + p as Number,
            (Some(1), Some(tool)) if asked.rules.dialect == Dialect::LinuxCnc => {
                return Err(unknown(
                    word,
                    &format!("G10 L1: the offsets of tool {tool} change within the program"),
                    "write them into the tool table or the setup instead",
                ));
            }
            _ => {
                return Err(unknown(
                    word,
                    "G10 that is not followed: only L2 and L20 with P are",
                    "set the offset in the setup instead",
                ));
            }
        };
        if fanuc && self.distance != Some(Distance::Absolute) {
            return Err(unknown(word, "G10 under G91", "write G90 before it"));
        }
        let known = self.offsets.systems.get(&number).copied();
        // Axes that were not given keep what they had, which must be known.
        let all = asked.rules.axes;
        if known.is_none() && asked.axes & all != all {
            let name = system_name(number);
            return Err(Fault::new(
                word.span(),
                format!("{name} is set for some axes, and what it was for the others is not known"),
                format!("give the setup [offset.\"{name}\"], or write all axes here"),
            ));
        }
        let mut system = known.unwrap_or_default();
        if let Some(rotation) = asked.word(b'R') {
            system.rotation = rotation.value;
        }
        if kind == Some(20) && !fanuc {
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
            return Err(not_known(word, axis));
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

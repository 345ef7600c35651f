//! Words that apply to their own line only: homing, G92, G52.

use super::{Asked, Step, bits, unknown};
use crate::axes::{self, COUNT};
use crate::codes::Code;
use crate::fault::Fault;
use crate::state::{Lost, State};
use crate::words::Word;

impl State {
    /// Does the word of the line that holds there only.
    pub(super) fn do_once(&mut self, asked: &Asked<'_>, step: &mut Step) -> Result<(), Fault> {
        let Some((code, word)) = asked.once else {
            return Ok(());
        };
        match code {
            Code::Dwell => dwell(asked, word)?,
            Code::Data => self.set_data(asked, word, step)?,
            Code::Home(home) => self.go_home(asked, word, home, step)?,
            Code::StoreHome(home) => {
                self.not_with_tip(word)?;
                self.homes[home] = Some(self.position);
            }
            Code::Shift(0) => self.shift(asked, word, step)?,
            Code::Local => self.local(asked, word)?,
            Code::Shift(1) => {
                self.offsets.g92 = [0.0; COUNT];
                self.offsets.g92_stored = Some([0.0; COUNT]);
            }
            Code::Shift(2) => self.offsets.g92 = [0.0; COUNT],
            Code::Shift(3) => {
                self.offsets.g92 = self.offsets.g92_stored.ok_or_else(|| {
                    word.fault(
                        "the offsets that G92.3 restores are unknown",
                        "give LinuxCNC's parameters with --var, or write G92 in the program",
                    )
                })?;
            }
            _ => {}
        }
        Ok(())
    }

    /// G28, G30.
    fn go_home(
        &mut self,
        asked: &Asked<'_>,
        word: &Word,
        home: usize,
        step: &mut Step,
    ) -> Result<(), Fault> {
        self.not_with_tip(word)?;
        let moved = match asked.axes {
            0 => asked.rules.axes,
            axes => axes & asked.rules.axes,
        };
        if asked.rules.dialect.table().printer {
            // Klipper and Marlin drop what G92 has set for an axis when they home it.
            for axis in bits(moved) {
                self.offsets.g92[axis] = 0.0;
            }
        }
        // Fanuc's G30 has a second, a third and a fourth point.
        let is_other = asked.word(b'P').is_some_and(|p| p.value != 2.0);
        let (to, lost) = match is_other {
            true => (None, Lost::Reference),
            false => (self.homes[home], Lost::Home(home)),
        };
        for axis in bits(moved) {
            match to.filter(|to| to.knows(axis)) {
                Some(to) => self.position.set(axis, to.at[axis]),
                None => self.lose(axis, lost),
            }
        }
        self.commanded &= !moved;
        self.doubt_offset(moved);
        self.lose_turned(asked.axes);
        step.passed = Some("G28 and G30");
        Ok(())
    }

    /// Behind a motion of these axes (bits) that is not corrected: under a rotation a word of X or Y moves both.
    pub(super) fn lose_turned(&mut self, axes: u16) {
        if self.offsets.is_turned() && axes & 0b11 != 0 {
            self.lose(0, Lost::Turned);
            self.lose(1, Lost::Turned);
        }
    }

    /// G92.
    fn shift(&mut self, asked: &Asked<'_>, word: &Word, step: &mut Step) -> Result<(), Fault> {
        if asked.axes == 0 && asked.word(b'E').is_some() {
            return Ok(());
        }
        if asked.axes == 0 {
            return Err(word.fault("G92 without axes", "write the axes"));
        }
        self.not_both_shifts(asked, word, false)?;
        let at = self.offsets.program(&self.position.at);
        self.needs_system(word)?;
        let turned = self.offsets.is_turned() && asked.axes & 0b11 != 0;
        let needed = asked.axes | if turned { 0b11 } else { 0 };
        if let Some(axis) = self.position.missing(needed) {
            return Err(self.not_known(asked.rules, word, axis));
        }
        for axis in bits(asked.axes) {
            // Machine = word + g92: the word is smaller by what the shift is larger.
            self.offsets.g92[axis] += at[axis] - self.value(asked, axis)?;
        }
        self.offsets.local = false;
        self.offsets.g92_stored = Some(self.offsets.g92);
        step.reference = Some(None);
        Ok(())
    }

    /// G52: offsets as they are written, which the corrected program has too.
    fn local(&mut self, asked: &Asked<'_>, word: &Word) -> Result<(), Fault> {
        if asked.axes == 0 {
            return Err(word.fault(
                "G52 without axes",
                "write the axes; G52 X0 Y0 Z0 takes the offset back",
            ));
        }
        self.not_both_shifts(asked, word, true)?;
        for axis in bits(asked.axes) {
            self.offsets.g92[axis] = self.value(asked, axis)?;
        }
        self.offsets.local = true;
        self.offsets.g92_stored = Some(self.offsets.g92);
        Ok(())
    }

    /// LinuxCNC keeps G52 and G92 in one place; of Fanuc's controllers parameters say what one does to the other.
    fn not_both_shifts(&self, asked: &Asked<'_>, word: &Word, local: bool) -> Result<(), Fault> {
        let holds = self.offsets.g92 != [0.0; COUNT];
        if !asked.rules.dialect.table().local_apart || !holds || self.offsets.local == local {
            return Ok(());
        }
        let (this, other) = if local {
            ("G52", "G92")
        } else {
            ("G92", "G52")
        };
        Err(unknown(
            word,
            &format!(
                "{this} while {other} is active: the result depends on a parameter of the controller"
            ),
            &format!("take {other} back before it"),
        ))
    }
}

/// G4: on Fanuc's controllers X or U is its time, no axis.
fn dwell(asked: &Asked<'_>, word: &Word) -> Result<(), Fault> {
    if !asked.rules.dialect.table().dwells_by_axis {
        return Ok(());
    }
    let times = b"XUP".iter().filter(|l| asked.word(**l).is_some()).count();
    if times == 1 && bits(asked.axes).all(|axis| matches!(axes::LETTERS[axis], b'X' | b'U')) {
        return Ok(());
    }
    Err(word.fault(
        "G4 waits for X, U or P, one of them alone",
        "write one time, and axes in another line",
    ))
}

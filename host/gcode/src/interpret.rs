//! From a line to what it does: LinuxCNC's order of execution, which is that of RS274/NGC.

mod arc;
mod asked;
mod cycle;
mod data;
mod endless_axes;
mod extrusion;
mod letters;
mod modes;
mod motion;
mod one_shot;
mod preconditions;
mod tool;

use super::axes::COUNT;
use super::codes::Machine;
use super::fault::{Fault, Kind};
use super::modal::Cutter;
use super::moves::Move;
use super::offsets::Number;
use super::state::{Rules, State};
use super::words::{Block, Word};
use asked::Asked;
pub(super) use endless_axes::word_of_wrapped;
pub(super) use motion::offset_in_doubt;

/// What a line does.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Step {
    /// The motion that is corrected.
    pub motion: Option<Move>,
    /// Words of axes that say where the machine is: G92 (`None`), G10 L20 (the system).
    pub reference: Option<Option<Number>>,
    /// Motion that passes as it is: G28, G30, probing, a tool change that moves.
    pub passed: Option<&'static str>,
    /// Tool-centre-point control goes on or off, before the motion.
    pub tip: Option<bool>,
    /// Words that belong behind the motion: M0, M1, M60, M2, M30 …
    pub after: bool,
    /// Words of axes (bits) that the machine does not have, which stay where they are.
    pub others: u16,
    /// What a printer extrudes, in units of the program, if that is known.
    pub extruded: Option<f64>,
    /// It is the last line.
    pub ends: bool,
}

impl State {
    /// Does a line.
    ///
    /// # Errors
    /// What cannot be done; the state is then of no use any more.
    pub fn step(&mut self, block: &Block, rules: &Rules) -> Result<Step, Fault> {
        let mut step = Step::default();
        self.step_into(block, rules, &mut step)?;
        Ok(step)
    }

    /// Interprets a line into an empty step in its place.
    pub(super) fn step_into(
        &mut self,
        block: &Block,
        rules: &Rules,
        step: &mut Step,
    ) -> Result<(), Fault> {
        self.ended |= block.percent && self.begun;
        if let Some(command) = block.command {
            self.begun = true;
            self.command_of_printer(command, rules, step);
            return Ok(());
        }
        if self.ended || block.words.is_empty() || block.percent {
            return Ok(());
        }
        self.begun = true;
        if is_skipped(block, rules)? {
            return Ok(());
        }
        let mut asked = Asked::read(block, rules)?;
        self.feed_and_tool(&asked, step)?;
        self.set_modes(&asked, step)?;
        self.letters(&asked)?;
        self.extrude(&asked, step);
        let named = asked.free;
        self.pass_others(&mut asked)?;
        step.others = named & !asked.free;
        self.do_once(&asked, step)?;
        if asked.free | step.others != asked.axes {
            asked.refuse_motion()?;
        }
        self.do_motion(&asked, step)?;
        if step.motion.is_some() {
            self.moved_under_cutter();
        }
        step.ends = block.ends(rules.dialect);
        self.ended |= step.ends;
        Ok(())
    }

    /// Notes what cutter compensation does with a motion: the first one after a change leads in or out.
    fn moved_under_cutter(&mut self) {
        self.under = match (self.cutter, self.cutter_changes) {
            (_, true) => Cutter::Changes,
            (true, false) => Cutter::On,
            (false, false) => Cutter::Off,
        };
        self.cutter_changes = false;
    }
}

impl State {
    /// What a line with a motion does before it: feed, tools, modes and offsets.
    ///
    /// # Errors
    /// Those of the line.
    pub fn modes(&mut self, block: &Block, rules: &Rules) -> Result<Step, Fault> {
        let mut step = Step::default();
        let asked = Asked::read(block, rules)?;
        self.feed_and_tool(&asked, &mut step)?;
        self.set_modes(&asked, &mut step)?;
        Ok(step)
    }
}

/// True if the switch for lines after `/` leaves a line out.
fn is_skipped(block: &Block, rules: &Rules) -> Result<bool, Fault> {
    match rules.block_delete {
        _ if !block.deleted => Ok(false),
        Some(skips) => Ok(skips),
        None if is_neutral(block, rules) => Ok(false),
        None => Err(Fault::new(
            0..block.end,
            "a line after `/`: a switch of the controller decides whether it runs",
            "pass the position of the switch: --block-delete on or off",
        )),
    }
}

/// A word that cannot be done, or not yet.
fn unknown(word: &Word, text: &str, remedy: &str) -> Fault {
    word.fault(text, remedy).kind(Kind::Word)
}

/// Bits that are set, as numbers.
pub(super) fn bits(mask: u16) -> impl Iterator<Item = usize> {
    let mut left = mask & ((1 << COUNT) - 1);
    std::iter::from_fn(move || {
        let first = left.trailing_zeros() as usize;
        left &= left.wrapping_sub(1);
        (first < COUNT).then_some(first)
    })
}

/// A whole number that is not negative.
fn whole(word: &Word) -> Result<u32, Fault> {
    if word.value >= 0.0 && word.value.fract() == 0.0 && word.value < 1e8 {
        return Ok(word.value as u32);
    }
    Err(word.fault("no whole number", "write one that is not negative"))
}

/// True if nothing in the line moves anything or changes a mode.
pub(super) fn is_neutral(block: &Block, rules: &Rules) -> bool {
    block.words.iter().all(|word| match word.letter {
        b'N' | b'S' => true,
        _ => word.machine(rules.dialect) == Some(Machine::Neutral),
    })
}

//! Positions and modes that a word requires.

use super::{Asked, bits, unknown};
use crate::axes;
use crate::fault::Fault;
use crate::modal::{Distance, Retract, Units};
use crate::offsets::{System, system_name};
use crate::state::{Lost, Rules, State};
use crate::words::{Block, Word};
use std::ops::Range;

impl State {
    /// A position that is needed and not known.
    pub(crate) fn not_known(&self, rules: &Rules, word: &Word, axis: usize) -> Fault {
        self.position_not_known(rules, word.span(), axis)
    }

    /// Like `not_known`, at the first word of an axis.
    pub(super) fn missing(&self, asked: &Asked<'_>, axis: usize) -> Fault {
        self.position_not_known(asked.rules, asked.block.axis_span(), axis)
    }

    fn position_not_known(&self, rules: &Rules, span: Range<usize>, axis: usize) -> Fault {
        let letter = axes::name(axis);
        let (after, remedy) = match self.lost[axis] {
            None => (String::new(), start_remedy(rules, letter)),
            Some(lost) => {
                let (what, remedy) = behind(lost, letter);
                (format!(" after {what}"), remedy)
            }
        };
        Fault::new(
            span,
            format!("the position of {letter} is unknown here{after}"),
            remedy,
        )
    }

    /// The system, where it must be known.
    pub(super) fn needs_system(&self, word: &Word) -> Result<&System, Fault> {
        self.offsets.active().ok_or_else(|| {
            let name = system_name(self.offsets.selected());
            word.fault(
                format!("the offset of {name} is unknown"),
                format!("give it in the setup: [offset.\"{name}\"] X = …, Y = …, Z = …"),
            )
        })
    }

    /// G20 or G21, where it must be known.
    pub(crate) fn needs_units(&self, span: Range<usize>) -> Result<Units, Fault> {
        self.units.ok_or_else(|| {
            Fault::new(
                span,
                "mm or inches is unknown here",
                "write G20 or G21 before it, or give the setup with its units",
            )
        })
    }

    /// G90 or G91, where it must be known.
    pub(super) fn needs_distance(&self, block: &Block) -> Result<Distance, Fault> {
        self.distance.ok_or_else(|| {
            block.fault(
                "absolute or incremental is unknown here",
                "write G90 or G91 before it",
            )
        })
    }

    /// G98 or G99, where it must be known.
    pub(super) fn needs_retract(&self, block: &Block) -> Result<Retract, Fault> {
        self.retract.ok_or_else(|| {
            block.fault("a cycle, and neither G98 nor G99 before it: to which level it returns depends on the program that ran \
                 before",
                "write G98 (to the level before the cycle) or G99 (to R) before it, or give the setup [start] retract",
            )
        })
    }

    /// Tool-centre-point control must be off.
    pub(super) fn not_with_tip(&self, word: &Word) -> Result<(), Fault> {
        if !self.tip {
            return Ok(());
        }
        Err(unknown(
            word,
            "this word under tool-centre-point control",
            "switch tool-centre-point control off before it",
        ))
    }
}

/// How to give an axis a position before the first line.
fn start_remedy(rules: &Rules, letter: char) -> String {
    let of: String = bits(rules.axes)
        .map(axes::name)
        .flat_map(|l| [' ', l])
        .collect();
    let machine = match rules.machine.as_str() {
        "" => String::new(),
        name => format!("; the compensation is for the axes{of} of {name}"),
    };
    format!("give it in the setup, [start] {letter} = …, or command {letter} before{machine}")
}

/// After what the position of an axis is unknown, and the remedy.
fn behind(lost: Lost, letter: char) -> (&'static str, String) {
    let move_first =
        format!("move {letter} to a known place first: G0 {letter}…, or G53 G0 {letter}…");
    match lost {
        Lost::Home(home) => {
            let home = ["G28", "G30"][home];
            let remedy = format!("give the setup where {home} goes: [home.{home}] {letter} = …");
            (home, remedy)
        }
        Lost::Probed => ("probing", move_first),
        Lost::Turned => (
            "G28, G30 or probing under a rotation",
            format!("move {letter} to a known place first: G53 G0 {letter}…"),
        ),
        Lost::Reference => ("G30 to another point than its second", move_first),
        Lost::Command => (
            "a command that homes, probes or parks",
            format!("move {letter} to a known place after it: G1 {letter}… under G90"),
        ),
        Lost::ToolOffset => (
            "G43 or G49 without an absolute Z",
            "write Z in that line, under G90: some controllers move by the offset there, others do not"
                .to_owned(),
        ),
        Lost::ToolChange => (
            "a tool change",
            format!(
                "give the setup where it goes: [tool_change] {letter} = …, or move {letter} to a known place first"
            ),
        ),
    }
}

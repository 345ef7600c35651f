//! What must be known, or off, for a word to be done.

use super::unknown;
use crate::gcode::axes;
use crate::gcode::fault::Fault;
use crate::gcode::modal::{Distance, Units};
use crate::gcode::offsets::{System, system_name};
use crate::gcode::state::State;
use crate::gcode::words::{Block, Word};
use std::ops::Range;

/// A position that is needed and not known.
pub fn not_known(word: &Word, axis: usize) -> Fault {
    let letter = axes::name(axis);
    Fault::new(
        word.span(),
        format!("the position of {letter} is not known here"),
        format!("command {letter} before, or give it in the setup: [start] {letter} = …"),
    )
}

/// The first word of an axis, or the line.
pub(super) fn axis_span(block: &Block) -> Range<usize> {
    first_axis(block).map_or(0..block.end, Word::span)
}

/// The first word of an axis.
pub(super) fn first_axis(block: &Block) -> Option<&Word> {
    block.words.iter().find(|w| axes::index(w.letter).is_some())
}

/// The same as [`not_known`], at the first word of an axis.
pub(super) fn missing(block: &Block, axis: usize) -> Fault {
    match first_axis(block) {
        Some(word) => not_known(word, axis),
        None => Fault::new(
            0..block.end,
            format!("the position of {} is not known here", axes::name(axis)),
            "give it in the setup",
        ),
    }
}

impl State {
    /// The system, where it must be known.
    pub(super) fn needs_system(&self, word: &Word) -> Result<&System, Fault> {
        self.offsets.active().ok_or_else(|| {
            let name = system_name(self.offsets.selected());
            Fault::new(
                word.span(),
                format!("the offset of {name} is not known"),
                format!("give it in the setup: [offset.\"{name}\"] X = …, Y = …, Z = …"),
            )
        })
    }

    /// G20 or G21, where it must be known.
    pub fn needs_units(&self, span: Range<usize>) -> Result<Units, Fault> {
        self.units.ok_or_else(|| {
            Fault::new(
                span,
                "mm or inches: that is not known here",
                "write G20 or G21 before it, or give the setup with its units",
            )
        })
    }

    /// G90 or G91, where it must be known.
    pub(super) fn needs_distance(&self, block: &Block) -> Result<Distance, Fault> {
        self.distance.ok_or_else(|| {
            Fault::new(
                axis_span(block),
                "absolute or incremental: that is not known here",
                "write G90 or G91 before it",
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

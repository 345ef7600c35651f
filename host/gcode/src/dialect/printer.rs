//! Printers: Marlin, Prusa's firmware, Klipper and RepRapFirmware.
//!
//! What begins with another word than a G that moves is not read (`words/printer.rs`).

use super::{AfterEnd, Table};
use crate::codes::{Code, Machine};
use crate::modal::Distance;

const OWN: &[(u16, Code)] = &[(901, Code::ArcDistance(Distance::Absolute))];

const OWN_M: &[(u16, Machine)] = &[
    (820, Machine::Extruder(Distance::Absolute)),
    (830, Machine::Extruder(Distance::Incremental)),
];

pub const TABLE: Table = Table {
    g: &[OWN],
    m: &[OWN_M],
    // MAX_CMD_SIZE of Marlin is 96, with a zero at the end; comments are left out while it reads.
    longest_line: 95,
    counts_words_alone: true,
    after_end: AfterEnd::Run,
    feed_counts_all: false,
    spiral: [0.05; 2],
    arcs_have_turns: false,
    printer: true,
    ..Table::PLAIN
};

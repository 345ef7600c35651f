//! Haas, milling: Fanuc's words, and a maker's own whose meaning is the same on every machine.

use super::{CUTTER, CYCLES, LOCAL, SPINDLE, TAPPING, Table, WAITING, fanuc};
use crate::codes::Code;

const OWN: &[(u16, Code)] = &[(2340, Code::TipOn)];

pub const TABLE: Table = Table {
    g: &[OWN, fanuc::OWN, CUTTER, LOCAL, CYCLES, TAPPING, SPINDLE],
    // Beside those of Fanuc's, how many blocks it looks ahead, and how smoothly it goes.
    path: &[90, 611, 620, 630, 1030, 1870],
    m: &[WAITING],
    // Brakes of rotary axes, chips, coolant, air.
    neutral: &[
        100, 110, 120, 130, 190, 290, 310, 330, 340, 350, 830, 840, 880, 890,
    ],
    ..fanuc::TABLE
};

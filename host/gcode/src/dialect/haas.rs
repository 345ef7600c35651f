//! Haas, milling: Fanuc's words, and a maker's own whose meaning is the same on every machine.

use super::{Table, fanuc};
use crate::codes::{Code, Group, Machine};

/// Beside those of Fanuc's.
const OWN_G: [(u16, Code); 3] = [
    (2340, Code::TipOn),
    // How many blocks it looks ahead, and how smoothly it goes.
    (1030, Code::Neutral(Group::Path)),
    (1870, Code::Neutral(Group::Path)),
];

const OWN_M: [(u16, Machine); 16] = [
    (50, Machine::After),
    (90, Machine::After),
    // Brakes of rotary axes.
    (100, Machine::Neutral),
    (110, Machine::Neutral),
    (120, Machine::Neutral),
    (130, Machine::Neutral),
    (190, Machine::Neutral),
    (290, Machine::Neutral),
    // Chips, coolant, air.
    (310, Machine::Neutral),
    (330, Machine::Neutral),
    (340, Machine::Neutral),
    (350, Machine::Neutral),
    (830, Machine::Neutral),
    (840, Machine::Neutral),
    (880, Machine::Neutral),
    (890, Machine::Neutral),
];

const G: [(u16, Code); fanuc::G.len() + OWN_G.len()] = {
    let mut all = [OWN_G[0]; fanuc::G.len() + OWN_G.len()];
    let mut k = 0;
    while k < all.len() {
        all[k] = match k < OWN_G.len() {
            true => OWN_G[k],
            false => fanuc::G[k - OWN_G.len()],
        };
        k += 1;
    }
    all
};

pub const TABLE: Table = Table {
    g: &G,
    m: &OWN_M,
    ..fanuc::TABLE
};

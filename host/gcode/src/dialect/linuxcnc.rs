//! LinuxCNC, and those that read its language.

use super::{
    CUTTER, CYCLES, FeedUnit, LOCAL, NAMED_TIP, SPINDLE, STORED_AND_PROBED, TAPPING, THREE_SYSTEMS,
    Table, Wrapping,
};
use crate::codes::{Code, Machine};
use crate::modal::{Distance, Units};

/// Words may have two decimals, or three.
const SPIRAL: [f64; 2] = [
    0.02 * std::f64::consts::SQRT_2,
    0.0508 * std::f64::consts::SQRT_2,
];

const OWN: &[(u16, Code)] = &[
    (330, Code::Threading(330)),
    (331, Code::Threading(331)),
    (411, Code::Cutter(true)),
    (421, Code::Cutter(true)),
    // Mach's, without the words of a lathe's cycles.
    (700, Code::Units(Units::Inch)),
    (710, Code::Units(Units::Millimetre)),
    (901, Code::ArcDistance(Distance::Absolute)),
    (922, Code::Shift(2)),
    (923, Code::Shift(3)),
];

const OWN_M: &[(u16, Machine)] = &[
    (610, Machine::ToolNumber),
    (4280, Machine::Tip(true)),
    (4290, Machine::Tip(false)),
];

pub const TABLE: Table = Table {
    g: &[
        OWN,
        STORED_AND_PROBED,
        THREE_SYSTEMS,
        CUTTER,
        LOCAL,
        CYCLES,
        TAPPING,
        SPINDLE,
    ],
    path: &[611],
    m: &[OWN_M, NAMED_TIP],
    neutral: &[
        50, 90, 190, 480, 490, 500, 510, 520, 530, 620, 630, 640, 650, 660, 670, 680,
    ],
    feed_counts_all: false,
    feed_unit: FeedUnit::Before,
    spiral: SPIRAL,
    wrapping: Wrapping::Sign,
    systems_turn: true,
    sets_tools: true,
    g86_waits: true,
    g89_feeds_to_level: true,
    cycles_need_g40: true,
    cutter_has_l: true,
    g43_takes_spindle: true,
    ..Table::PLAIN
};

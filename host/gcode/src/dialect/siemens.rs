//! Sinumerik in its own language, milling: G words, arcs by I, J, K or CR=, tools by number or name.

use super::{AfterEnd, CUTTER, FeedUnit, NAMED_TIP, SPINDLE, Table, WAITING};
use crate::codes::{Code, Group, Machine};
use crate::modal::Units;

const OWN: &[(u16, Code)] = &[
    (1530, Code::MachineCoordinates),
    // G70 and G71 are of lengths alone, G700 and G710 of feeds too.
    (700, Code::Units(Units::Inch)),
    (710, Code::Units(Units::Millimetre)),
    (7000, Code::Units(Units::Inch)),
    (7100, Code::Units(Units::Millimetre)),
    (4500, Code::Neutral(Group::Spindle)),
    (4510, Code::Neutral(Group::Spindle)),
];

pub const TABLE: Table = Table {
    g: &[OWN, CUTTER, SPINDLE],
    path: &[90, 600, 601, 602, 6010, 6020, 6410, 6420, 6430, 6440, 6450],
    m: &[&[(170, Machine::End)], WAITING, NAMED_TIP],
    neutral: &[190],
    longest_line: 512,
    has_names: true,
    chooses_d: true,
    feed_unit: FeedUnit::Before,
    after_end: AfterEnd::Another,
    arcs_have_turns: false,
    may_wrap: true,
    tool_change_moves: true,
    ..Table::PLAIN
};

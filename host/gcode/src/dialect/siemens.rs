//! Sinumerik in its own language, milling: G words, arcs by I, J, K or CR=, tools by number or name.

use super::{AfterEnd, FeedUnit, Table};
use crate::codes::{Code, Group, Machine};
use crate::modal::{FeedMode, Units};

const G: &[(u16, Code)] = &[
    (410, Code::Cutter(true)),
    (420, Code::Cutter(true)),
    (1530, Code::MachineCoordinates),
    // G70 and G71 are of lengths alone, G700 and G710 of feeds too.
    (700, Code::Units(Units::Inch)),
    (710, Code::Units(Units::Millimetre)),
    (7000, Code::Units(Units::Inch)),
    (7100, Code::Units(Units::Millimetre)),
    (90, Code::Neutral(Group::Path)),
    (600, Code::Neutral(Group::Path)),
    (601, Code::Neutral(Group::Path)),
    (602, Code::Neutral(Group::Path)),
    (6010, Code::Neutral(Group::Path)),
    (6020, Code::Neutral(Group::Path)),
    (6410, Code::Neutral(Group::Path)),
    (6420, Code::Neutral(Group::Path)),
    (6430, Code::Neutral(Group::Path)),
    (6440, Code::Neutral(Group::Path)),
    (6450, Code::Neutral(Group::Path)),
    (4500, Code::Neutral(Group::Spindle)),
    (4510, Code::Neutral(Group::Spindle)),
    (950, Code::Feed(FeedMode::PerRevolution)),
    (960, Code::Neutral(Group::Spindle)),
    (970, Code::Neutral(Group::Spindle)),
];

const M: &[(u16, Machine)] = &[
    (50, Machine::After),
    (90, Machine::After),
    (170, Machine::End),
    (190, Machine::Neutral),
    // TRAORI and TRAFOOF.
    (4289, Machine::Tip(true)),
    (4299, Machine::Tip(false)),
];

pub const TABLE: Table = Table {
    g: G,
    m: M,
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

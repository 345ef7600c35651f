//! Fanuc, Mitsubishi, Centroid and their kin, milling.

use super::{AfterEnd, Table, Wrapping};
use crate::codes::{Code, Group, Length, Machine};
use crate::modal::{FeedMode, Motion, Retract};

pub(super) const G: &[(u16, Code)] = &[
    (410, Code::Cutter(true)),
    (420, Code::Cutter(true)),
    (520, Code::Local),
    (434, Code::TipOn),
    // G154 is Haas's.
    (541, Code::System(100)),
    (1540, Code::System(100)),
    (90, Code::Neutral(Group::Path)),
    (50, Code::LookAhead(b'P', 10_000)),
    (51, Code::LookAhead(b'Q', 1)),
    (54, Code::LookAhead(b'Q', 1)),
    (80, Code::LookAhead(b'P', 1)),
    // How fast corners are taken: Mitsubishi's high accuracy, less feed inside corners, tapping.
    (611, Code::Neutral(Group::Path)),
    (620, Code::Neutral(Group::Path)),
    (630, Code::Neutral(Group::Path)),
    // What ends scaling, mirrors, polar coordinates, modal macros and rotations, none of which may have begun.
    (150, Code::Neutral(Group::Turn)),
    (500, Code::Neutral(Group::Turn)),
    (501, Code::Neutral(Group::Turn)),
    (670, Code::Neutral(Group::Turn)),
    (690, Code::Neutral(Group::Turn)),
    (730, Code::Motion(Motion::Cycle(730))),
    (810, Code::Motion(Motion::Cycle(810))),
    (820, Code::Motion(Motion::Cycle(820))),
    (830, Code::Motion(Motion::Cycle(830))),
    (850, Code::Motion(Motion::Cycle(850))),
    (860, Code::Motion(Motion::Cycle(860))),
    (890, Code::Motion(Motion::Cycle(890))),
    (980, Code::Retract(Retract::Initial)),
    (990, Code::Retract(Retract::Plane)),
    (950, Code::Feed(FeedMode::PerRevolution)),
    (960, Code::Neutral(Group::Spindle)),
    (970, Code::Neutral(Group::Spindle)),
    (430, Code::ToolLength(Length::OfTool)),
    (740, Code::Motion(Motion::Cycle(740))),
    (840, Code::Motion(Motion::Cycle(840))),
];

const M: &[(u16, Machine)] = &[
    (50, Machine::After),
    (90, Machine::After),
    (190, Machine::Neutral),
    (290, Machine::Neutral),
    // TRAORI and TRAFOOF.
    (4289, Machine::Tip(true)),
    (4299, Machine::Tip(false)),
];

pub const TABLE: Table = Table {
    g: G,
    m: M,
    longest_line: 200,
    needs_points: true,
    // IS-B.
    decimals: Some(3),
    calls: true,
    semicolon_ends_block: true,
    after_end: AfterEnd::Another,
    arcs_have_turns: false,
    wrapping: Wrapping::Shorter,
    may_wrap: true,
    further_systems: true,
    local_apart: true,
    dwells_by_axis: true,
    homes_beside_motion: true,
    cycles_apart: true,
    keeps_levels: true,
    repeats_by_k: true,
    chooses_d: true,
    h0_is_none: true,
    doubts_tool_offset: true,
    tool_change_moves: true,
    ..Table::PLAIN
};

//! Fanuc, Mitsubishi, Centroid and their kin, milling.

use super::{
    AfterEnd, CUTTER, CYCLES, LOCAL, NAMED_TIP, SPINDLE, TAPPING, Table, WAITING, Wrapping,
};
use crate::codes::Code;

pub(super) const OWN: &[(u16, Code)] = &[
    (434, Code::TipOn),
    // G154 is Haas's.
    (541, Code::System(100)),
    (1540, Code::System(100)),
    (50, Code::LookAhead(b'P', 10_000)),
    (51, Code::LookAhead(b'Q', 1)),
    (54, Code::LookAhead(b'Q', 1)),
    (80, Code::LookAhead(b'P', 1)),
];

pub const TABLE: Table = Table {
    g: &[OWN, CUTTER, LOCAL, CYCLES, TAPPING, SPINDLE],
    // How fast corners are taken: Mitsubishi's high accuracy, less feed inside corners, tapping.
    path: &[90, 611, 620, 630],
    m: &[WAITING, NAMED_TIP],
    neutral: &[190, 290],
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

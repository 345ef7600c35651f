//! LinuxCNC, and those that read its language.

use super::{FeedUnit, Table, Wrapping};
use crate::codes::{Code, Group, Length, Machine};
use crate::modal::{Distance, FeedMode, Motion, Retract, Units};

/// Words may have two decimals, or three.
const SPIRAL: [f64; 2] = [
    0.02 * std::f64::consts::SQRT_2,
    0.0508 * std::f64::consts::SQRT_2,
];

const G: &[(u16, Code)] = &[
    (281, Code::StoreHome(0)),
    (301, Code::StoreHome(1)),
    (382, Code::Probe),
    (383, Code::Probe),
    (384, Code::Probe),
    (385, Code::Probe),
    (431, Code::ToolLength(Length::OfWords)),
    (330, Code::Threading(330)),
    (331, Code::Threading(331)),
    (410, Code::Cutter(true)),
    (420, Code::Cutter(true)),
    (520, Code::Local),
    (411, Code::Cutter(true)),
    (421, Code::Cutter(true)),
    (591, Code::System(7)),
    (592, Code::System(8)),
    (593, Code::System(9)),
    (611, Code::Neutral(Group::Path)),
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
    // Mach's, without the words of a lathe's cycles.
    (700, Code::Units(Units::Inch)),
    (710, Code::Units(Units::Millimetre)),
    (901, Code::ArcDistance(Distance::Absolute)),
    (922, Code::Shift(2)),
    (923, Code::Shift(3)),
];

const M: &[(u16, Machine)] = &[
    (50, Machine::Neutral),
    (90, Machine::Neutral),
    (190, Machine::Neutral),
    (480, Machine::Neutral),
    (490, Machine::Neutral),
    (500, Machine::Neutral),
    (510, Machine::Neutral),
    (520, Machine::Neutral),
    (530, Machine::Neutral),
    (610, Machine::ToolNumber),
    (620, Machine::Neutral),
    (630, Machine::Neutral),
    (640, Machine::Neutral),
    (650, Machine::Neutral),
    (660, Machine::Neutral),
    (670, Machine::Neutral),
    (680, Machine::Neutral),
    (4280, Machine::Tip(true)),
    (4290, Machine::Tip(false)),
    // TRAORI and TRAFOOF.
    (4289, Machine::Tip(true)),
    (4299, Machine::Tip(false)),
];

pub const TABLE: Table = Table {
    g: G,
    m: M,
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

//! grblHAL.

use super::{AfterEnd, FeedUnit, Table};
use crate::codes::{Code, Group, Length, Machine};
use crate::modal::{FeedMode, Motion, Retract};

const G: &[(u16, Code)] = &[
    (281, Code::StoreHome(0)),
    (301, Code::StoreHome(1)),
    (382, Code::Probe),
    (383, Code::Probe),
    (384, Code::Probe),
    (385, Code::Probe),
    (431, Code::ToolLength(Length::OfWords)),
    (591, Code::System(7)),
    (592, Code::System(8)),
    (593, Code::System(9)),
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
];

const M: &[(u16, Machine)] = &[(50, Machine::Neutral), (90, Machine::Neutral)];

pub const TABLE: Table = Table {
    g: G,
    m: M,
    after_end: AfterEnd::Run,
    starts_in: Some(Motion::Rapid),
    asks: true,
    feed_unit: FeedUnit::After,
    ..Table::PLAIN
};

//! Grbl 1.1.

use super::{AfterEnd, FeedUnit, Table};
use crate::codes::{Code, Length, Machine};
use crate::modal::Motion;

const G: &[(u16, Code)] = &[
    (281, Code::StoreHome(0)),
    (301, Code::StoreHome(1)),
    (382, Code::Probe),
    (383, Code::Probe),
    (384, Code::Probe),
    (385, Code::Probe),
    (431, Code::ToolLength(Length::OfWords)),
];

const M: &[(u16, Machine)] = &[(50, Machine::Neutral), (90, Machine::Neutral)];

pub const TABLE: Table = Table {
    g: G,
    m: M,
    longest_line: 79,
    counts_words_alone: true,
    after_end: AfterEnd::Run,
    starts_in: Some(Motion::Rapid),
    asks: true,
    feed_unit: FeedUnit::After,
    g80_beside_motion: false,
    ..Table::PLAIN
};

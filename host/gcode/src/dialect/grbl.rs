//! Grbl 1.1.

use super::{AfterEnd, FeedUnit, STORED_AND_PROBED, Table};
use crate::modal::Motion;

pub const TABLE: Table = Table {
    g: &[STORED_AND_PROBED],
    neutral: &[50, 90],
    longest_line: 79,
    counts_words_alone: true,
    after_end: AfterEnd::Run,
    starts_in: Some(Motion::Rapid),
    asks: true,
    feed_unit: FeedUnit::After,
    g80_beside_motion: false,
    ..Table::PLAIN
};

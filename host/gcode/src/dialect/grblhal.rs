//! grblHAL.

use super::{AfterEnd, CYCLES, FeedUnit, SPINDLE, STORED_AND_PROBED, THREE_SYSTEMS, Table};
use crate::modal::Motion;

pub const TABLE: Table = Table {
    g: &[STORED_AND_PROBED, THREE_SYSTEMS, CYCLES, SPINDLE],
    neutral: &[50, 90],
    after_end: AfterEnd::Run,
    starts_in: Some(Motion::Rapid),
    asks: true,
    feed_unit: FeedUnit::After,
    ..Table::PLAIN
};

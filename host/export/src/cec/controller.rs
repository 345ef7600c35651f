//! Capacities of controllers.

/// Numbers of tables and points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TableLimits {
    /// Number of the first table that may be written.
    pub first: usize,
    /// Tables, numbered from 0.
    pub tables: usize,
    /// Values per table, if the controller limits them.
    pub points: Option<usize>,
}

impl TableLimits {
    /// The 840D: two tables for each axis of the controller, which has at most 31. MD18342 sets the number of values
    /// of each table.
    pub const SINUMERIK_840D: Self = Self {
        first: 0,
        tables: 62,
        points: None,
    };
    /// The 828D.
    pub const SINUMERIK_828D: Self = Self {
        first: 0,
        tables: 8,
        points: Some(200),
    };
}

//! What a controller holds.

/// Tables and points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Number of the first table that may be written.
    pub first: usize,
    /// Tables, numbered from 0.
    pub tables: usize,
    /// Values of a table, if it is the controller that limits them.
    pub points: Option<usize>,
}

impl Limits {
    /// The 840D: two tables for each axis of the controller, of which it has at most 31; how many values is
    /// set for each table by MD18342.
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

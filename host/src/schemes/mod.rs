//! Schemes: from errors to tables.

pub mod exact;

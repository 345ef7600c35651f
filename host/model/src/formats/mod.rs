//! Tables of numbers as text: CSV, units, measured motions.

pub mod csv;
pub mod measured;
pub mod units;

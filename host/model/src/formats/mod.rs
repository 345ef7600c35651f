//! Tables of numbers as text: cells, units, measured motions.

pub mod cells;
pub mod measured;
pub mod units;

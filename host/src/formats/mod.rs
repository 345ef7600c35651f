//! Files that other programs read and write.

mod cells;
pub mod measured;
pub mod positions;

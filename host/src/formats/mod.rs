//! Files that other programs read and write.

mod cells;
pub mod hal;
pub mod ini;
pub mod measured;
pub mod positions;

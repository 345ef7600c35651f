//! Files that other programs read and write.

pub mod artefact;
mod cells;
pub mod covariance;
pub mod hal;
pub mod ini;
pub mod measured;
pub mod positions;
pub mod probings;

//! Files that other programs read and write.

pub mod artefact;
pub(crate) mod cells;
pub mod covariance;
pub mod hal;
pub mod ini;
pub mod measured;
pub mod positions;
pub mod probings;
pub mod radii;
pub mod runs;
pub(crate) mod units;

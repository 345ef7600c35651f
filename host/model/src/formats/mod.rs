//! Files of numbers: positions, measured motions, covariances.

pub mod cells;
pub mod covariance;
pub mod measured;
pub mod positions;
pub mod units;

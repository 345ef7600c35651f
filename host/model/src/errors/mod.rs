//! Geometric errors of the axes: ISO 230-1 parameters and their file.

pub mod covariance;
mod file;
mod model;

pub use covariance::Covariance;
pub use model::{ErrorModel, Motion, Table, Thermal, in_three_digits, temperature_name};
pub use trueaxis_kinematics::{MAX_SENSORS, Parameter, ParameterKind, Situation, Switches};

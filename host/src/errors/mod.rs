//! Geometric errors of the axes: ISO 230-1 parameters and what they do along the travel.

mod file;
mod model;
mod parameter;

pub use model::{ErrorModel, MAX_SENSORS, Motion, Situation, Switches, Thermal};
pub use parameter::{Parameter, ParameterKind};

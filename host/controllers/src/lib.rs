//! Interfaces to controllers: programs in G-code, tables of a Sinumerik, configurations of LinuxCNC, the link to a
//! board, compensations on trial.
//!
//! Builds on `trueaxis-model` and `trueaxis-tables`.
#![forbid(unsafe_code)]

pub mod cec;
pub mod formats;
pub mod gcode;
pub mod link;
pub mod linuxcnc;
mod positions;
pub mod skew;
pub mod trial;

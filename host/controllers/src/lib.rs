//! Interfaces to controllers: tables of a Sinumerik, configurations of LinuxCNC, the link to a
//! board, compensations on trial.
//!
//! Builds on `trueaxis-model` and `trueaxis-tables`.
#![forbid(unsafe_code)]

pub mod cec;
pub mod difference;
pub mod fanuc;
pub mod formats;
pub mod heidenhain;
pub mod height_map;
pub mod isg;
pub mod klipper;
pub mod link;
pub mod linuxcnc;
mod positions;
pub mod reprapfirmware;
pub mod rigid_body;
pub mod sampled;
pub mod skew;
pub mod surface;
mod text_lines;
pub mod trial;

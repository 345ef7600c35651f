//! Interfaces to controllers: tables of a Sinumerik, configurations of LinuxCNC, the link to a
//! board, compensations on trial.
//!
//! Builds on `trueaxis-model` and `trueaxis-tables`.

// Modules, most of which use only those before them: `cec` · `positions`, `sampled` (a compensation on a grid of fewer
// axes), `difference` (what a file leaves of it) · `fanuc` · `rigid_body` (the machine as controls with a model of it
// see it), `isg`, `heidenhain` · `height_map`, `klipper`, `reprapfirmware`, `skew` (printers) · `linuxcnc` with
// `formats`, `comp_file` and `session` (a LinuxCNC that is running) · `link` · `trial` (a compensation until it is
// judged).

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

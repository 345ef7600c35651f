//! From a compensation to the formats of controllers and printers, each read again and compared with it; and from such
//! files to error parameters.
//!
//! Builds on `trueaxis-model`.

// Modules, most of which use only those before them: `cec` · `positions`, `sampled` (a compensation on a grid of fewer
// axes), `difference` (what a file leaves of it) · `fanuc` · `rigid_body` (the machine as controls with a model of it
// see it), `isg`, `heidenhain` · `height_map`, `klipper`, `reprapfirmware`, `surface`, `skew` (printers and routers).

#![forbid(unsafe_code)]

pub use refused::NotExported;

pub mod cec;
pub mod difference;
pub mod fanuc;
pub mod heidenhain;
pub mod height_map;
pub mod isg;
pub mod klipper;
pub mod positions;
#[cfg(test)]
mod refusals;
mod refused;
pub mod reprapfirmware;
pub mod rigid_body;
pub mod sampled;
pub mod skew;
pub mod surface;
mod text_lines;

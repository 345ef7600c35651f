//! From runs of lasers, straightedges, levels, calibrators and squares to error motions and locations, and from
//! readings of a ball-bar to circles and spheres; analyses by ISO 230-2, -3, -4 and -7.
//!
//! The reading of an instrument on a machine with errors comes from the same
//! [`Bench`](trueaxis_model::explain::Bench) that `explain` uses, with exact poses. The errors are solved for so
//! that they reproduce the measurements. So no sign convention is coded here, and the lever of the measured line
//! (Abbe) is included, as are all errors that are already known.
//!
//! Everything begins with [`formats`] and [`solve`](fn@solve). Builds on `trueaxis-model`.

// Modules that others build on: `iso230_2`, `iso230_3`, `iso230_7` · `ballbar` (ISO 230-4) · `formats` (files of their
// readings) · `simulate` (runs and ball-bars on a machine with known errors).

#![forbid(unsafe_code)]

pub mod ballbar;
mod block;
mod direct_error;
mod error_file;
pub mod formats;
pub mod iso230_2;
pub mod iso230_3;
pub mod iso230_7;
mod kept;
mod measurement;
mod motion;
mod outlying;
mod record;
mod simple;
pub mod simulate;
mod single;
mod solve;
mod square;
mod warnings;

pub use direct_error::DirectError;
pub use error_file::{error_file, tables};
pub use kept::{kept, same_tables};
pub use measurement::{
    AxisRuns, Means, MeasuredRuns, Measurement, MeasurementSetup, RunColumn, Square,
};
pub use motion::FoundMotion;
pub use record::{DirectRecord, LocationRecord, MotionRecord, SlopeRecord, warnings};
pub use simple::{Growth, ReadingError, simple_error_file, without_readings};
pub use single::Single;
pub use solve::{DirectResult, FoundLocation, SolveOptions, solve};
pub use warnings::{Doubt, counted_twice, of_readings};

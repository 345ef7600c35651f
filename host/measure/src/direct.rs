//! Direct measurements: from runs of lasers, straightedges, levels, calibrators and squares to error motions and
//! locations.
//!
//! The reading of an instrument on a machine with errors comes from the same
//! [`Bench`](trueaxis_model::explain::Bench) that `explain` uses, with exact poses. The errors are solved for so
//! that they reproduce the measurements. So no sign convention is coded here, and the lever of the measured line
//! (Abbe) is included, as are all errors that are already known.

mod block;
mod direct_error;
mod error_file;
pub mod iso230_2;
pub mod iso230_3;
pub mod iso230_7;
mod kept;
mod measurement;
mod motion;
mod record;
mod simple;
mod single;
mod solve;
mod square;
mod warnings;

pub use direct_error::DirectError;
pub use error_file::error_file;
pub(crate) use error_file::tables;
pub use kept::{kept, same_tables};
pub use measurement::{
    AxisRuns, Means, MeasuredRuns, Measurement, MeasurementSetup, RunColumn, Square,
};
pub use motion::FoundMotion;
pub use record::{DirectRecord, LocationRecord, MotionRecord, SlopeRecord, warnings};
pub use simple::{Growth, ReadingError, simple_error_file, without_readings};
pub use single::Single;
pub use solve::{DirectResult, FoundLocation, SolveOptions, solve};
pub use warnings::{Doubt, counted_twice, misread};

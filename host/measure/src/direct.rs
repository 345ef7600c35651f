//! Direct measurements: from runs of lasers, straightedges, levels, calibrators and squares to error
//! motions and locations.
//!
//! What an instrument shows of a machine with errors comes from the [`Bench`](trueaxis_model::explain::Bench) that
//! `explain` reads, with exact poses. Here errors are looked for that show what was measured: no sign is
//! written down, and the lever of the measured line (Abbe) is in it, as is everything that is known already.

mod block;
mod direct_error;
mod error_file;
pub mod iso230_2;
mod measurement;
mod motion;
mod solve;
mod square;
mod warnings;

pub use direct_error::DirectError;
pub use error_file::error_file;
pub use measurement::{Column, Line, Means, Measured, Measurement, Setup, Square};
pub use motion::FoundMotion;
pub use solve::{DirectResult, FoundLocation, Options, solve};
pub use warnings::{Doubt, counted_twice};

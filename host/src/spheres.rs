//! From the touches of a probe to the centres of balls.

mod fit;
mod log;

pub use fit::{Centre, FitError, Fitted, fit};
pub use log::{Found, Touched, read_log, to_probings};

//! From the touches of a probe to the centres of balls.

mod fit;
mod found;
mod log;
mod resumed;
mod strategy;

pub use fit::{Centre, FitError, Fitted, fit};
pub use found::{Found, to_probings};
pub use log::{Touched, read_log};

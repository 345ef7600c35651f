//! From the touches of a probe to the centres of balls.

mod fit;
mod log;
mod log_contents;
mod planned;
mod resumed;

pub(crate) use fit::start;
pub use fit::{Centre, FitError, FittedBalls, fit};
pub use log::{Touched, read_log};
pub use log_contents::{LogContents, to_probings};

//! From probings of balls to error parameters with their uncertainties.
//!
//! A row of probings says where all axes were when the nominal stylus centre was on the centre of a ball.
//! With the right error parameters, balls and stylus, the tip of the actual machine is on the ball in every
//! row: [`identify`] finds those with which it is as nearly as the noise lets it, says how well each of them
//! is known, and which cannot be told from others with these rows.

mod auto;
mod error_file;
mod factor;
mod foresee;
mod model;
mod rows;
mod solve;
mod unknown;
mod unseen;

pub use auto::{AutoError, Level, automatic};
pub use error_file::error_file;
pub use foresee::{Assumed, Foreseen};
pub use model::{Model, ModelError};
pub use rows::Problem;
pub(crate) use rows::turned;
pub use solve::{Estimated, Identified, IdentifyError, Options, Row, identify};
pub use unknown::Unknown;
pub use unseen::Unseen;

//! The ball-bar: the hemispherical path of the source document (Section 4.6.2), circular tests (ISO 230-4), the
//! readings of a machine with known errors, and readings with the bar's own setup removed.

mod circle;
mod hemisphere;
mod read_out;
mod record;
mod sphere;

pub use circle::{BallBarTurns, Circle, CircleError};
pub use hemisphere::{Hemisphere, PathPoint, Uneven, program};
pub use read_out::{BallBar, OutOfTravel, ReadOut, tip};
pub use record::{CircleRecord, SphereRecord};
pub use sphere::{FittedSphere, Sphere, TooFew, fitted};

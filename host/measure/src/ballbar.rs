//! The ball-bar: the hemispherical path of the source document (Section 4.6.2), circular tests (ISO 230-4), what a
//! machine with known errors makes of them, and what is left of readings once the bar's own setup is taken out.

mod circle;
mod hemisphere;
mod read_out;
mod sphere;

pub use circle::{Circle, CircleError, Turns};
pub use hemisphere::{Hemisphere, PathPoint, Uneven, program};
pub use read_out::{Bar, OutOfTravel, Read, tip};
pub use sphere::{Fitted, Sphere, TooFew, fitted};

//! Distances between solids, at rest and over whole moves.
//!
//! A move is verified clear by bisection: between two positions no point of a solid goes farther than its axes carry it, so
//! an interval is clear if the distance in its middle exceeds that. Nothing is sampled, so nothing is missed in between.

mod distance;
mod motion;

pub use distance::{Apart, distance};
pub(crate) use motion::may_meet;
pub use motion::{Body, BodyPair, Nearest, RESOLVED, nearest};

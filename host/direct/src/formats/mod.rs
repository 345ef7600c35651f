//! Files of runs, of readings of ball-bars and of readings of displacement sensors.

pub mod displacements;
pub mod radii;
pub mod revolutions;
pub mod runs;

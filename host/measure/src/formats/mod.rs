//! Files of measurements: artefacts, probings, readings of instruments and of ball-bars.

pub mod artefact;
pub mod probings;
pub mod radii;
pub mod runs;

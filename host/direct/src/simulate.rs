//! Simulates runs of instruments and readings of a ball-bar on a machine with known errors.

pub mod ballbar;
pub mod runs;

//! From a machine and balls on its table to a plan of what to probe, from that to touches, and from touches to
//! probings or to a qualified probe; and simulated touches of a machine with known errors.
//!
//! Everything begins with a [`plan::Task`]. Builds on `trueaxis-model` and `trueaxis-identify`.

// Modules, most of which use only those before them: `probe_file` (a probe, as a file) · `clearance` (distances of
// solids over moves) · `plan` (what to probe, and how) · `probe` (probing it on a machine that answers) · `spheres`
// (from touches to probings) · `qualify` (from touches to a probe).

#![forbid(unsafe_code)]

pub mod clearance;
pub mod plan;
pub mod probe;
pub mod probe_file;
pub mod qualify;
pub mod spheres;

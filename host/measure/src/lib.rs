//! From measurements of a machine tool to its error parameters: measurement planning, touches and probings, runs of
//! instruments, ball-bar, identification; and simulated measurements on machines with known errors.
//!
//! Builds on `trueaxis-model`, and on `trueaxis-tables` for errors that remain under a compensation.

// Modules, most of which use only those before them: `extremes` (of numbers) · `instrument` (what each kind of
// instrument, or a cut part, shows of exact poses, and its set-up) · `formats` (artefacts, probings, observations,
// readings, temperatures) · `direct` (from runs of instruments to error motions and squareness; ISO 230-2, -3, -7) ·
// `ballbar` · `simulate` · `identify` (from probings and observations to error parameters) · `clearance` (distances of
// solids over moves) · `plan` (what to probe, and how) · `probe` (probing it on a machine that answers) · `spheres`
// (from touches to probings) · `qualify` (from touches to a probe) · `study` (all of it in one call) · `calibration`
// (all of it on a machine that answers) · `compare` (schemes side by side).

#![forbid(unsafe_code)]

pub mod ballbar;
pub mod calibration;
pub mod clearance;
pub mod compare;
pub mod direct;
mod extremes;
pub mod formats;
pub mod identify;
pub mod instrument;
pub mod plan;
pub mod probe;
pub mod qualify;
pub mod simulate;
pub mod spheres;
pub mod study;

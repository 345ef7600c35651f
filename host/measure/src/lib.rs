//! From measurements of a machine tool to its error parameters: what to probe, touches and probings, runs of
//! instruments, ball-bar, identification; and measurements simulated on machines whose errors are known.
//!
//! Uses `trueaxis-model`, and `trueaxis-tables` for what is left under a compensation.
#![forbid(unsafe_code)]

pub mod ballbar;
pub mod compare;
pub mod direct;
pub mod formats;
pub mod identify;
pub mod plan;
pub mod simulate;
pub mod spheres;

//! From measurements of a machine tool to its error parameters: measurement planning, touches and probings, runs of
//! instruments, ball-bar, identification; and simulated measurements on machines with known errors.
//!
//! Builds on `trueaxis-model`, and on `trueaxis-tables` for errors that remain under a compensation.
#![forbid(unsafe_code)]

pub mod ballbar;
pub mod clearance;
pub mod compare;
pub mod direct;
pub mod formats;
pub mod identify;
pub mod instrument;
pub mod plan;
pub mod probe;
pub mod qualify;
pub mod simulate;
pub mod spheres;
pub mod study;

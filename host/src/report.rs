//! The report: what a person reads before a program may change a machine's motion.

pub mod model;

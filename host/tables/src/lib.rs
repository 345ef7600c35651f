//! From error parameters to the fewest compensation tables that cancel them: schemes, the blob, its proof, and the
//! error that uncertain parameters leave.
//!
//! Builds on `trueaxis-model`.
#![forbid(unsafe_code)]

pub mod compile;
pub mod contents;
pub mod cost;
pub mod dynamics;
pub mod extremes;
pub mod made;
pub mod policy;
pub mod reversal;
pub mod schemes;
pub mod size;
pub mod target;
pub mod uncertainty;
pub mod validate;

//! From error parameters to the fewest compensation tables that null them: schemes, the blob, its proof, and what
//! uncertain parameters leave.
//!
//! Uses `trueaxis-model`.
#![forbid(unsafe_code)]

pub mod compile;
pub mod contents;
pub mod cost;
pub mod extremes;
pub mod policy;
pub mod schemes;
pub mod size;
pub mod target;
pub mod uncertainty;
pub mod validate;

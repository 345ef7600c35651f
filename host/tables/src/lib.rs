//! From error parameters to the fewest compensation tables that cancel them: schemes, the blob, and what may be written.
//!
//! Builds on `trueaxis-model`.

// Modules, most of which use only those before them: `cost`, `size`, `target` (instructions, counts, capacities of a
// controller) · `schemes` (from errors to tables) · `reversal` · `compile` (scheme, bounds, blob, verification) · `contents`
// (the parts of a blob) · `made` (one compensation with everything that is said of it: what may be written, warnings).

#![forbid(unsafe_code)]

pub mod compile;
pub mod contents;
pub mod cost;
mod dynamics;
pub mod extremes;
pub mod made;
pub mod reversal;
pub mod schemes;
pub mod size;
pub mod target;

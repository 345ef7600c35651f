//! Programs corrected before they run: for every controller that has no compensation of its own.
//!
//! A line goes the way `words` (letters and numbers) → `interpret` (what it does, in positions of the machine) →
//! `trace` (the corrected path) → `cut` (where straight lines and arcs keep it) → `correct` (the line with other
//! words, and further lines). Nothing else than the line and what holds before it is kept, so that a program may be
//! as long as it likes.

#![forbid(unsafe_code)]

mod arc;
pub mod axes;
mod bend;
pub mod check;
mod codes;
mod correct;
mod cut;
pub mod cycle;
mod dialect;
mod edit;
mod extruder;
pub mod fault;
mod interpret;
mod job;
mod limits;
pub mod line_map;
pub mod modal;
pub mod moves;
mod number;
pub mod offsets;
pub mod program;
mod rate;
mod report;
pub mod setup;
mod state;
pub mod stream;
pub mod subprograms;
mod tables;
mod tip;
pub mod trace;
mod travel_directions;
pub mod words;

pub use correct::{Backlash, Corrector, Options};
pub use dialect::Dialect;
pub use fault::Refusal;
pub use job::{Job, JobError, JobMachine, compiled_from};
pub use report::Report;
pub use setup::Setup;
pub use state::{Rules, State};
pub use tables::Tables;
pub use tip::Tip;

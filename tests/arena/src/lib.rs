//! The arena: machines with hidden errors, measurements of them, and scores of ways to compensate them.
//!
//! A *round* has a seed, from which its machines follow. [`Task`] is what is public of a machine: its file,
//! measurements, the parameters to find and the positions to answer. [`Hidden`] adds its errors. A [`Baseline`] sees a
//! task only, and so does a submission; [`Score`] compares an [`Answer`] with the truth.

mod answer;
mod baseline;
mod class;
mod effect;
mod interval;
mod layout;
mod run;
mod score;
mod seed;
mod table;
mod task;

pub use answer::{Answer, Cost, Stated};
pub use baseline::{Baseline, answers};
pub use class::Class;
pub use interval::{ALPHA, one_sided, two_sided};
pub use run::{MACHINES, ROUND, baselines, scored};
pub use score::Score;
pub use table::{Scored, table, tables};
pub use task::{Hidden, Task};

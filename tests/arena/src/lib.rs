//! The arena: machines with hidden errors, measurements of them, and scores of ways to compensate them.
//!
//! A *round* has a seed, from which its machines follow. [`Task`] is what is public of a machine: its file,
//! measurements, the parameters to find and the positions to answer. [`Hidden`] adds its errors. A [`Baseline`] sees a
//! task only, and so does a submission; [`Score`] compares an [`Answer`] with the truth.

mod answer;
mod baseline;
mod class;
mod drawn;
mod effect;
mod export;
mod hidden;
mod interval;
mod layout;
mod left;
mod measured;
mod run;
mod score;
mod scores;
mod seed;
mod submission;
mod table;
mod task;
mod warming;

pub use answer::{Answer, Cost, Stated};
pub use baseline::{Baseline, answers};
pub use class::Class;
pub use export::{export, files, folder, mark};
pub use interval::{ALPHA, one_sided, two_sided};
pub use measured::{Measured, Readings};
pub use run::{MACHINES, ROUND, baselines, of_the_truth, scored};
pub use score::Score;
pub use scores::{differences, write};
pub use submission::{Refused, score};
pub use table::{Scored, page, tables};
pub use task::{Cycle, Hidden, Position, Task, Warm};

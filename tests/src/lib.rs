//! End-to-end tests of trueaxis: the tests are the files in `tests/`, the benchmarks those in `benches/`. This crate
//! contains their shared code.

#[cfg(feature = "desktop")]
pub mod best_effort;
#[cfg(feature = "desktop")]
pub mod drawn_machines;
#[cfg(feature = "desktop")]
mod examples;
pub mod fixed;
pub mod golden;
pub mod measured;
pub mod moves;
#[cfg(feature = "desktop")]
pub mod observed;
#[cfg(feature = "desktop")]
pub mod probed;
#[cfg(feature = "desktop")]
pub mod random_machines;
pub mod shown;
#[cfg(feature = "desktop")]
pub mod simulated_machine;
#[cfg(feature = "desktop")]
pub mod thermal_field;
#[cfg(feature = "desktop")]
pub mod thermal_goal;
mod usual_or_all;

#[cfg(feature = "desktop")]
pub use examples::{errors, machine, read};
pub use fixed::Fixed;
pub use usual_or_all::usual_or_all;

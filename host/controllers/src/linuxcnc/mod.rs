//! LinuxCNC: its configuration, whether a compensation fits it, and how to install one.

mod beside;
mod check;
pub mod comp_file;
mod configuration;
mod description;
mod imported;
mod install;
mod kinematics;
mod session;
mod setup;

pub use beside::{BesideError, Compensated};
pub use check::{Against, Finding, Severity, beforehand, check, unfit, unsuited};
pub use configuration::{Configuration, JointAxis, Open};
pub use description::unknown_pivot;
pub use imported::{Import, imported};
pub use install::{PANEL, install, remove};
pub use session::{AxisPositions, LinuxCncSession, LinuxCncState, SessionError, Stopper, TouchEnd};
pub use setup::{MachineFacts, SetupFiles, setup};

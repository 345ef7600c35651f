//! LinuxCNC: its configuration, whether a compensation fits it, and how to install one.

mod check;
pub mod comp_file;
mod configuration;
mod imported;
mod install;
mod kinematics;
mod session;
mod setup;

pub use check::{Against, Finding, Severity, beforehand, check, unfit, unsuited};
pub use configuration::{Configuration, JointAxis, Open};
pub use imported::{Import, has_imported, imported, is_imported};
pub use install::{PANEL, install, remove};
pub use session::{AxisPositions, LinuxCncSession, LinuxCncState, SessionError, Stopper, TouchEnd};
pub use setup::{MachineFacts, SetupFiles, setup, unknown_pivot};

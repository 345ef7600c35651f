//! From the INI and HAL files of a LinuxCNC: whether a compensation fits the machine, what makes it correct, and the
//! errors that LinuxCNC corrects by itself; and the session that moves a machine and its component.
//!
//! Everything begins with [`Configuration::read`]. Builds on `trueaxis-model`, `trueaxis-tables` and `trueaxis-export`.

// Modules, most of which use only those before them: `formats` (INI, HAL) · `kinematics` (of its modules) ·
// `configuration` · `check` · `description` (of the machine, as a file) · `comp_file` (what LinuxCNC corrects joint by
// joint), `imported` (that as errors) · `install`, `setup` (what makes a compensation correct), `beside` · `session` (a
// LinuxCNC that is running).

#![forbid(unsafe_code)]

mod beside;
mod check;
pub mod comp_file;
mod configuration;
mod description;
mod formats;
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

//! The C library as the laboratories need it: built, installed, and linked with programs in C and C++.

mod bare;
mod build;
mod c_program;
mod firmware_crate;
pub mod install;

pub use bare::{link, linker};
pub use build::{BuildCapacities, arm_library, bare_library, libraries};
pub use c_program::{CProgram, FRAME, compilers};
pub use firmware_crate::leaves_out;

use programs::process::root;
use std::path::PathBuf;

/// Folder of committed blobs.
pub const BLOBS: &str = "tests/golden/v1";

/// Path of a committed blob.
pub fn blob(name: &str) -> PathBuf {
    root().join(BLOBS).join(name).with_extension("trax")
}

//! Files of LinuxCNC.

pub mod hal;
pub mod ini;

//! Klipper: stored profiles of `bed_mesh`, and `axis_twist_compensation`.

pub mod bed_mesh;
mod config;
pub mod kinematics;
pub mod probe;
pub mod twist;

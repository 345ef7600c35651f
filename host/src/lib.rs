//! From measured geometric errors of a machine tool to the fewest compensation tables that null them.
#![forbid(unsafe_code)]

pub mod ballbar;
pub mod cec;
pub mod compare;
pub mod compile;
pub mod contents;
pub mod cost;
pub mod direct;
pub mod errors;
pub mod explain;
pub mod formats;
pub mod gcode;
pub mod identify;
pub mod kinematics;
pub mod link;
pub mod linuxcnc;
pub mod machine;
pub mod motion;
pub mod picture;
pub mod plan;
pub mod policy;
pub mod pose;
pub mod report;
pub mod reproduce;
pub mod schemes;
pub mod simulate;
pub mod size;
pub mod source;
pub mod spheres;
pub mod target;
pub mod uncertainty;
pub mod validate;

//! From measured geometric errors of a machine tool to the fewest compensation tables that null them.
#![forbid(unsafe_code)]

pub mod errors;
pub mod kinematics;
pub mod machine;
pub mod schemes;
pub mod source;
pub mod validate;

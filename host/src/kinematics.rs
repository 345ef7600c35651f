//! Rigid-body kinematics: exact pose, volumetric error, control Jacobian, correction; mm and rad.
//!
//! The crate `trueaxis-kinematics`, with error models whose tables are owned.

pub use trueaxis_kinematics::{Correction, Htm, Jacobian, NotConverged, Twist};

/// The kinematics of one machine with one set of errors.
pub type Kinematics<'a> = trueaxis_kinematics::Kinematics<'a, Vec<f64>>;

/// The linearised model of one machine with one set of errors, at one position.
pub type Linearised<'a> = trueaxis_kinematics::Linearised<'a, Vec<f64>>;

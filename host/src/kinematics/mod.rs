//! Rigid-body kinematics: exact pose, volumetric error, control Jacobian, correction.
//!
//! Everything here is in mm and rad.

mod chain;
mod correction;
mod htm;
mod jacobian;
mod linearised;

pub use chain::Kinematics;
pub use correction::{Correction, NotConverged};
pub use htm::{Htm, Twist};
pub use jacobian::Jacobian;
pub use linearised::Linearised;

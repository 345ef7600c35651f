//! Exact kinematics of serial machine tools of three to six axes, with their geometric errors.
//!
//! A [`Machine`] consists of two branches of axes, linear and rotary, from the foundation to the workpiece and to the
//! tool. An [`ErrorModel`] describes its errors in the terms of ISO 230-1: the location of the axes (inter-axis errors)
//! and their motion (error motions). [`Kinematics`] combines the two: poses, the volumetric error, the control
//! Jacobian, and the *kinematic correction*. Added to a command, this correction puts the tool where it should be, and
//! orients it as far as the [`Policy`] requires of the rotary axes. [`Nominal`] covers everything that needs no errors,
//! [`Linearised`] the effect of each single error.
//!
//! Everything is in mm and rad, except travels, which are in command units (mm and degrees). Nothing here allocates.
//! Arithmetic is f64; sine and cosine come from `libm`, or from the platform with the feature `std`. The two agree to
//! about the last place.
//!
//! ```
//! use trueaxis_kinematics::{
//!     Axis, Branch, ErrorModel, Kinematics, Letter, Machine, Parameter, Situation, Switches,
//! };
//!
//! // A mill: the table moves in X and Y, the spindle in Z and about Y; 100 mm to the tool tip.
//! let mut machine = Machine::new(&[
//!     Axis::new(Letter::Y, Branch::Workpiece, [-150.0, 150.0]),
//!     Axis::new(Letter::X, Branch::Workpiece, [-250.0, 250.0]),
//!     Axis::new(Letter::Z, Branch::Tool, [0.0, 300.0]),
//!     Axis::new(Letter::B, Branch::Tool, [-90.0, 90.0]),
//! ])?;
//! machine.tip = [0.0, 0.0, -100.0];
//! machine.check()?;
//!
//! // X is 20 µm per m too long, Z leans by 50 µrad.
//! let mut errors = ErrorModel::perfect(&machine);
//! for (name, value) in [("EXX1", 20e-6), ("EB0Z", 50e-6)] {
//!     let parameter = Parameter::parse(name).unwrap();
//!     assert!(errors.set(&machine, parameter, value));
//! }
//!
//! let kinematics = Kinematics::new(&machine, &errors);
//! let q = machine.to_kinematic(&[0.0, 200.0, 20.0, 0.0]);
//! let situation = Situation::default();
//! let before = kinematics.volumetric_error(&q, &[0.0; 6], &situation);
//! let dq = kinematics.correction(&q, &situation, &Switches::ALL)?.dq;
//! let after = kinematics.volumetric_error(&q, &dq, &situation);
//! assert!(before.t.norm() > 7e-3 && after.t.norm() < 1e-9);
//! // X by the scale error and the lean, B by the lean, damped by λ = 0.1.
//! assert!((dq[3] + 50e-6 / (1.0 + 0.1 * 0.1)).abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

// Modules, most of which use only those before them: `machine`, `axis`, `check` (the chain, and whether it can be
// corrected) · `parameter`, `motion`, `errors` (its errors) · `nominal` (poses and Jacobian without errors) · `chain`,
// `policy`, `correction`, `linearised`, `sensitivity` (with errors) · `stored` (machine and errors in a file) · `sine`
// (the source of sine and cosine).

#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

#[cfg(any(test, feature = "std"))]
extern crate std;

mod axis;
mod chain;
mod check;
mod correction;
mod errors;
mod htm;
mod jacobian;
mod linearised;
mod machine;
mod motion;
mod nominal;
mod parameter;
mod policy;
mod sensitivity;
mod sine;
#[cfg(feature = "stored")]
mod stored;

pub use axis::{Axis, Branch, Letter};
pub use chain::Kinematics;
pub use check::{MachineError, MachineProblem, RotaryPositions};
pub use correction::{Correction, NotConverged};
pub use errors::{ErrorModel, InterChange, Situation, Switches};
pub use htm::{Htm, Twist};
pub use jacobian::{BlockSolver, Jacobian};
pub use linearised::Linearised;
pub use machine::Machine;
pub use motion::{Change, MAX_CHANGES, Motion, Table};
/// The crate for the vectors and matrices used in poses.
pub use nalgebra;
pub use nominal::{Carriers, Nominal};
pub use parameter::{MAX_DEGREE, MAX_HARMONIC, Parameter, ParameterKind};
pub use policy::Policy;
pub use sensitivity::Sensitivity;
#[cfg(feature = "stored")]
pub use stored::{Sensor, Stored, StoredError};

/// Maximum number of axes of a machine.
pub const MAX_AXES: usize = 6;

/// Maximum number of temperature sensors on which errors may depend.
pub const MAX_SENSORS: usize = 7;

/// One value per axis, in the order of [`Machine::axes`]; unused entries are 0.
pub type PerAxis = [f64; MAX_AXES];

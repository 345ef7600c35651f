//! Rigid-body kinematics: exact pose, volumetric error, control Jacobian, correction; mm and rad.
//!
//! Wraps the crate `trueaxis-kinematics` for machines and errors read from files.

use crate::errors::ErrorModel;
use crate::machine::Machine;
use std::ops::Deref;
pub use trueaxis_kinematics::{Correction, Htm, Jacobian, NotConverged, Policy, Twist};

/// The kinematics of one machine with one set of errors. Dereferences to those of [`trueaxis_kinematics`] and keeps
/// the additional content of the files.
#[derive(Clone, Debug)]
pub struct Kinematics<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// Errors.
    pub errors: &'a ErrorModel,
    kinematics: trueaxis_kinematics::Kinematics<'a, Vec<f64>>,
}

impl<'a> Kinematics<'a> {
    /// Sets up the two branches; rotary axes are corrected by the default policy.
    #[must_use]
    pub fn new(machine: &'a Machine, errors: &'a ErrorModel) -> Self {
        Self {
            machine,
            errors,
            kinematics: trueaxis_kinematics::Kinematics::new(machine, errors),
        }
    }

    /// With another policy.
    #[must_use]
    pub fn with_policy(self, policy: Policy) -> Self {
        Self {
            kinematics: self.kinematics.with_policy(policy),
            ..self
        }
    }
}

impl<'a> Deref for Kinematics<'a> {
    type Target = trueaxis_kinematics::Kinematics<'a, Vec<f64>>;
    fn deref(&self) -> &Self::Target {
        &self.kinematics
    }
}

/// The linearised model of one machine with one set of errors, at one position.
pub type Linearised<'a> = trueaxis_kinematics::Linearised<'a, Vec<f64>>;

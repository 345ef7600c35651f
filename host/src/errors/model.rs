//! The error model with what its file says about it.

use super::{Covariance, MAX_SENSORS, Parameter};
use crate::machine::Machine;
use std::collections::BTreeMap;
use std::ops::{Deref, DerefMut};

/// One error motion: a component of the error of one axis along its travel.
pub type Motion = trueaxis_kinematics::Motion<Vec<f64>>;

/// Measured values of an error motion.
pub type Table = trueaxis_kinematics::Table<Vec<f64>>;

/// A temperature sensor that error parameters depend on.
#[derive(Clone, Debug, PartialEq)]
pub struct Thermal {
    /// Name of the sensor.
    pub sensor: String,
    /// Its temperature (°C) at which the parameters hold as written.
    pub reference_celsius: f64,
    /// Differences to the reference (K) that a compensation must cover.
    pub range_kelvin: [f64; 2],
}

/// All errors of a machine, with the parameters as they were written. What they do to the machine
/// is the [`trueaxis_kinematics::ErrorModel`] that it derefs to.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorModel {
    /// The parameters as written (mm, rad, per mmᵏ or radᵏ).
    pub parameters: BTreeMap<Parameter, f64>,
    /// Their standard uncertainties, where given.
    pub standard_uncertainty: BTreeMap<Parameter, f64>,
    /// How they go together, of those that a file of covariances has.
    pub correlated: Option<Covariance>,
    /// The sensors that thermal coefficients name.
    pub sensors: Vec<Thermal>,
    model: trueaxis_kinematics::ErrorModel<Vec<f64>>,
}

impl ErrorModel {
    /// A machine without errors.
    #[must_use]
    pub fn perfect(machine: &Machine) -> Self {
        Self {
            parameters: BTreeMap::new(),
            standard_uncertainty: BTreeMap::new(),
            correlated: None,
            sensors: Vec::new(),
            model: trueaxis_kinematics::ErrorModel::new(machine),
        }
    }

    /// Sets one parameter (mm, rad, per mmᵏ or radᵏ).
    ///
    /// Returns false if the machine has no such axis, or the axis no such parameter (harmonics of
    /// a linear axis); nothing is set then.
    pub fn set(&mut self, machine: &Machine, parameter: Parameter, value: f64) -> bool {
        let known = self.model.set(machine, parameter, value);
        if known {
            self.parameters.insert(parameter, value);
        }
        known
    }

    /// How well all parameters are known: those of the file of covariances as it says, the others that have a
    /// standard uncertainty without correlation. Parameters without one are taken as exact.
    #[must_use]
    pub fn covariance(&self) -> Covariance {
        let correlated = self.correlated.clone().unwrap_or_default();
        let is_other = |p: &Parameter| !correlated.parameters.contains(p);
        let others = self.standard_uncertainty.iter();
        let others = others.filter(|(p, _)| is_other(p) && self.parameters.contains_key(p));
        let others: Vec<(Parameter, f64)> = others.map(|(p, u)| (*p, *u)).collect();
        correlated.with_uncorrelated(others.into_iter())
    }
}

impl Deref for ErrorModel {
    type Target = trueaxis_kinematics::ErrorModel<Vec<f64>>;
    fn deref(&self) -> &Self::Target {
        &self.model
    }
}

impl DerefMut for ErrorModel {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.model
    }
}

const _: () = assert!(
    trueaxis::AUXILIARIES > MAX_SENSORS,
    "a tool length and all sensors fit into a blob"
);

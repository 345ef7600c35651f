//! The result of an identification.

use crate::Unseen;
use crate::bars::BarCheck;
use crate::estimate::{Estimate, RowResult};
use crate::factor::ScaledFactor;
use crate::noise::VarianceComponent;
use crate::rows::EquationWeights;
use crate::setup::{FoundDrift, FoundSetup};
use nalgebra::{DMatrix, Vector3};
use trueaxis_model::errors::{Covariance, ErrorModel, Parameter};

/// A parameter with its standard uncertainty (mm, rad, per mmᵏ or radᵏ).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimated {
    /// The parameter.
    pub parameter: Parameter,
    /// Value of the parameter.
    pub value: f64,
    /// Standard uncertainty of the parameter.
    pub uncertainty: f64,
}

/// The change of a parameter with a temperature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoundChange {
    /// The parameter.
    pub parameter: Parameter,
    /// Number of the temperature, in [`ErrorModel::sensors`](trueaxis_model::errors::ErrorModel::sensors).
    pub input: usize,
    /// The change (of its unit) per kelvin.
    pub per_kelvin: f64,
    /// Standard uncertainty, with the lag as it is.
    pub uncertainty: f64,
}

/// The result of an identification.
#[derive(Clone, Debug)]
pub struct Identified {
    /// The parameters that were looked for.
    pub looked_for: Vec<Parameter>,
    /// The parameters that could be identified, in the order of the model.
    pub parameters: Vec<Estimated>,
    /// Their covariance, in this order.
    pub covariance: DMatrix<f64>,
    /// The covariance of all known parameters: these, and those that were known before and not looked for, whose
    /// errors affect the identified ones.
    pub known: Covariance,
    /// Unknowns that could not be identified.
    pub unseen: Vec<Unseen>,
    /// The machine with these parameters.
    pub errors: ErrorModel,
    /// Positions of the balls (mm, workpiece frame).
    pub balls: Vec<Vector3<f64>>,
    /// Position of the stylus tip (mm, spindle frame).
    pub stylus: Vector3<f64>,
    /// Standard deviation of one coordinate of a probing, from the residuals (mm); without probings, that of the first
    /// of [`Self::components`].
    pub noise: f64,
    /// Like `noise`, in units of the stated uncertainty of each row, if the file states it for all rows; then the stated
    /// values are used, unless the residuals refute them.
    pub of_stated: Option<f64>,
    /// Degrees of freedom: equations in excess of unknowns.
    pub freedom: usize,
    /// Condition number of the Jacobian of the identified unknowns, with columns scaled to the same length.
    pub condition: f64,
    /// Comparison of each bar with the machine and the other bars.
    pub bars: Vec<BarCheck>,
    /// Every probing, in the order of the file.
    pub rows: Vec<RowResult>,
    /// Every observation other than probings, in the order of the files.
    pub observed: Vec<RowResult>,
    /// The set-ups of instruments.
    pub setups: Vec<FoundSetup>,
    /// Drift that was found together with the parameters.
    pub drift: Vec<FoundDrift>,
    /// Changes with temperatures that were found together with the parameters.
    pub thermal: Vec<FoundChange>,
    /// The noise of each source: probings first, then each kind of observation.
    pub components: Vec<VarianceComponent>,
    /// The solution, for further evaluation.
    pub(crate) place: Solution,
}

impl Identified {
    /// Every probing, then every observation.
    pub(crate) fn all_rows(&self) -> impl ExactSizeIterator<Item = &RowResult> {
        let (probed, observed) = (&self.rows, &self.observed);
        let row = move |i: usize| probed.get(i).unwrap_or_else(|| &observed[i - probed.len()]);
        (0..probed.len() + observed.len()).map(row)
    }
}

/// Everything needed to evaluate a solution further.
#[derive(Clone, Debug)]
pub(crate) struct Solution {
    pub estimate: Estimate,
    pub weights: EquationWeights,
    pub factor: ScaledFactor,
}

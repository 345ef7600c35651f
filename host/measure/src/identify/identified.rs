//! The result of an identification.

use super::Unseen;
use super::bars::BarCheck;
use super::factor::Factor;
use super::rows::{Estimate, Row, Weights};
use nalgebra::{DMatrix, Vector3};
use trueaxis_model::errors::{Covariance, ErrorModel, Parameter};

/// A parameter with its standard uncertainty (mm, rad, per mmᵏ or radᵏ).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimated {
    /// The parameter.
    pub parameter: Parameter,
    /// Its value.
    pub value: f64,
    /// Its standard uncertainty.
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
    /// Standard deviation of one coordinate of a probing, from the residuals (mm).
    pub noise: f64,
    /// The same in units of the stated uncertainty of each row, if the file states it for all rows; then the stated
    /// values are used.
    pub of_stated: Option<f64>,
    /// Degrees of freedom: equations in excess of unknowns.
    pub freedom: usize,
    /// Condition number of the Jacobian of the identified unknowns, with columns scaled to the same length.
    pub condition: f64,
    /// Comparison of each bar with the machine and the other bars.
    pub bars: Vec<BarCheck>,
    /// Every probing, in the order of the file.
    pub rows: Vec<Row>,
    /// The solution, for further evaluation.
    pub(super) place: Solution,
}

/// Everything needed to evaluate a solution further.
#[derive(Clone, Debug)]
pub(super) struct Solution {
    pub estimate: Estimate,
    pub weights: Weights,
    pub factor: Factor,
}

//! What was identified.

use super::Unseen;
use super::bars::BarCheck;
use super::factor::Factor;
use super::rows::{Estimate, Row, Weights};
use nalgebra::{DMatrix, Vector3};
use trueaxis_model::errors::{Covariance, ErrorModel, Parameter};

/// A parameter with its standard uncertainty (mm, rad, per mmᵏ or radᵏ).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimated {
    /// Which.
    pub parameter: Parameter,
    /// Its value.
    pub value: f64,
    /// Its standard uncertainty.
    pub uncertainty: f64,
}

/// What was identified.
#[derive(Clone, Debug)]
pub struct Identified {
    /// What was looked for.
    pub looked_for: Vec<Parameter>,
    /// The parameters that can be seen, in the order of the model.
    pub parameters: Vec<Estimated>,
    /// Their covariance, in this order.
    pub covariance: DMatrix<f64>,
    /// The covariance of all that is known: these parameters, and those that were known before and not looked
    /// for; if these are wrong, the ones that were found with them are too.
    pub known: Covariance,
    /// What cannot be seen.
    pub unseen: Vec<Unseen>,
    /// The machine with these parameters.
    pub errors: ErrorModel,
    /// Where the balls are (mm, workpiece frame).
    pub balls: Vec<Vector3<f64>>,
    /// Where the stylus tip is (mm, spindle frame).
    pub stylus: Vector3<f64>,
    /// Standard deviation of one coordinate of a probing, from what is left (mm).
    pub noise: f64,
    /// The same in what the file states for each row, if it states it for all; what is stated counts then.
    pub of_stated: Option<f64>,
    /// Equations beyond those that it takes.
    pub freedom: usize,
    /// Condition number of the Jacobian, with columns of one length, of what is seen.
    pub condition: f64,
    /// What the machine and the other bars say of each bar.
    pub bars: Vec<BarCheck>,
    /// Every probing, in the order of the file.
    pub rows: Vec<Row>,
    /// Where it was found.
    pub(super) place: Solution,
}

/// Where a solution was found: what more can be asked of it.
#[derive(Clone, Debug)]
pub(super) struct Solution {
    pub estimate: Estimate,
    pub weights: Weights,
    pub factor: Factor,
}

//! The volumetric error that remains because error parameters and tabulated motions are uncertain.
//!
//! Tables compensate the errors as given. If these are off by δ, normally distributed with a covariance C, the tip
//! is off by J·δ and the tool direction by D·δ, with the exact derivatives J and D of the actual machine. Both are
//! vectors with the covariances J·C·Jᵀ and D·C·Dᵀ. The *95 % interval* at a position is the length that the vector does
//! not exceed with a probability of 95 %: 1.96 times the standard uncertainty if it lies along one line, 2.80 times
//! that of a coordinate if all three are equal. The values of a tabulated motion are independent of each other, so
//! at one position it counts as one more parameter, independent of all others.
//!
//! Errors that the model lacks move the tip, too. Their size in the calibrated range is the *misfit*: a random
//! displacement of the tip, of the same size in all directions, that adds to the covariance. What they do to the tool
//! direction, balls do not show; if something that reads directions was measured, it has a misfit of its own, across the
//! tool.

mod benefit;
mod bounds;
mod length;
mod travel;

use crate::errors::{Covariance, ErrorModel, Parameter, ParameterKind, Situation};
use crate::kinematics::Kinematics;
use crate::machine::{Machine, PerAxis};
use crate::parallel;
use crate::validate::{Quality, Statistics};
pub use benefit::{Benefit, benefit};
pub use bounds::{MISFIT_MEAN, MISFIT_P95, TURN_MEAN, TURN_P95, bounds};
use nalgebra::{DMatrix, Matrix3, Matrix3xX, Vector3};
pub use travel::{OverTravel, over_travel, probed_zone};
use trueaxis_kinematics::Sensitivity;

/// Probability that an error is inside its coverage interval.
pub(crate) const PROBABILITY: f64 = 0.95;

/// The error that uncertain parameters leave at one position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leaves {
    /// Covariance of the tip position (mm², workpiece frame).
    pub tip: Matrix3<f64>,
    /// Covariance of the tool direction (rad², workpiece frame; zero along the tool).
    pub direction: Matrix3<f64>,
}

impl Leaves {
    /// Length (mm) that the error of the tip does not exceed with 95 % probability.
    #[must_use]
    pub fn tip_band(&self) -> f64 {
        length::quantile(&self.tip)
    }

    /// Angle (rad) that the error of the tool direction does not exceed with 95 % probability.
    #[must_use]
    pub fn direction_band(&self) -> f64 {
        length::quantile(&self.direction)
    }
}

/// Computes the error that uncertain parameters leave, position by position.
pub struct Uncertain<'a> {
    kinematics: Kinematics<'a>,
    parameters: &'a [Parameter],
    root: DMatrix<f64>,
}

impl<'a> Uncertain<'a> {
    /// For parameters with a covariance, and the tabulated motions of the errors, which are independent of them.
    #[must_use]
    pub fn new(machine: &'a Machine, errors: &'a ErrorModel, covariance: &'a Covariance) -> Self {
        Self {
            kinematics: Kinematics::new(machine, errors),
            parameters: &covariance.parameters,
            root: covariance.root(),
        }
    }

    /// The remaining error at a position (mm, rad) with its situation.
    #[must_use]
    pub fn leaves(&self, q: &PerAxis, situation: &Situation) -> Leaves {
        let changes = Changes::new(&self.kinematics, q, situation);
        let parameters = changes.by(self.parameters);
        let tables = changes.of_tables();
        let [tip, direction] = [0, 1]
            .map(|k| of_root(&parameters[k], &self.root) + &tables[k] * tables[k].transpose());
        let errors = self.kinematics.errors;
        let [misfit, turn] =
            [errors.misfit, errors.misfit_of_direction].map(Option::unwrap_or_default);
        let along = changes.tool();
        let across = Matrix3::identity() - along * along.transpose();
        Leaves {
            tip: tip + Matrix3::from_diagonal_element(misfit * misfit),
            direction: direction + across * (turn * turn),
        }
    }
}

/// The error that the covariance of the parameters leaves at each position ([`Uncertain::leaves`]).
#[must_use]
pub fn leaves(
    machine: &Machine,
    errors: &ErrorModel,
    covariance: &Covariance,
    positions: &[(PerAxis, Situation)],
) -> Vec<Leaves> {
    let uncertain = Uncertain::new(machine, errors, covariance);
    parallel::map(positions, |(q, situation)| uncertain.leaves(q, situation))
}

/// The coverage intervals (95 %) over many positions: mean, root mean square and maximum of [`Leaves::tip_band`] (µm) and
/// [`Leaves::direction_band`] (µrad).
#[must_use]
pub fn band(
    machine: &Machine,
    errors: &ErrorModel,
    covariance: &Covariance,
    positions: &[(PerAxis, Situation)],
) -> Quality {
    let leaves = leaves(machine, errors, covariance, positions);
    let bands = parallel::map(&leaves, |at| [at.tip_band(), at.direction_band()]);
    Quality {
        translation_um: Statistics::of(bands.iter().map(|[tip, _]| tip * 1e3)),
        direction_urad: Statistics::of(bands.iter().map(|[_, direction]| direction * 1e6)),
    }
}

/// Derivatives of the tip (mm) and of the unit vector of the tool direction (rad) with respect to each parameter, in
/// the workpiece frame.
#[must_use]
pub fn derivatives(
    kinematics: &Kinematics<'_>,
    parameters: &[Parameter],
    q: &PerAxis,
    situation: &Situation,
) -> [Matrix3xX<f64>; 2] {
    Changes::new(kinematics, q, situation).by(parameters)
}

/// Changes of the tip, and of a point 1 mm further along the tool, with errors at a position.
struct Changes<'a> {
    kinematics: &'a Kinematics<'a>,
    q: &'a PerAxis,
    situation: &'a Situation,
    at_tip: Sensitivity,
    at_further: Sensitivity,
}

impl<'a> Changes<'a> {
    fn new(kinematics: &'a Kinematics<'a>, q: &'a PerAxis, situation: &'a Situation) -> Self {
        let machine = kinematics.machine;
        let tip = situation.length.map_or(machine.tip, |l| machine.tip_at(l));
        let tip = Vector3::from(tip);
        let further = tip + Vector3::ith(machine.tool_axis, 1.0);
        let [at_tip, at_further] =
            [tip, further].map(|point| kinematics.sensitivity(q, situation, &point));
        Self {
            kinematics,
            q,
            situation,
            at_tip,
            at_further,
        }
    }

    /// Unit vector of the tool, in the workpiece frame.
    fn tool(&self) -> Vector3<f64> {
        let at = self.kinematics.nominal(self.q, self.situation.length);
        at.r.column(self.kinematics.machine.tool_axis).into_owned()
    }

    /// With respect to each parameter: tip and direction.
    fn by(&self, parameters: &[Parameter]) -> [Matrix3xX<f64>; 2] {
        let (machine, errors) = (self.kinematics.machine, self.kinematics.errors);
        self.columns(parameters.iter().map(|parameter| {
            let per_unit = errors.per_unit(machine, *parameter, self.q, self.situation);
            let of = |sensitivity: &Sensitivity| -> Vector3<f64> {
                let axis = machine.index(parameter.axis).unwrap_or(machine.axes.len());
                let columns = match parameter.kind {
                    ParameterKind::Inter => &sensitivity.by_inter[axis],
                    _ => &sensitivity.by_intra[axis],
                };
                columns.column(parameter.component) * per_unit.unwrap_or(0.0)
            };
            [of(&self.at_tip), of(&self.at_further)]
        }))
    }

    /// With respect to each uncertain tabulated motion, times its standard uncertainty.
    fn of_tables(&self) -> [Matrix3xX<f64>; 2] {
        let errors = self.kinematics.errors;
        self.columns(errors.table_uncertainty.keys().map(|(axis, component)| {
            let q = self.q[*axis];
            let u = errors.table_uncertainty_at(*axis, *component, q, self.situation);
            [&self.at_tip, &self.at_further].map(|s| s.by_intra[*axis].column(*component) * u)
        }))
    }

    /// Converts changes of both points to changes of tip and direction.
    fn columns(&self, changes: impl Iterator<Item = [Vector3<f64>; 2]>) -> [Matrix3xX<f64>; 2] {
        let all: Vec<[Vector3<f64>; 2]> =
            changes.map(|[tip, further]| [tip, further - tip]).collect();
        [0, 1].map(|k| Matrix3xX::from_fn(all.len(), |i, j| all[j][k][i]))
    }
}

/// J·R·(J·R)ᵀ.
pub fn of_root(derivatives: &Matrix3xX<f64>, root: &DMatrix<f64>) -> Matrix3<f64> {
    let spread = derivatives * root;
    &spread * spread.transpose()
}

#[cfg(test)]
mod tests;

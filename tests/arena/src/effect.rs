//! The effect of a parameter at the tip.

use nalgebra::Matrix3xX;
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::Machine;
use trueaxis_model::uncertainty::derivatives;
use trueaxis_model::validate::Command;

/// Displacement of the tip (mm, root mean square over the positions) by one unit of each parameter. With it errors of
/// parameters in rad, mm, and per mm or rad to a power are compared.
#[must_use]
pub fn effects(machine: &Machine, parameters: &[Parameter], positions: &[Command]) -> Vec<f64> {
    let perfect = ErrorModel::perfect(machine);
    let kinematics = Kinematics::new(machine, &perfect);
    let mut sums = vec![0.0; parameters.len()];
    for position in positions {
        let (q, situation) = position.kinematic(machine);
        let [tip, _]: [Matrix3xX<f64>; 2] = derivatives(&kinematics, parameters, &q, &situation);
        for (sum, column) in sums.iter_mut().zip(tip.column_iter()) {
            *sum += column.norm_squared();
        }
    }
    let count = positions.len() as f64;
    sums.into_iter().map(|sum| (sum / count).sqrt()).collect()
}

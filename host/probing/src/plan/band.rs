//! The volumetric error that remains because parameters are uncertain.

use nalgebra::{DMatrix, Matrix3xX};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use trueaxis_model::errors::{Covariance, ErrorModel, Parameter, Situation};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_model::numbers::ascending;
use trueaxis_model::parallel;
use trueaxis_model::uncertainty::{derivatives, of_root};

/// A standard uncertainty over many positions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct UncertaintySpread {
    /// Mean.
    pub mean: f64,
    /// The root of the mean of its square.
    pub root_mean_square: f64,
    /// The value that 95 % of the positions do not exceed.
    pub most_of: f64,
    /// The largest.
    pub largest: f64,
}

/// Positions at which the volumetric error is evaluated, and its derivatives by the parameters there.
#[derive(Debug)]
pub struct Band {
    parameters: Vec<Parameter>,
    /// For each position the derivatives of tip (mm) and tool direction (rad), workpiece frame.
    derivatives: Vec<[Matrix3xX<f64>; 2]>,
}

impl Band {
    /// At `count` random positions in the whole travel, each axis arriving from a random direction. Outside `probed`
    /// (mm or deg), motions of degree 2 and more hold their end values, as in the file that `identify` writes.
    #[must_use]
    pub fn new(
        machine: &Machine,
        errors: &ErrorModel,
        parameters: &[Parameter],
        probed: &[[f64; 2]],
        count: usize,
    ) -> Self {
        let mut random = Pcg64Mcg::seed_from_u64(1);
        let places: Vec<(PerAxis, Situation)> = (0..count)
            .map(|_| {
                let mut situation = Situation::default();
                let mut position = [0.0; trueaxis_model::machine::MAX_AXES];
                for (i, axis) in machine.axes.iter().enumerate() {
                    let [low, high] = axis.travel;
                    position[i] = low + random.random::<f64>() * (high - low);
                    situation.sign[i] = if random.random::<bool>() { 1.0 } else { -1.0 };
                }
                (machine.to_kinematic(&position), situation)
            })
            .collect();
        let identified = as_identified(machine, errors, parameters, probed);
        let kinematics = Kinematics::new(machine, &identified);
        Self {
            parameters: parameters.to_vec(),
            derivatives: parallel::map(&places, |(q, situation)| {
                derivatives(&kinematics, parameters, q, situation)
            }),
        }
    }

    /// Standard uncertainty of tip (mm, root of the sum of the three variances) and tool direction (rad, the same)
    /// for parameters with this covariance.
    #[must_use]
    pub fn spread(&self, covariance: &DMatrix<f64>) -> [UncertaintySpread; 2] {
        let root = Covariance {
            parameters: self.parameters.clone(),
            matrix: covariance.clone(),
        }
        .root();
        let all: Vec<[f64; 2]> = parallel::map(&self.derivatives, |d| {
            d.each_ref().map(|d| of_root(d, &root).trace().sqrt())
        });
        [0, 1].map(|k| UncertaintySpread::of(all.iter().map(|v| v[k]).collect()))
    }

    /// The means of DᵀD of tip and direction. The mean variance of either is the trace of its product with the
    /// covariance.
    #[must_use]
    pub(crate) fn mean_squares(&self) -> [DMatrix<f64>; 2] {
        let count = self.parameters.len();
        [0, 1].map(|k| {
            let mut sum = DMatrix::zeros(count, count);
            for d in &self.derivatives {
                sum += d[k].tr_mul(&d[k]);
            }
            sum / self.derivatives.len().max(1) as f64
        })
    }
}

impl UncertaintySpread {
    fn of(mut values: Vec<f64>) -> Self {
        ascending(&mut values);
        let count = values.len();
        let Some(largest) = values.last() else {
            return Self::default();
        };
        Self {
            mean: values.iter().sum::<f64>() / count as f64,
            root_mean_square: (values.iter().map(|v| v * v).sum::<f64>() / count as f64).sqrt(),
            most_of: values[(count * 95).div_ceil(100) - 1],
            largest: *largest,
        }
    }
}

/// A machine with these errors, as in the error file after probing these ranges.
fn as_identified(
    machine: &Machine,
    errors: &ErrorModel,
    parameters: &[Parameter],
    probed: &[[f64; 2]],
) -> ErrorModel {
    let mut identified = errors.clone();
    for parameter in parameters {
        let value = errors.parameters.get(parameter).copied();
        identified.set(machine, *parameter, value.unwrap_or(0.0));
    }
    for (i, range) in probed.iter().enumerate() {
        identified.calibrated[i] = range.map(|q| machine.axes[i].to_kinematic(q));
    }
    identified
}

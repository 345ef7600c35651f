//! The volumetric error that parameters leave which are known only so well.

use crate::errors::{ErrorModel, Parameter, ParameterKind, Situation};
use crate::kinematics::Kinematics;
use crate::machine::{Machine, PerAxis};
use nalgebra::{DMatrix, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

/// A standard uncertainty over many positions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// Its mean.
    pub mean: f64,
    /// The root of the mean of its square.
    pub root_mean_square: f64,
    /// 95 % of the positions have no more.
    pub most_of: f64,
    /// The largest.
    pub largest: f64,
}

/// Where the volumetric error is looked at, and how parameters change it there.
#[derive(Debug)]
pub struct Band {
    /// For each position the derivatives of tip (mm) and tool direction (rad), workpiece frame: 6 × parameters.
    derivatives: Vec<DMatrix<f64>>,
}

/// A second point along the tool axis (mm from the tip), by which the direction is told.
const BEHIND: f64 = 1.0;

impl Band {
    /// At random positions (`count` of them) of the whole travel, each axis coming from a random direction.
    /// Motions of degree 2 and more hold their end values outside `probed` (mm or deg), as the file says that
    /// `identify` writes.
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
                let mut position = [0.0; crate::machine::MAX_AXES];
                for (i, axis) in machine.axes.iter().enumerate() {
                    let [low, high] = axis.travel;
                    position[i] = low + random.random::<f64>() * (high - low);
                    situation.sign[i] = if random.random::<bool>() { 1.0 } else { -1.0 };
                }
                (machine.to_kinematic(&position), situation)
            })
            .collect();
        let kinematics = Kinematics::new(machine, errors);
        let basis = Basis::new(machine, parameters, probed);
        let derivatives = places.par_iter().map(|(q, situation)| {
            let tip = Vector3::from(machine.tip);
            let back = tip + Vector3::ith(machine.tool_axis, BEHIND);
            let [tip, back] = [tip, back].map(|p| kinematics.sensitivity(q, situation, &p));
            let mut columns = DMatrix::zeros(6, parameters.len());
            for (i, parameter) in parameters.iter().enumerate() {
                let factor = basis.of(*parameter, q, situation);
                let [at_tip, behind] = [&tip, &back].map(|found| {
                    let axis = (machine.index(parameter.axis)).unwrap_or(machine.axes.len());
                    match parameter.kind {
                        ParameterKind::Inter => found.by_inter[axis].column(parameter.component),
                        _ => found.by_intra[axis].column(parameter.component),
                    }
                    .into_owned()
                        * factor
                });
                columns.fixed_view_mut::<3, 1>(0, i).copy_from(&at_tip);
                columns
                    .fixed_view_mut::<3, 1>(3, i)
                    .copy_from(&((behind - at_tip) / BEHIND));
            }
            columns
        });
        Self {
            derivatives: derivatives.collect(),
        }
    }

    /// Standard uncertainty of tip (mm, root of the sum of the three variances) and tool direction (rad, the
    /// same) that parameters with this covariance leave.
    #[must_use]
    pub fn spread(&self, covariance: &DMatrix<f64>) -> [Spread; 2] {
        let all: Vec<[f64; 2]> = self
            .derivatives
            .par_iter()
            .map(|d| {
                let spread = d * covariance;
                let variance = |i: usize| spread.row(i).dot(&d.row(i)).max(0.0);
                [0, 3].map(|k| (variance(k) + variance(k + 1) + variance(k + 2)).sqrt())
            })
            .collect();
        [0, 1].map(|k| {
            let mut values: Vec<f64> = all.iter().map(|v| v[k]).collect();
            values.sort_by(f64::total_cmp);
            let Some(largest) = values.last() else {
                return Spread::default();
            };
            Spread {
                mean: values.iter().sum::<f64>() / values.len() as f64,
                root_mean_square: (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64)
                    .sqrt(),
                most_of: values[(values.len() * 95).div_ceil(100) - 1],
                largest: *largest,
            }
        })
    }

    /// The means of DᵀD of tip and direction: with them, the mean variance of either is the trace of its product with
    /// the covariance.
    #[must_use]
    pub fn mean_squares(&self) -> [DMatrix<f64>; 2] {
        let count = self.derivatives.first().map_or(0, DMatrix::ncols);
        [0, 3].map(|first| {
            let mut sum = DMatrix::zeros(count, count);
            for d in &self.derivatives {
                let rows = d.rows(first, 3);
                sum += rows.tr_mul(&rows);
            }
            sum / self.derivatives.len().max(1) as f64
        })
    }
}

/// The error of its axis that a parameter of 1 makes.
struct Basis<'a> {
    machine: &'a Machine,
    /// A machine that has these parameters, with the range in which their motions are known.
    errors: ErrorModel,
}

impl<'a> Basis<'a> {
    fn new(machine: &'a Machine, parameters: &[Parameter], probed: &[[f64; 2]]) -> Self {
        let mut errors = ErrorModel::perfect(machine);
        for parameter in parameters {
            errors.set(machine, *parameter, 1.0);
        }
        for (i, range) in probed.iter().enumerate() {
            errors.calibrated[i] = range.map(|q| machine.axes[i].to_kinematic(q));
        }
        Self { machine, errors }
    }

    fn of(&self, parameter: Parameter, q: &PerAxis, situation: &Situation) -> f64 {
        let Some(axis) = self.machine.index(parameter.axis) else {
            return 1.0;
        };
        match parameter.kind {
            ParameterKind::Inter => 1.0,
            ParameterKind::Backlash => situation.sign[axis],
            kind if self.errors.motions[axis][parameter.component].holds() => {
                let [a, b] = self.errors.calibrated[axis];
                kind.basis(q[axis].clamp(a.min(b), a.max(b)))
            }
            kind => kind.basis(q[axis]),
        }
    }
}

//! The scheme `poly25`: sums of cubic polynomials, one of every axis for every axis: 25 tables for five axes.
//!
//! Source document, Chapter 5. Eqs. 23 and 24: Δq_i = Σ_j f_ij(q_j), f_ij(q) = a₀ + a₁q + a₂q² + a₃q³, of which one
//! a₀ is kept for each output, as all of them do the same (section 5.9.1). The coefficients are fitted over a grid
//! of all axes, and each function becomes a table.

use super::blank::blank;
use super::lattice::Lattice;
use super::moments::{Moments, solve};
use super::points::Points;
use super::{Found, Options, SchemeError};
use crate::errors::{ErrorModel, Situation};
use crate::kinematics::{Kinematics, Policy};
use crate::machine::{MAX_AXES, Machine, PerAxis};
use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use std::convert::Infallible;
use trueaxis::{Draft, Term};

/// Points of each table, unless told otherwise (section 5.6).
pub const POINTS: usize = 50;
/// Coefficients of a polynomial without a₀.
const DEGREES: usize = 3;

/// What the coefficients make least.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Objective {
    /// Squares of what is missing of the kinematic correction, of each axis by itself.
    Corrections,
    /// Squares of the volumetric error that is left, mm and rad in one sum (Eqs. 28–30).
    Error,
}

/// What this scheme is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// What the coefficients make least.
    pub objective: Objective,
    /// Positions along each axis of the grid that it is fitted on.
    pub nodes: usize,
}

/// 1, then u, u² and u³ of every axis, where u goes from −1 to 1 over its travel: the same polynomials as those
/// of q, better told apart.
struct Basis {
    /// Middle and half of the travel of each axis (mm, rad).
    range: Vec<[f64; 2]>,
}

impl Basis {
    fn new(machine: &Machine) -> Self {
        let range = machine.axes.iter().map(|axis| {
            let [low, high] = axis.travel.map(|t| axis.to_kinematic(t));
            [0.5 * (low + high), 0.5 * (high - low)]
        });
        Self {
            range: range.collect(),
        }
    }

    fn count(&self) -> usize {
        1 + DEGREES * self.range.len()
    }

    fn powers(&self, axis: usize, q: f64) -> [f64; DEGREES] {
        let [middle, half] = self.range[axis];
        let u = (q - middle) / half;
        [u, u * u, u * u * u]
    }

    fn values(&self, q: &PerAxis, into: &mut [f64]) {
        into[0] = 1.0;
        for (axis, into) in into[1..].chunks_exact_mut(DEGREES).enumerate() {
            into.copy_from_slice(&self.powers(axis, q[axis]));
        }
    }
}

/// Finds the tables of one machine and its errors.
///
/// # Errors
/// [`SchemeError`]: not two rotary and three linear axes, or the kinematic correction fails.
pub fn compile(
    machine: &Machine,
    errors: &ErrorModel,
    wanted: Wanted,
    options: &Options,
) -> Result<Found, SchemeError> {
    SchemeError::unless_five_axes(machine, "poly25")?;
    let kinematics = Kinematics::new(machine, errors).with_policy(options.policy);
    let zero = options.zero(machine, errors)?;
    let lattice = Lattice::over(machine, wanted.nodes);
    let basis = Basis::new(machine);
    let coefficients = match wanted.objective {
        Objective::Corrections => of_corrections(&kinematics, &lattice, &basis)?,
        Objective::Error => of_error(&kinematics, &lattice, &basis)?,
    };
    let count = options.points.unwrap_or(POINTS);
    let axes = 0..machine.axes.len();
    let offset = offset_with(machine);
    let bank = |input: usize| {
        let points = Points::over(machine, input, count);
        let table = |output: usize| {
            let own = coefficients.column(output);
            let constant = if input == offset {
                own[0] - zero[output]
            } else {
                0.0
            };
            let value = |at: &f64| {
                let powers = basis.powers(input, *at).into_iter();
                let sum: f64 = (powers.zip(own.iter().skip(1 + DEGREES * input)))
                    .map(|(u, a)| u * a)
                    .sum();
                machine.axes[output].to_command(constant + sum)
            };
            points.at.iter().map(value).collect()
        };
        points.bank(options.format, axes.clone().map(table).collect())
    };
    let terms = axes.clone().flat_map(|output| {
        axes.clone().map(move |input| Term {
            output: output as u8,
            weight: 1.0,
            limits: None,
            factors: std::iter::once((input * axes_of(machine) + output) as u8).collect(),
        })
    });
    Ok(Found {
        draft: Draft {
            banks: axes.clone().map(bank).collect(),
            terms: terms.collect(),
            ..blank(&kinematics)
        },
        structure_error: None,
        meets: None,
        is_full: false,
        notes: super::without_direction(machine, errors)
            .into_iter()
            .collect(),
    })
}

fn axes_of(machine: &Machine) -> usize {
    machine.axes.len()
}

/// The axis whose tables hold the offsets: X, as in the document, or the first.
fn offset_with(machine: &Machine) -> usize {
    machine.index('X').unwrap_or(0)
}

/// Coefficients (functions × outputs) that leave least of the corrections.
fn of_corrections(
    kinematics: &Kinematics<'_>,
    lattice: &Lattice,
    basis: &Basis,
) -> Result<DMatrix<f64>, SchemeError> {
    let moments = Moments::over(kinematics, lattice, basis.count(), |q, into| {
        basis.values(q, into);
    })?;
    let all: Vec<usize> = (0..basis.count()).collect();
    let outputs = basis.range.len();
    let columns: Vec<DVector<f64>> = (0..outputs).map(|i| moments.fit(&all, i)).collect();
    Ok(DMatrix::from_columns(&columns))
}

/// Steps of the fit of the error, at most: each gains the relative size of the errors.
const STEPS: usize = 10;
/// The last of them changes no table by more than this (mm, rad).
const STEP: f64 = 1e-9;

/// Coefficients (functions × outputs) that leave least of the volumetric error: of the rotation what the
/// policy asks for, and under its damping the rotary corrections too.
fn of_error(
    kinematics: &Kinematics<'_>,
    lattice: &Lattice,
    basis: &Basis,
) -> Result<DMatrix<f64>, SchemeError> {
    let machine = kinematics.machine;
    let (functions, outputs) = (basis.count(), machine.axes.len());
    let weights = Weights::new(kinematics);
    let situation = Situation::default();
    // Unknowns: output slowest. The control Jacobian is that of the commands: the same in every step.
    let join = |total: &mut Sums, sum: Sums| {
        total.normal += sum.normal;
        total.right += sum.right;
    };
    let nothing = |unknowns: usize| Sums {
        normal: DMatrix::zeros(unknowns, unknowns),
        right: DVector::zeros(functions * outputs),
    };
    let add_normal = |sum: &mut Sums, _: usize, q: &PerAxis| {
        let mut phi = DVector::zeros(functions);
        basis.values(q, phi.as_mut_slice());
        let square = &phi * phi.transpose();
        let gram = weights.gram(&weights.jacobian(kinematics, q));
        for i in 0..outputs {
            for j in 0..=i {
                if gram[(i, j)] != 0.0 {
                    let mut block = (sum.normal)
                        .view_mut((i * functions, j * functions), (functions, functions));
                    block += &square * gram[(i, j)];
                }
            }
        }
        Ok::<(), Infallible>(())
    };
    let size = functions * outputs;
    let Ok(mut sums) = lattice.sum(|| nothing(size), add_normal, join);
    sums.normal.fill_upper_triangle_with_lower_triangle();
    let mut found: DMatrix<f64> = DMatrix::zeros(functions, outputs);
    for _ in 0..STEPS {
        let add_right = |sum: &mut Sums, _: usize, q: &PerAxis| {
            let mut phi = DVector::zeros(functions);
            basis.values(q, phi.as_mut_slice());
            let mut dq = PerAxis::default();
            for (d, own) in dq.iter_mut().zip(found.column_iter()) {
                *d = own.dot(&phi);
            }
            let error = kinematics.volumetric_error(q, &dq, &situation).to_array();
            let right = weights.right(&weights.jacobian(kinematics, q), &error, &dq);
            for i in 0..outputs {
                let mut part = sum.right.rows_mut(i * functions, functions);
                part.axpy(-right[i], &phi, 1.0);
            }
            Ok::<(), Infallible>(())
        };
        let Ok(residual) = lattice.sum(|| nothing(0), add_right, join);
        let step = solve(&sums.normal, &residual.right);
        let step = DMatrix::from_column_slice(functions, outputs, step.as_slice());
        found += &step;
        // Every function is at most 1.
        if step.amax() < STEP / functions as f64 {
            break;
        }
    }
    Ok(found)
}

struct Sums {
    normal: DMatrix<f64>,
    right: DVector<f64>,
}

type Columns = SMatrix<f64, 6, MAX_AXES>;

/// What counts of the error that is left.
struct Weights {
    /// Of the six rows of a twist.
    rows: SVector<f64, 6>,
    /// λ² of the rotary axes.
    damping: PerAxis,
    /// Outputs that stay 0.
    stays: [bool; MAX_AXES],
    axes: usize,
}

impl Weights {
    fn new(kinematics: &Kinematics<'_>) -> Self {
        let machine = kinematics.machine;
        let mut weights = Self {
            rows: SVector::repeat(1.0),
            damping: PerAxis::default(),
            stays: [false; MAX_AXES],
            axes: machine.axes.len(),
        };
        let rotary = |i: &usize| machine.axes[*i].letter.is_rotary();
        for i in (0..machine.axes.len()).filter(rotary) {
            match kinematics.policy {
                Policy::Direction { damping } => {
                    weights.rows[3 + machine.tool_axis] = 0.0;
                    weights.damping[i] = damping * damping;
                }
                Policy::Orientation => {}
                Policy::Position => weights.stays[i] = true,
            }
        }
        weights
    }

    /// The control Jacobian at a command, without the outputs that stay.
    fn jacobian(&self, kinematics: &Kinematics<'_>, q: &PerAxis) -> Columns {
        let jacobian = kinematics.jacobian(q, None);
        let mut columns = Columns::zeros();
        for i in (0..self.axes).filter(|i| !self.stays[*i]) {
            columns.set_column(i, &SVector::from(jacobian.column(i)));
        }
        columns
    }

    /// Jᵀ·W·J + λ².
    fn gram(&self, jacobian: &Columns) -> SMatrix<f64, MAX_AXES, MAX_AXES> {
        let mut weighed = *jacobian;
        for mut column in weighed.column_iter_mut() {
            column.component_mul_assign(&self.rows);
        }
        let mut gram = jacobian.transpose() * weighed;
        for (i, damping) in self.damping.into_iter().enumerate() {
            gram[(i, i)] += damping;
        }
        gram
    }

    /// Jᵀ·W·E + λ²·Δ.
    fn right(&self, jacobian: &Columns, error: &[f64; 6], dq: &PerAxis) -> SVector<f64, MAX_AXES> {
        let counted = SVector::from(*error).component_mul(&self.rows);
        jacobian.transpose() * counted
            + SVector::from(self.damping).component_mul(&SVector::from(*dq))
    }
}

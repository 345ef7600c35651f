//! The scheme `poly25`: sums of cubic polynomials, one of every axis for every axis: 25 tables for five axes.
//!
//! Source document, Chapter 5. Eqs. 23 and 24: Δq_i = Σ_j f_ij(q_j), f_ij(q) = a₀ + a₁q + a₂q² + a₃q³. One a₀ is
//! kept for each output, because all have the same effect (section 5.9.1). The coefficients are fitted over a grid
//! of all axes, and each function becomes a table.

mod error;

use super::blank::blank;
use super::lattice::Lattice;
use super::moments::Moments;
use super::points::Points;
use super::{Options, SchemeError, SchemeResult};
use nalgebra::{DMatrix, DVector};
use trueaxis::{Draft, Term};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{Machine, PerAxis};

/// Default number of points of each table (section 5.6).
pub const POINTS: usize = 50;
/// Coefficients of a polynomial without a₀.
const DEGREES: usize = 3;

/// The quantity that the coefficients minimize.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Objective {
    /// The difference from the kinematic correction.
    ///
    /// The squares of each axis separately.
    Corrections,
    /// The remaining volumetric error.
    ///
    /// Squares of mm and rad in one sum (Eqs. 28–30).
    Error,
}

/// Options of this scheme.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// The quantity that the coefficients minimize.
    pub objective: Objective,
    /// Number of positions along each axis of the grid to which it is fitted.
    pub nodes: usize,
}

/// 1, then u, u² and u³ of every axis, where u goes from −1 to 1 over its travel: the same polynomials as those of
/// q, but better conditioned.
struct Basis {
    /// Middle and half width of the travel of each axis (mm, rad).
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

/// Finds the tables for a machine and its errors.
///
/// # Errors
/// [`SchemeError`]: the machine does not have two rotary and three linear axes, or the kinematic correction fails.
pub fn compile(
    machine: &Machine,
    errors: &ErrorModel,
    wanted: Wanted,
    options: &Options,
) -> Result<SchemeResult, SchemeError> {
    SchemeError::unless_five_axes(machine, "poly25")?;
    let kinematics = Kinematics::new(machine, errors).with_policy(options.policy);
    let zero = options.zero(machine, errors)?;
    let lattice = Lattice::over(machine, wanted.nodes);
    let basis = Basis::new(machine);
    let coefficients = match wanted.objective {
        Objective::Corrections => of_corrections(&kinematics, &lattice, &basis)?,
        Objective::Error => error::of_error(&kinematics, &lattice, &basis),
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
    let count = machine.axes.len();
    let terms = (0..count * count).map(|number| {
        let (output, input) = (number / count, number % count);
        Term {
            output: output as u8,
            weight: 1.0,
            limits: None,
            factors: std::iter::once((input * count + output) as u8).collect(),
        }
    });
    Ok(SchemeResult {
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

/// The axis whose tables hold the offsets: X, as in the document, or else the first.
fn offset_with(machine: &Machine) -> usize {
    machine.index('X').unwrap_or(0)
}

/// Coefficients (functions × outputs) that minimize the difference from the corrections.
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

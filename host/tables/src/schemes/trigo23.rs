//! The scheme `trigo23`: 23 tables, with trigonometric functions of one rotary axis as factors.
//!
//! Source document, Chapter 6. Eq. 44, in its notation, with `A` the rotary axis and I one of X, Y, Z: Δq_I = a +
//! q_X·f(A) + q_Y·g(A) + q_Z·h(A), and one such function for Δq of each rotary axis, where f, g and h are sums of 1,
//! cos, sin, cos·sin, sin² and cos². Eq. 45 turns it into 23 tables: 7 for each linear axis, LUT₁ + LUT₂·LUT₃ +
//! LUT₄·LUT₅ + LUT₆·LUT₇, and one for each rotary axis.
//!
//! sin² + cos² is 1, so one of the six functions is left out. In the printed form LUT₁, LUT₈ and LUT₁₅ are
//! constants. They can be any function of A without an additional table, which is the free form.

mod basis;
mod tables;

use super::blank::blank;
use super::lattice::Lattice;
use super::moments::{Moments, SAMPLED};
use super::points::Points;
use super::{Options, SchemeError, SchemeResult};
use basis::Basis;
use tables::Fitted;
use trueaxis::Draft;
use trueaxis_model::errors::{ErrorModel, Situation, Switches};
use trueaxis_model::kinematics::{Kinematics, NotConverged};
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_model::parallel;

/// Default number of points of each table (section 6.5.3).
pub const POINTS: usize = 10;
/// Number of positions along each linear axis over which the free functions are averaged. Corrections are cubic in
/// these positions, so 4 give the same mean as more.
const MEANS: usize = 4;

/// Options of this scheme.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// LUT₁, LUT₈ and LUT₁₅ are free functions of the rotary axis instead of constants.
    pub free: bool,
    /// Number of positions along each axis of the grid to which it is fitted.
    pub nodes: usize,
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
    SchemeError::unless_five_axes(machine, "trigo23")?;
    let kinematics = Kinematics::new(machine, errors).with_policy(options.policy);
    let zero = options.zero(machine, errors)?;
    let lattice = Lattice::over(machine, wanted.nodes);
    let basis = Basis::new(machine, wanted.free);
    let moments = Moments::over(&kinematics, &lattice, basis.count(), |q, into| {
        basis.values(q, into);
    })?;
    // Use the rotary axis that gives the better fit, whether or not LUT₁ is free.
    let left = |rotary: usize| -> f64 {
        let all = basis.of(rotary, 0..4);
        basis.linear.iter().map(|i| moments.left(&all, *i)).sum()
    };
    let rotary = usize::from(left(1) < left(0));
    let points = Points::over(
        machine,
        basis.rotary[rotary],
        options.points.unwrap_or(POINTS),
    );
    let fitted = Fitted {
        machine,
        basis: &basis,
        moments: &moments,
        rotary,
        zero,
    };
    let free = match wanted.free {
        true => Some(means(
            &kinematics,
            wanted.nodes,
            basis.rotary[rotary],
            &points.at,
        )?),
        false => None,
    };
    let (banks, terms) = fitted.tables(&points, free.as_deref(), options.format);
    let letter = machine.axes[basis.rotary[rotary]].letter;
    let mut notes = vec![format!("functions of {letter}")];
    notes.extend(super::without_direction(machine, errors));
    Ok(SchemeResult {
        draft: Draft {
            banks,
            terms,
            ..blank(&kinematics)
        },
        structure_error: None,
        meets: None,
        is_full: false,
        notes,
    })
}

/// The mean correction of every axis (mm, rad) at given angles (rad) of a rotary axis, over the travel of all
/// others.
fn means(
    kinematics: &Kinematics<'_>,
    nodes: usize,
    axis: usize,
    angles: &[f64],
) -> Result<Vec<PerAxis>, NotConverged> {
    let machine = kinematics.machine;
    let situation = Situation::default();
    let others = (0..machine.axes.len()).filter(|i| *i != axis);
    let turning: Vec<usize> = others
        .filter(|i| machine.axes[*i].letter.is_rotary())
        .collect();
    let add = |sum: &mut PerAxis, q: &PerAxis| {
        let found = kinematics.correction_within(q, &situation, &Switches::ALL, SAMPLED)?;
        for (sum, d) in sum.iter_mut().zip(found.dq) {
            *sum += d;
        }
        Ok(())
    };
    let join = |total: &mut PerAxis, sum: PerAxis| {
        for (total, sum) in total.iter_mut().zip(sum) {
            *total += sum;
        }
    };
    let mean = |angle: &f64| {
        let lattice = Lattice::over(machine, MEANS).with(axis, &[*angle]);
        let lattice = turning
            .iter()
            .fold(lattice, |lattice, i| lattice.evenly(machine, *i, nodes));
        let sum = lattice.sum(PerAxis::default, add, join)?;
        Ok(sum.map(|sum| sum / lattice.nodes() as f64))
    };
    parallel::try_map(angles, mean)
}

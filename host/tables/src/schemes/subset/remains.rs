//! The volumetric error that remains with a set of tables.
//!
//! At a position, the tool's twist with corrections Δq is that with the kinematic correction Δq*, plus J·(Δq − Δq*).
//! The mean square of what remains, with rotations taken at a lever, is a quadratic function of everything that tables
//! may hold. The minimum for any set of tables follows from one matrix.

use super::candidates::{Candidate, Functions};
use nalgebra::{DMatrix, DVector};
use trueaxis_model::errors::Switches;
use trueaxis_model::kinematics::{Kinematics, NotConverged, Policy};
use trueaxis_model::machine::PerAxis;
use trueaxis_model::parallel;
use trueaxis_model::validate::Command;

/// The lever (mm) on which rotations count as translations of the tip.
pub const LEVER: f64 = 100.0;
/// Regularization: added to a function's square, as a fraction of it, so that functions explained by others get no
/// coefficient.
const HELD: f64 = 1e-12;
/// Rows of a position: translation, rotation, and the policy's terms for up to three rotary axes.
const ROWS: usize = 9;

/// The quadratic function of all candidates.
pub struct Remains {
    /// The candidates.
    pub candidates: Vec<Candidate>,
    /// Index of the first coefficient of each, and one past the last.
    starts: Vec<usize>,
    /// Mean products of every two functions; scaled so that each function's own is 1.
    products: DMatrix<f64>,
    /// Mean product of every function with the error to be removed.
    wanted: DVector<f64>,
    /// The scale factor by which each function was divided.
    scales: Vec<f64>,
    /// Mean square without any tables (mm²).
    pub before: f64,
}

impl Remains {
    /// Evaluates the candidates at the positions of some commands.
    ///
    /// # Errors
    /// [`NotConverged`].
    pub fn new(
        kinematics: &Kinematics<'_>,
        candidates: Vec<Candidate>,
        functions: &Functions,
        commands: &[Command],
    ) -> Result<Self, NotConverged> {
        let mut starts = vec![0];
        for candidate in &candidates {
            let count = functions.term(candidate, &PerAxis::default()).len();
            starts.push(starts[starts.len() - 1] + count);
        }
        let count = starts[candidates.len()];
        let rows = parallel::try_map(commands, |command| {
            let (q, situation) = command.kinematic(kinematics.machine);
            let star = kinematics.correction(&q, &situation, &Switches::ALL)?.dq;
            let left = kinematics.volumetric_error(&q, &star, &situation);
            let effects = effects(kinematics, &q, situation.length);
            let mut wanted = [0.0; ROWS];
            let counted = counted(kinematics, &left.to_array());
            wanted[..6].copy_from_slice(&counted);
            for (effect, star) in effects.iter().zip(star) {
                for (w, e) in wanted.iter_mut().zip(effect).take(6) {
                    *w -= e * star;
                }
            }
            let mut parts = vec![0.0; count * ROWS];
            for (k, candidate) in candidates.iter().enumerate() {
                let values = functions.term(candidate, &q);
                for (n, value) in values.iter().enumerate() {
                    for (row, effect) in effects[candidate.output].iter().enumerate() {
                        parts[(starts[k] + n) * ROWS + row] = value * effect;
                    }
                }
            }
            Ok::<_, NotConverged>((parts, wanted))
        })?;
        let all = DMatrix::from_fn(rows.len() * ROWS, count, |row, column| {
            rows[row / ROWS].0[column * ROWS + row % ROWS]
        });
        let target = DVector::from_fn(rows.len() * ROWS, |row, _| rows[row / ROWS].1[row % ROWS]);
        let mean = 1.0 / rows.len() as f64;
        let mut products = all.tr_mul(&all) * mean;
        let mut wanted = all.tr_mul(&target) * -mean;
        let scale = |k: usize| products[(k, k)].sqrt().max(f64::MIN_POSITIVE);
        let scales: Vec<f64> = (0..count).map(scale).collect();
        for i in 0..count {
            wanted[i] /= scales[i];
            for j in 0..count {
                products[(i, j)] /= scales[i] * scales[j];
            }
        }
        Ok(Self {
            candidates,
            starts,
            products,
            wanted,
            scales,
            before: target.norm_squared() * mean,
        })
    }

    /// The smallest mean square (mm²) with a set of candidates (by index).
    pub fn left(&self, chosen: &[usize]) -> f64 {
        let (places, numbers) = self.solved(chosen);
        let removed: f64 = places
            .iter()
            .zip(numbers.iter())
            .map(|(p, n)| self.wanted[*p] * n)
            .sum();
        self.before - removed
    }

    /// The coefficients of each candidate of a set (by index), for its unscaled functions (mm, rad).
    pub fn numbers(&self, chosen: &[usize]) -> Vec<Vec<f64>> {
        let (places, numbers) = self.solved(chosen);
        let mut scaled = places
            .iter()
            .zip(numbers.iter())
            .map(|(p, n)| n / self.scales[*p]);
        let of = |c: &usize| {
            scaled
                .by_ref()
                .take(self.starts[c + 1] - self.starts[*c])
                .collect()
        };
        chosen.iter().map(of).collect()
    }

    fn solved(&self, chosen: &[usize]) -> (Vec<usize>, DVector<f64>) {
        let of = |c: &usize| self.starts[*c]..self.starts[c + 1];
        let places: Vec<usize> = chosen.iter().flat_map(of).collect();
        let count = places.len();
        let held = |i: usize, j: usize| if i == j { HELD } else { 0.0 };
        let product = |i: usize, j: usize| self.products[(places[i], places[j])] + held(i, j);
        let products = || DMatrix::from_fn(count, count, product);
        let wanted = DVector::from_fn(count, |i, _| self.wanted[places[i]]);
        // Regularized, the matrix is positive definite, but only just, so rounding decides.
        let solution = match products().cholesky() {
            Some(known) => known.solve(&wanted),
            None => {
                let known = products().symmetric_eigen();
                let inverse = |v: f64| if v > HELD { 1.0 / v } else { 0.0 };
                let inverse = known.eigenvalues.map(inverse);
                let inside = known.eigenvectors.tr_mul(&wanted).component_mul(&inverse);
                known.eigenvectors * inside
            }
        };
        (places, solution)
    }
}

/// Effect of one unit (mm, rad) of each axis: translation (mm), rotation at the lever as far as it counts (mm), and,
/// under `direction`, the damping term.
fn effects(kinematics: &Kinematics<'_>, q: &PerAxis, length: Option<f64>) -> Vec<[f64; ROWS]> {
    let machine = kinematics.machine;
    let jacobian = kinematics.jacobian(q, length);
    let damping = match kinematics.policy {
        Policy::Direction { damping } => damping,
        Policy::Orientation | Policy::Position => 0.0,
    };
    let mut effects = Vec::new();
    let mut rotary = 0;
    for (i, axis) in machine.axes.iter().enumerate() {
        let mut effect = [0.0; ROWS];
        effect[..6].copy_from_slice(&counted(kinematics, &jacobian.column(i)));
        if axis.letter.is_rotary() {
            effect[6 + rotary] = LEVER * damping;
            rotary += 1;
        }
        effects.push(effect);
    }
    effects
}

/// The part of a twist (mm, rad) that counts under the policy, in mm.
fn counted(kinematics: &Kinematics<'_>, twist: &[f64; 6]) -> [f64; 6] {
    let mut counted = *twist;
    for (row, value) in counted[3..].iter_mut().enumerate() {
        let counts = match kinematics.policy {
            Policy::Orientation => true,
            Policy::Direction { .. } => row != kinematics.machine.tool_axis,
            Policy::Position => false,
        };
        *value *= if counts { LEVER } else { 0.0 };
    }
    counted
}

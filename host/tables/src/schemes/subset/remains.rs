//! What a set of tables leaves of the volumetric error.
//!
//! At some positions the tool's twist with corrections Δq is that with the kinematic correction Δq*, and J·(Δq − Δq*)
//! more. Its mean square, rotations at a lever, is a quadratic function of all that tables may hold: of each set
//! of tables the least is found from one matrix.

use super::candidates::{Candidate, Functions};
use crate::validate::Command;
use nalgebra::{DMatrix, DVector};
use trueaxis_model::errors::Switches;
use trueaxis_model::kinematics::{Kinematics, NotConverged, Policy};
use trueaxis_model::machine::PerAxis;
use trueaxis_model::parallel;

/// The lever (mm) at which rotations count as much as translations of the tip.
pub const LEVER: f64 = 100.0;
/// Part of a function's square by which its number is held: those that others explain get none.
const HELD: f64 = 1e-12;
/// Rows of a position: translation, rotation, and what the policy asks of up to three rotary axes.
const ROWS: usize = 9;

/// The quadratic function, for all candidates.
pub struct Remains {
    /// The candidates.
    pub candidates: Vec<Candidate>,
    /// Where the numbers of each begin; one more at the end.
    starts: Vec<usize>,
    /// Of every two functions the mean product, of each with itself 1.
    products: DMatrix<f64>,
    /// Of every function the mean product with what is to be removed.
    wanted: DVector<f64>,
    /// What functions were divided by.
    scales: Vec<f64>,
    /// Mean square without tables (mm²).
    pub before: f64,
}

impl Remains {
    /// At the positions of some commands.
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

    /// The least mean square (mm²) that a set of candidates (by index) leaves.
    pub fn left(&self, chosen: &[usize]) -> f64 {
        let (places, numbers) = self.solved(chosen);
        let removed: f64 = places
            .iter()
            .zip(numbers.iter())
            .map(|(p, n)| self.wanted[*p] * n)
            .sum();
        self.before - removed
    }

    /// The numbers of each candidate of a set (by index), for its functions as they are (mm, rad).
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
        // Held as it is, the matrix is positive; by how little, rounding decides.
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

/// What a unit (mm, rad) of each axis does: translation (mm), counted rotation at the lever (mm), and, under
/// `direction`, what the damping makes of it.
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

/// What counts of a twist (mm, rad) under the policy, in mm.
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

//! Tests a structure before its tables get points.

use super::points;
use super::sampling::Sampler;
use super::structure::{self, Decomposition, Function, Sampled};
use super::variables::{Kind, MAX_VARIABLES, Variable, VariableValues};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::collections::BTreeMap;
use trueaxis_model::kinematics::NotConverged;
use trueaxis_model::machine::PerAxis;

/// Number of positions at which a structure is tried, half of them in corners; a single one decides little.
const TRIALS: usize = 160;

/// A random place in the calibrated ranges, with a random direction of travel where it matters.
pub(crate) fn random_place(variables: &[Variable], random: &mut Pcg64Mcg) -> VariableValues {
    let mut place = [0.0; MAX_VARIABLES];
    for (x, variable) in place.iter_mut().zip(variables) {
        let [low, high] = variable.calibrated;
        *x = match variable.kind {
            Kind::Sign(_) => {
                if random.random::<bool>() {
                    1.0
                } else {
                    -1.0
                }
            }
            _ => low + (high - low) * random.random::<f64>(),
        };
    }
    place
}

/// Moves every variable to the nearer end of its calibrated range, or as close as possible without any motion
/// holding its end value for a correction of 1 %. Most effects are largest in corners.
pub(crate) fn to_corner(variables: &[Variable], place: &mut VariableValues) {
    for (x, variable) in place.iter_mut().zip(variables) {
        let [low, high] = variable.calibrated;
        let inset = if variable.ends.is_empty() {
            0.0
        } else {
            0.01 * (high - low)
        };
        *x = if *x < 0.5 * (low + high) {
            low + inset
        } else {
            high - inset
        };
    }
}

/// The nearest of some positions, or `x` itself if there are none.
fn nearest(positions: &[f64], x: f64) -> f64 {
    let near = |a: &&f64, b: &&f64| (**a - x).abs().total_cmp(&(**b - x).abs());
    positions.iter().min_by(near).copied().unwrap_or(x)
}

/// Random places with their reference corrections.
pub struct Trials {
    places: Vec<VariableValues>,
    corrections: Vec<PerAxis>,
}

impl Trials {
    /// Draws the places.
    pub fn new(sampler: &Sampler<'_>) -> Result<Self, NotConverged> {
        let mut random = Pcg64Mcg::seed_from_u64(1);
        let (mut places, mut corrections) = (Vec::new(), Vec::new());
        // Where tables are sampled anyway, twice the number of samples costs nothing extra.
        let policy = sampler.kinematics.policy;
        let looks = |variable: &Variable| {
            let grid = points::peak_grid(policy, variable);
            grid.map_or_else(Vec::new, |grid| grid.sampled_at(variable.wraps).collect())
        };
        let seen: Vec<Vec<f64>> = sampler.variables.iter().map(looks).collect();
        for number in 0..TRIALS {
            let mut place = random_place(&sampler.variables, &mut random);
            if number % 2 == 0 {
                to_corner(&sampler.variables, &mut place);
            }
            for (x, seen) in place.iter_mut().zip(&seen) {
                *x = nearest(seen, *x);
            }
            let exact = sampler.exact(&place, u32::MAX)?;
            if sampler.is_near_end(&place, &exact) {
                continue;
            }
            places.push(place);
            corrections.push(std::array::from_fn(|i| exact[i] - sampler.zero[i]));
        }
        Ok(Self {
            places,
            corrections,
        })
    }

    /// Largest reference correction, in units of the tolerance: what a structure without terms leaves.
    pub fn largest(&self, tolerance: &PerAxis) -> f64 {
        let all = self
            .corrections
            .iter()
            .flat_map(|c| c.iter().zip(tolerance));
        all.fold(0.0, |most, (c, t)| most.max((c / t).abs()))
    }

    /// Largest difference of the structure from the reference correction, in units of the tolerance.
    pub fn error(&self, found: &Decomposition<'_>) -> Result<f64, NotConverged> {
        let mut sampled: BTreeMap<usize, Sampled> = BTreeMap::new();
        for (v, (bent, straight)) in found.tables() {
            let functions: Vec<Function> = bent.into_iter().chain(straight).collect();
            let at: Vec<f64> = self.places.iter().map(|p| p[v]).collect();
            sampled.insert(v, found.sample(v, &functions, &at)?);
        }
        let mut worst = 0.0_f64;
        for (row, exact) in self.corrections.iter().enumerate() {
            let values = structure::values_at(&sampled, row);
            let outputs = found.sampler.kinematics.machine.axes.len();
            let sums = found.structure.evaluate(&values, outputs);
            for ((s, e), t) in sums.iter().zip(exact).zip(found.tolerance) {
                worst = worst.max((s - e / t).abs());
            }
        }
        Ok(worst)
    }
}

#[cfg(test)]
mod tests {
    use super::super::specimen::{errors, with_rotary};
    use super::super::structure::Structure;
    use super::super::variables::variables;
    use super::*;
    use trueaxis_model::kinematics::Kinematics;

    #[test]
    fn a_structure_without_terms_leaves_the_largest_correction() {
        let machine = with_rotary(&[]);
        // Y goes astray by 2 µm at both ends of X.
        let errors = errors(&machine, "[parameters]\nEYX1 = 1e-5\n");
        let kinematics = Kinematics::new(&machine, &errors);
        let variables = variables(&kinematics, 1e-6);
        let sampler = Sampler::new(&kinematics, variables, PerAxis::default());
        let trials = Trials::new(&sampler).unwrap();
        let tolerance = [1e-3; 6];
        let found = Decomposition {
            sampler: &sampler,
            components: &[],
            bases: &[],
            tolerance: &tolerance,
            structure: &Structure::default(),
        };
        assert_eq!(trials.largest(&tolerance), trials.error(&found).unwrap());
        // Corners are at the ends, or one part in a hundred of the travel inside of them.
        let largest = trials.largest(&tolerance);
        assert!((1.96 - 1e-9..=2.0 + 1e-9).contains(&largest), "{largest}");
    }
}

//! Tests a structure before its tables get points, and fits its weights.

use super::fit::lawson;
use super::points;
use super::sampling::Sampler;
use super::structure::{Decomposition, Function, Structure};
use super::variables::{Kind, MAX_VARIABLES, Variable, VariableValues};
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::collections::BTreeMap;
use trueaxis_model::kinematics::{Jacobian, NotConverged};
use trueaxis_model::machine::PerAxis;
use trueaxis_model::parallel;

/// Number of positions at which a structure is tried and fitted, half of them in corners: as many as at which tables are
/// measured. With a third of them, weights that are fitted here leave up to twice as much there.
const TRIALS: usize = 3000;
/// Number of values of each variable at these positions, besides those in corners: what sampling a table costs.
const VALUES: usize = 100;

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
    /// The values of each variable.
    values: Vec<Vec<f64>>,
    /// Which of them each place has, its reference correction, and the effect of the axes on the tool there.
    tried: Vec<([usize; MAX_VARIABLES], PerAxis, Jacobian)>,
}

/// What the terms of each output leave at the places.
pub struct Left(Vec<Output>);

/// The terms of one output, and what they leave, in units of the tolerance.
struct Output {
    /// Their numbers.
    terms: Vec<usize>,
    /// Places × terms.
    products: DMatrix<f64>,
    left: DVector<f64>,
}

impl Left {
    /// The structure with weights that leave least in each output.
    pub fn fitted(&mut self, structure: &Structure) -> Structure {
        let changes = parallel::map(&self.0, |output| match output.terms.is_empty() {
            true => DVector::zeros(0),
            false => lawson(output.products.clone(), output.left.clone()),
        });
        let mut structure = structure.clone();
        for (output, changes) in self.0.iter_mut().zip(&changes) {
            output.left -= &output.products * changes;
            for (term, change) in output.terms.iter().zip(changes) {
                structure.terms[*term].weight += change;
            }
        }
        structure
    }
}

impl Trials {
    /// Draws the places.
    pub fn new(sampler: &Sampler<'_>) -> Result<Self, NotConverged> {
        let mut random = Pcg64Mcg::seed_from_u64(1);
        let variables = &sampler.variables;
        let mut drawn: Vec<VariableValues> = (0..VALUES)
            .map(|_| random_place(variables, &mut random))
            .collect();
        // The last two are corners.
        for end in 0..2 {
            let mut corner = [0.0; MAX_VARIABLES];
            for (x, variable) in corner.iter_mut().zip(variables) {
                *x = variable.calibrated[end];
            }
            to_corner(variables, &mut corner);
            drawn.push(corner);
        }
        // Where tables are sampled anyway, samples cost nothing extra.
        let seen = |variable: &Variable| -> Vec<f64> {
            let grid = points::peak_grid(sampler.kinematics.policy, variable);
            grid.map_or_else(Vec::new, |grid| grid.sampled_at(variable.wraps).collect())
        };
        let values_of = |(v, variable): (usize, &Variable)| {
            let seen = seen(variable);
            drawn.iter().map(|place| nearest(&seen, place[v])).collect()
        };
        let values: Vec<Vec<f64>> = variables.iter().enumerate().map(values_of).collect();
        let mut draw = |number: usize| -> [usize; MAX_VARIABLES] {
            let among = match number % 2 {
                0 => VALUES..VALUES + 2,
                _ => 0..VALUES,
            };
            std::array::from_fn(|_| random.random_range(among.clone()))
        };
        let places: Vec<[usize; MAX_VARIABLES]> = (0..TRIALS).map(&mut draw).collect();
        let tried = parallel::try_map(&places, |numbers| {
            let mut place = [0.0; MAX_VARIABLES];
            for ((x, values), number) in place.iter_mut().zip(&values).zip(numbers) {
                *x = values[*number];
            }
            let exact = sampler.exact(&place, u32::MAX)?;
            let correction: PerAxis = std::array::from_fn(|i| exact[i] - sampler.zero[i]);
            let is_inside = !sampler.is_near_end(&place, &exact);
            Ok::<_, NotConverged>(is_inside.then(|| {
                let jacobian = sampler.jacobian(&place);
                (*numbers, correction, jacobian)
            }))
        })?;
        let tried = tried.into_iter().flatten();
        Ok(Self {
            values,
            tried: tried.collect(),
        })
    }

    /// What a structure leaves.
    pub fn left(&self, found: &Decomposition<'_>) -> Result<Left, NotConverged> {
        let mut tables: BTreeMap<(usize, Function), Vec<f64>> = BTreeMap::new();
        for (v, (bent, straight)) in found.tables() {
            let functions: Vec<Function> = bent.into_iter().chain(straight).collect();
            let sampled = found.sample(v, &functions, &self.values[v])?;
            for (function, values) in functions.iter().zip(sampled.values.column_iter()) {
                let at = self.tried.iter().map(|(numbers, ..)| values[numbers[v]]);
                tables.insert((v, *function), at.collect());
            }
        }
        let all = &found.structure.terms;
        let output = |number: usize| {
            let terms: Vec<usize> = (0..all.len())
                .filter(|t| all[*t].output == number)
                .collect();
            let mut products = DMatrix::from_element(self.tried.len(), terms.len(), 1.0);
            for (mut product, term) in products.column_iter_mut().zip(&terms) {
                for table in &all[*term].factors {
                    for (x, y) in product.iter_mut().zip(&tables[table]) {
                        *x *= y;
                    }
                }
            }
            let weights = DVector::from_fn(terms.len(), |k, _| all[terms[k]].weight);
            let wanted = |row: usize| self.tried[row].1[number] / found.tolerance[number];
            let left =
                DVector::from_fn(self.tried.len(), |row, _| wanted(row)) - &products * weights;
            Output {
                terms,
                products,
                left,
            }
        };
        let count = found.sampler.kinematics.machine.axes.len();
        Ok(Left((0..count).map(output).collect()))
    }

    /// The largest share of the tolerance that is left, given that of a deviation (mm, rad) at a place.
    pub fn error(
        &self,
        left: &Left,
        tolerance: &PerAxis,
        share: impl Fn(&PerAxis, &Jacobian) -> f64,
    ) -> f64 {
        let at = |row: usize| {
            let mut deviation = PerAxis::default();
            for ((d, output), t) in deviation.iter_mut().zip(&left.0).zip(tolerance) {
                *d = output.left[row] * t;
            }
            share(&deviation, &self.tried[row].2)
        };
        (0..self.tried.len()).map(at).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::super::specimen::{errors, with_rotary};
    use super::super::structure::{Memory, Term};
    use super::super::variables::{Generator, variables};
    use super::super::{basis::Basis, structure::Structure};
    use super::*;
    use trueaxis_model::kinematics::Kinematics;

    const TOLERANCE: PerAxis = [1e-3; 6];

    /// What a structure leaves of an error of Y that grows with X by 2 µm at both ends, before and after its weights are
    /// fitted; and the fitted structure.
    fn left(terms: &[f64]) -> ([f64; 2], Structure, f64) {
        let machine = with_rotary(&[]);
        let errors = errors(&machine, "[parameters]\nEYX1 = 1e-5\n");
        let kinematics = Kinematics::new(&machine, &errors);
        let variables = variables(&kinematics, 1e-6);
        let bases: Vec<Basis> = variables.iter().map(Basis::of_lever).collect();
        let sampler = Sampler::new(&kinematics, variables, PerAxis::default());
        let trials = Trials::new(&sampler).unwrap();
        let mut structure = Structure::default();
        structure.terms.extend(terms.iter().map(|weight| Term {
            output: 1,
            weight: *weight,
            factors: vec![(0, Function::Generator(Generator::Coordinate))],
        }));
        let found = Decomposition {
            sampler: &sampler,
            components: &[],
            bases: &bases,
            tolerance: &TOLERANCE,
            structure: &structure,
            memory: Memory::default(),
        };
        let mut left = trials.left(&found).unwrap();
        let largest =
            |d: &PerAxis, _: &Jacobian| d.iter().fold(0.0_f64, |w, d| w.max(d.abs())) / 1e-3;
        let before = trials.error(&left, &TOLERANCE, largest);
        let fitted = left.fitted(&structure);
        let after = trials.error(&left, &TOLERANCE, largest);
        let sizes = trials
            .tried
            .iter()
            .flat_map(|(_, correction, _)| correction);
        let sizes = sizes.map(|size| size.abs() / 1e-3);
        ([before, after], fitted, sizes.fold(0.0, f64::max))
    }

    #[test]
    fn a_structure_without_terms_leaves_the_largest_correction() {
        let (errors, _, largest) = left(&[]);
        assert_eq!(errors, [largest; 2]);
        // Corners are at the ends, or one part in a hundred of the travel inside of them.
        assert!((1.96 - 1e-9..=2.0 + 1e-9).contains(&largest), "{largest}");
    }

    #[test]
    fn weights_are_fitted_to_what_is_left() {
        let ([before, after], fitted, largest) = left(&[0.0]);
        assert_eq!(before, largest);
        // The ridge holds back a thousandth of a weight in the first round, and a thousandth of that in the next.
        assert!(after < 1e-6, "{after}");
        let weight = fitted.terms[0].weight;
        assert!((weight.abs() - largest).abs() < 0.05, "{weight} {largest}");
    }
}

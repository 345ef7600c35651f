//! Weights of terms, fitted to the exact correction where tables leave something.
//!
//! What was left out of a structure, and what it does not know of, is in part a sum of the products
//! that it has. Weights are fitted by least squares in which a position counts more the more is left
//! there, again and again (Lawson), so that the largest deviation falls, not only the mean one.

use super::limits::{FIT_RIDGE, FIT_ROUNDS, FIT_STEPS};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use trueaxis::{Direction, Draft, DraftBank};

/// A position at which a draft is fitted.
pub struct Sample {
    /// Inputs of the compensation (their own units): axes, then auxiliaries.
    pub inputs: Vec<f64>,
    /// Direction of travel of each axis: −1, 0, 1.
    pub directions: Vec<f64>,
    /// The correction that its tables should give (mm, deg).
    pub wanted: Vec<f64>,
}

/// The draft with the weights of its terms fitted; `tolerance` is that of each output (mm, deg). `None` if no output has a term.
pub fn fitted(draft: &Draft, samples: &[Sample], tolerance: &[f64]) -> Option<Draft> {
    if draft.terms.is_empty() || samples.is_empty() || !draft.grids.is_empty() {
        return None;
    }
    let tables: Vec<Vec<f64>> = samples
        .par_iter()
        .map(|sample| tables(draft, sample))
        .collect();
    let mut draft = draft.clone();
    for (output, unit) in tolerance.iter().enumerate() {
        let terms: Vec<usize> = (0..draft.terms.len())
            .filter(|t| usize::from(draft.terms[*t].output) == output)
            .collect();
        if terms.is_empty() {
            continue;
        }
        let product = |row: usize, term: usize| -> f64 {
            let factors = draft.terms[terms[term]].factors.iter();
            factors.map(|f| tables[row][usize::from(*f)]).product()
        };
        let products = DMatrix::from_fn(samples.len(), terms.len(), product);
        let weights = DVector::from_iterator(
            terms.len(),
            terms.iter().map(|t| f64::from(draft.terms[*t].weight)),
        );
        let wanted = samples.iter().map(|s| s.wanted[output] / unit);
        let left = DVector::from_iterator(samples.len(), wanted) - &products * &weights / *unit;
        let change = lawson(products / *unit, left);
        for (t, change) in terms.iter().zip(change.iter()) {
            draft.terms[*t].weight += *change as f32;
        }
    }
    Some(draft)
}

/// Values of all tables at a position, as the runtime interpolates them.
fn tables(draft: &Draft, sample: &Sample) -> Vec<f64> {
    let mut values = Vec::new();
    for bank in &draft.banks {
        let input = usize::from(bank.input);
        let travel = sample.directions.get(input).copied().unwrap_or(0.0);
        let counts = match bank.direction {
            Direction::Both => 1.0,
            Direction::Signed => travel,
            Direction::Positive => f64::from(travel > 0.0),
            Direction::Negative => f64::from(travel < 0.0),
        };
        let value = |column: &Vec<f32>| counts * interpolated(bank, column, sample.inputs[input]);
        values.extend(bank.columns.iter().map(value));
    }
    values
}

/// One table at a position: linear between points, the end values outside.
fn interpolated(bank: &DraftBank, column: &[f32], x: f64) -> f64 {
    let count = column.len();
    let mut at = (x - f64::from(bank.start)) / f64::from(bank.step);
    if bank.modulo {
        at = at.rem_euclid(count as f64);
    }
    let last = if bank.modulo { count } else { count - 1 };
    let at = at.clamp(0.0, last as f64);
    let left = (at as usize).min(last.saturating_sub(1));
    let point = |i: usize| f64::from(column[i % count]);
    point(left) + (point(left + 1) - point(left)) * (at - left as f64)
}

/// The change of weights that makes the largest of what is left smallest.
fn lawson(mut products: DMatrix<f64>, mut left: DVector<f64>) -> DVector<f64> {
    // Every product counts the same, whatever its unit.
    let scales: Vec<f64> = products
        .column_iter()
        .map(|c| c.norm().max(f64::MIN_POSITIVE))
        .collect();
    for (mut column, scale) in products.column_iter_mut().zip(&scales) {
        column /= *scale;
    }
    let mut counts = DVector::from_element(left.len(), 1.0);
    let mut best = (left.amax(), DVector::zeros(scales.len()));
    let mut change = DVector::zeros(scales.len());
    for _ in 0..FIT_ROUNDS {
        let step = conjugate_gradients(&products, &counts, &left);
        left -= &products * &step;
        change += step;
        if left.amax() < best.0 {
            best = (left.amax(), change.clone());
        }
        let mean = left.iter().map(|r| r.abs()).sum::<f64>() / left.len() as f64;
        if mean == 0.0 {
            break;
        }
        for (count, rest) in counts.iter_mut().zip(left.iter()) {
            *count *= (rest.abs() / mean).sqrt().clamp(0.5, 4.0);
        }
        counts /= counts.mean();
    }
    for (change, scale) in best.1.iter_mut().zip(&scales) {
        *change /= scale;
    }
    best.1
}

/// A few steps towards the weighted least squares solution, from nothing: what little they leave is what
/// the samples hardly tell.
fn conjugate_gradients(
    products: &DMatrix<f64>,
    counts: &DVector<f64>,
    left: &DVector<f64>,
) -> DVector<f64> {
    let mut solution = DVector::zeros(products.ncols());
    let mut rest = products.tr_mul(&left.component_mul(counts));
    let mut direction = rest.clone();
    let mut square = rest.norm_squared();
    let enough = 1e-12 * square;
    for _ in 0..FIT_STEPS {
        if square <= enough {
            break;
        }
        let shown = products * &direction;
        let image = products.tr_mul(&shown.component_mul(counts)) + FIT_RIDGE * &direction;
        let length = square / direction.dot(&image);
        solution.axpy(length, &direction, 1.0);
        rest.axpy(-length, &image, 1.0);
        let next = rest.norm_squared();
        direction = &rest + (next / square) * &direction;
        square = next;
    }
    solution
}

#[cfg(test)]
mod tests {
    use super::super::draft::empty;
    use super::super::specimen::{errors, with_rotary};
    use super::*;
    use trueaxis::{Interpolation, SampleFormat, Term};

    fn bank(input: u8, modulo: bool, direction: Direction, columns: Vec<Vec<f32>>) -> DraftBank {
        DraftBank {
            input,
            start: -1.0,
            step: 1.0,
            modulo,
            direction,
            interpolation: Interpolation::Linear,
            format: SampleFormat::F32,
            columns,
        }
    }

    #[test]
    fn tables_are_interpolated_as_the_runtime_does() {
        let plain = bank(0, false, Direction::Both, vec![vec![1.0, 3.0, 2.0]]);
        let column = &plain.columns[0];
        let at = |bank: &DraftBank, x: f64| interpolated(bank, column, x);
        assert_eq!(
            [-2.0, -1.0, -0.5, 0.25, 1.0, 9.0].map(|x| at(&plain, x)),
            [1.0, 1.0, 2.0, 2.75, 2.0, 2.0]
        );
        let round = bank(0, true, Direction::Both, plain.columns.clone());
        // From the last point on to the first, which comes again after three steps.
        assert_eq!(
            [1.5, 2.0, 5.0, -1.5].map(|x| at(&round, x)),
            [1.5, 1.0, 1.0, 1.5]
        );
    }

    #[test]
    fn weights_of_what_is_there_take_over_what_was_left_out() {
        // x³ is wanted of a table of x: best 3/4·x, with 1/4 left at both ends and at ±1/2.
        let machine = with_rotary(&[]);
        let errors = errors(&machine, "");
        let mut draft = empty(&machine, &errors, &[]);
        draft.banks = vec![bank(0, false, Direction::Both, vec![vec![-1.0, 0.0, 1.0]])];
        draft.terms = vec![Term {
            output: 0,
            weight: 1.0,
            limits: None,
            factors: [0].into_iter().collect(),
        }];
        let samples: Vec<Sample> = (-100..=100)
            .map(|k| f64::from(k) / 100.0)
            .map(|x| Sample {
                inputs: vec![x],
                directions: vec![0.0],
                wanted: vec![x.powi(3)],
            })
            .collect();
        let found = fitted(&draft, &samples, &[1.0]).unwrap();
        // Least squares would give 0.6, which leaves 0.4; eight rounds come near to the best.
        let weight = found.terms[0].weight;
        assert!((0.7..0.78).contains(&weight), "{weight}");
        assert!(fitted(&draft, &[], &[1.0]).is_none());
    }
}

//! Fits the weights of terms to the reference correction where the tables leave a residual.
//!
//! Parts that a structure leaves out, or does not model, are partly sums of the products it has. The weights are
//! fitted by repeated weighted least squares, in which positions with larger residuals count more (Lawson). This
//! reduces the largest deviation, not only the mean.

use nalgebra::{DMatrix, DVector};
use trueaxis::{Draft, DraftBank, Term};
use trueaxis_model::machine::PerAxis;
use trueaxis_model::parallel;
use trueaxis_model::validate::{Command, Runtime};

/// Rounds of reweighting, steps of the first solution, and the ridge added to the squares of the products, which are
/// 1; it is large enough to fix weights that the samples do not determine.
const FIT_ROUNDS: usize = 8;
const FIT_STEPS: usize = 30;
const FIT_RIDGE: f64 = 1e-3;

/// A position at which a draft is fitted.
pub struct Sample {
    /// The position.
    pub command: Command,
    /// The reference correction there (mm, deg).
    pub wanted: PerAxis,
}

/// The draft with fitted weights. `tolerance` is per output (mm, deg). `None` if there is nothing to fit.
pub fn fitted(draft: &Draft, samples: &[Sample], tolerance: &PerAxis) -> Option<Draft> {
    if draft.terms.is_empty() || samples.is_empty() || !draft.grids.is_empty() {
        return None;
    }
    let tables = tables(draft, samples)?;
    let of = |output: usize| -> Vec<usize> {
        let terms = 0..draft.terms.len();
        let to = |t: &usize| usize::from(draft.terms[*t].output) == output;
        terms.filter(to).collect()
    };
    let outputs: Vec<(usize, Vec<usize>)> = (0..tolerance.len()).map(|o| (o, of(o))).collect();
    let changes = parallel::map(&outputs, |(output, terms)| {
        let output = *output;
        let unit = tolerance[output];
        let products = DMatrix::from_fn(samples.len(), terms.len(), |row, term| {
            let factors = draft.terms[terms[term]].factors.iter();
            let product: f64 = factors.map(|f| tables[usize::from(*f)][row]).product();
            product / unit
        });
        let weights = terms.iter().map(|t| f64::from(draft.terms[*t].weight));
        let weights = DVector::from_iterator(terms.len(), weights);
        let wanted = samples.iter().map(|s| s.wanted[output] / unit);
        let left = DVector::from_iterator(samples.len(), wanted) - &products * weights;
        lawson(products, left)
    });
    let mut draft = draft.clone();
    for ((_, terms), changes) in outputs.iter().zip(&changes) {
        for (t, change) in terms.iter().zip(changes) {
            draft.terms[*t].weight += *change as f32;
        }
    }
    Some(draft)
}

/// The values of every table at all positions, from the runtime. It evaluates as many tables at a time as there are
/// outputs, each written to one of them.
fn tables(draft: &Draft, samples: &[Sample]) -> Option<Vec<Vec<f64>>> {
    let bare = Draft {
        banks: Vec::new(),
        terms: Vec::new(),
        ..draft.clone()
    };
    let mut tables = Vec::new();
    for bank in &draft.banks {
        for columns in bank.columns.chunks(draft.axes.len()) {
            let term = |k: u8| Term {
                output: k,
                weight: 1.0,
                limits: None,
                factors: [k].into_iter().collect(),
            };
            let some = Draft {
                banks: vec![DraftBank {
                    columns: columns.to_vec(),
                    ..bank.clone()
                }],
                terms: (0..columns.len() as u8).map(term).collect(),
                ..bare.clone()
            };
            let blob = some.encode().ok()?;
            let runtime = Runtime::load(&blob).ok()?;
            let values = parallel::map(samples, |s| runtime.evaluate(&s.command));
            let table = |k: usize| values.iter().map(|v| f64::from(v[k])).collect();
            tables.extend((0..columns.len()).map(table));
        }
    }
    Some(tables)
}

/// The change of weights that minimizes the largest residual.
pub(super) fn lawson(mut products: DMatrix<f64>, mut left: DVector<f64>) -> DVector<f64> {
    // Scales the products so that all count the same, whatever their unit.
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
    for round in 0..FIT_ROUNDS {
        // Little changes after the first round.
        let steps = if round == 0 { FIT_STEPS } else { FIT_STEPS / 3 };
        let step = conjugate_gradients(&products, &counts, &left, steps);
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

/// A few steps from zero towards the weighted least squares solution. What they leave is hardly determined by the
/// samples.
fn conjugate_gradients(
    products: &DMatrix<f64>,
    counts: &DVector<f64>,
    left: &DVector<f64>,
    steps: usize,
) -> DVector<f64> {
    let mut solution = DVector::zeros(products.ncols());
    let mut rest = products.tr_mul(&left.component_mul(counts));
    let mut direction = rest.clone();
    let mut square = rest.norm_squared();
    let enough = 1e-12 * square;
    for _ in 0..steps {
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
    use super::super::specimen::{errors, with_rotary};
    use super::*;
    use crate::schemes::blank::blank;
    use trueaxis::{Direction, Interpolation, SampleFormat};
    use trueaxis_model::kinematics::Kinematics;

    #[test]
    fn weights_of_what_is_there_take_over_what_was_left_out() {
        // Approximates x³ with a table of x: best is 3/4·x, with a residual of 1/4 at both ends and at ±1/2.
        let machine = with_rotary(&[]);
        let errors = errors(&machine, "");
        let mut draft = blank(&Kinematics::new(&machine, &errors));
        draft.banks = vec![DraftBank {
            input: 0,
            start: -1.0,
            step: 1.0,
            modulo: false,
            direction: Direction::Both,
            interpolation: Interpolation::Linear,
            format: SampleFormat::F32,
            columns: vec![vec![-1.0, 0.0, 1.0]],
        }];
        draft.terms = vec![Term {
            output: 0,
            weight: 1.0,
            limits: None,
            factors: [0].into_iter().collect(),
        }];
        let samples: Vec<Sample> = (-100..=100)
            .map(|k| f64::from(k) / 100.0)
            .map(|x| Sample {
                command: Command::at(&machine, &[x, 0.0, 0.0]),
                wanted: [x.powi(3), 0.0, 0.0, 0.0, 0.0, 0.0],
            })
            .collect();
        let found = fitted(&draft, &samples, &[1.0; 6]).unwrap();
        // Least squares would give 0.6, with a residual of 0.4; eight rounds come close to the optimum.
        let weight = found.terms[0].weight;
        assert!((0.7..0.78).contains(&weight), "{weight}");
        assert!(fitted(&draft, &[], &[1.0; 6]).is_none());
    }
}

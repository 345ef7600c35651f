//! Two plain, independent implementations of the evaluation that work on the draft instead of the blob: one in f32 that
//! follows `docs/src/format.md` to the letter and must agree in every bit, and one in f64, written differently, that
//! bounds the rounding error of the first.

use std::vec::Vec;

use crate::*;

fn columns(draft: &Draft) -> impl Iterator<Item = (&DraftBank, &Vec<f32>)> {
    draft
        .banks
        .iter()
        .flat_map(|bank| bank.columns.iter().map(move |column| (bank, column)))
}

/// Factor applied to a table's value: 1, 0 or −1.
fn sign(draft: &Draft, bank: &DraftBank, travel: &[Travel]) -> f32 {
    if bank.direction == Direction::Both {
        return 1.0;
    }
    assert!(usize::from(bank.input) < draft.axes.len());
    match (bank.direction, travel[usize::from(bank.input)]) {
        (Direction::Positive | Direction::Signed, Travel::Positive) => 1.0,
        (Direction::Negative, Travel::Negative) => 1.0,
        (Direction::Signed, Travel::Negative) => -1.0,
        _ => 0.0,
    }
}

/// Interval and fraction, in f32 as specified, with the number of intervals without modulo.
fn interval(
    x: f32,
    start: f32,
    step: f32,
    (points, intervals): (usize, usize),
    modulo: bool,
) -> (usize, f32) {
    let mut d = x - start;
    if modulo {
        let period = points as f32 * step;
        let p = d * (1.0 / period);
        let p = if p.is_nan() {
            4_194_304.0
        } else {
            p.clamp(-4_194_304.0, 4_194_304.0)
        };
        d -= p.floor() * period;
    }
    let mut u = d * (1.0 / step);
    if u.is_nan() || u <= 0.0 {
        u = 0.0;
    }
    if modulo {
        if u >= points as f32 {
            u = 0.0;
        }
    } else if u >= intervals as f32 {
        u = intervals as f32;
    }
    let i = u.floor() as usize;
    (i, u - i as f32)
}

/// Index of the next point; after the last point comes the last again or, with modulo, the first.
fn next(i: usize, points: usize, modulo: bool) -> usize {
    match (i + 1 < points, modulo) {
        (true, _) => i + 1,
        (false, true) => 0,
        (false, false) => points - 1,
    }
}

/// Value of one table, in f32 as specified, with the column as stored (scale 1).
fn table(bank: &DraftBank, column: &[f32], x: f32) -> f32 {
    let n = column.len();
    if bank.interpolation == Interpolation::Linear {
        let (i, t) = interval(x, bank.start, bank.step, (n, n - 1), bank.modulo);
        let (b, c) = (column[i], column[next(i, n, bank.modulo)]);
        return b + (c - b) * t;
    }
    let (i, t) = interval(x, bank.start, bank.step, (n, n - 3), bank.modulo);
    let s = 1.0 - t;
    let sixth = f32::from_bits(0x3E2A_AAAB);
    let w0 = sixth * (s * s * s);
    let w2 = sixth + 0.5 * t * (1.0 + t * s);
    let w3 = sixth * (t * t * t);
    let [a, b, c, d] = [0, 1, 2, 3].map(|k| column[(i + k) % n]);
    b + (w0 * (a - b) + w2 * (c - b) + w3 * (d - b))
}

/// The specification in f32. All samples are stored as f32.
pub fn to_the_letter(
    draft: &Draft,
    inputs: &[f32],
    travel: &[Travel],
    weights: &[f32],
) -> Vec<f32> {
    let values: Vec<f32> = columns(draft)
        .map(|(bank, column)| {
            let sign = sign(draft, bank, travel);
            if sign == 0.0 {
                0.0
            } else {
                sign * table(bank, column, inputs[usize::from(bank.input)])
            }
        })
        .collect();
    let mut sums = std::vec![0.0_f32; draft.axes.len()];
    for (term, &weight) in draft.terms.iter().zip(weights) {
        let mut product = weight;
        for &factor in &term.factors {
            product *= values[usize::from(factor)];
        }
        sums[usize::from(term.output)] += product;
    }
    for grid in &draft.grids {
        for (place, &output) in grid.outputs.iter().enumerate() {
            sums[usize::from(output)] += grid_value(grid, &grid.axes, inputs, 0, place);
        }
    }
    sums
}

/// Interpolates along the last input innermost.
fn grid_value(
    grid: &DraftGrid,
    axes: &[GridAxis],
    inputs: &[f32],
    node: usize,
    place: usize,
) -> f32 {
    let Some((axis, inner)) = axes.split_first() else {
        return grid.values[node * grid.outputs.len() + place];
    };
    let x = inputs[usize::from(axis.input)];
    let points = axis.points as usize;
    let counts = (points, points - 1);
    let (i, t) = interval(x, axis.start, axis.step, counts, axis.modulo);
    let next = next(i, points, axis.modulo);
    let a = grid_value(grid, inner, inputs, node * points + i, place);
    let b = grid_value(grid, inner, inputs, node * points + next, place);
    a + (b - a) * t
}

/// Exact value of a table in f64, and a bound on the f32 error.
fn exact(bank: &DraftBank, column: &[f32], x: f64) -> (f64, f64) {
    let points = column.len();
    let intervals = match (bank.modulo, bank.interpolation) {
        (true, _) => points,
        (false, Interpolation::Linear) => points - 1,
        (false, Interpolation::Cubic) => points - 3,
    };
    let distance = (x - f64::from(bank.start)) / f64::from(bank.step);
    let u = if bank.modulo {
        distance.rem_euclid(intervals as f64)
    } else {
        distance.clamp(0.0, intervals as f64)
    };
    let i = (u.floor() as usize).min(intervals - 1);
    let t = u - i as f64;
    let at = |k: usize| f64::from(column[(i + k) % points]);
    let peak = column
        .iter()
        .fold(0.0_f64, |m, &v| m.max(f64::from(v).abs()));
    // The subtraction, the inverse and the product each round once, relative to `distance` (or, where the start
    // cancels, to x / step); the period and its multiple add two more.
    let size = distance.abs().max((x / f64::from(bank.step)).abs()) + 1.0;
    let u_error = 6.0 * f64::from(f32::EPSILON) * size;
    // The steepest slope per step is 2·peak, also for a cubic, because its slopes are averages of differences.
    let error = 2.0 * peak * u_error + 12.0 * f64::from(f32::EPSILON) * peak;
    if bank.interpolation == Interpolation::Linear {
        return (at(0) + (at(1) - at(0)) * t, error);
    }
    // De Boor: three rounds of averaging neighbours.
    let mut row = [0, 1, 2, 3].map(at);
    for left in (1..=3_u8).rev() {
        for k in 0..usize::from(left) {
            // Basis function k reaches from this far before the interval, over `left` intervals.
            let before = f64::from(left) - 1.0 - k as f64;
            let share = (t + before) / f64::from(left);
            row[k] += (row[k + 1] - row[k]) * share;
        }
    }
    (row[0], error)
}

/// Corrections of tables and terms in f64, with a bound on the f32 error.
pub fn in_f64(
    draft: &Draft,
    inputs: &[f32],
    travel: &[Travel],
    weights: &[f32],
) -> Vec<(f64, f64)> {
    let epsilon = f64::from(f32::EPSILON);
    let values: Vec<(f64, f64)> = columns(draft)
        .map(|(bank, column)| {
            let sign = sign(draft, bank, travel);
            if sign == 0.0 {
                (0.0, 0.0)
            } else {
                let (value, size) = exact(bank, column, f64::from(inputs[usize::from(bank.input)]));
                (f64::from(sign) * value, size)
            }
        })
        .collect();
    let mut sums = std::vec![(0.0, 0.0); draft.axes.len()];
    let mut sizes = std::vec![0.0; draft.axes.len()];
    for (term, &weight) in draft.terms.iter().zip(weights) {
        let (mut product, mut largest) = (f64::from(weight), f64::from(weight).abs());
        for &factor in &term.factors {
            let (value, error) = values[usize::from(factor)];
            product *= value;
            largest *= value.abs() + error;
        }
        // Difference between the extreme product and the true one, plus one rounding per factor.
        let error = largest - product.abs() + 8.0 * epsilon * largest;
        let output = usize::from(term.output);
        sizes[output] += largest;
        let sum: &mut (f64, f64) = &mut sums[output];
        sum.0 += product;
        // Each addition rounds relative to a partial sum, which is at most `sizes`.
        sum.1 += error + epsilon * sizes[output];
    }
    sums
}

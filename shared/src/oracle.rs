//! Two plain second implementations of the evaluation, working on the draft instead of the blob:
//! one in f32 that follows `docs/src/format.md` to the letter and must agree in every bit, and one
//! in f64, written differently, that says how far rounding may take the first from the truth.

use std::vec::Vec;

use crate::*;

fn columns(draft: &Draft) -> impl Iterator<Item = (&DraftBank, &Vec<f32>)> {
    draft
        .banks
        .iter()
        .flat_map(|bank| bank.columns.iter().map(move |column| (bank, column)))
}

/// What a table's value is multiplied by: 1, 0 or −1.
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

/// Index, next index and fraction, in f32 as specified.
fn interval(x: f32, start: f32, step: f32, points: usize, modulo: bool) -> (usize, usize, f32) {
    let last = points - 1;
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
    } else if u >= last as f32 {
        u = last as f32;
    }
    let i = u.floor() as usize;
    let next = match (i < last, modulo) {
        (true, _) => i + 1,
        (false, true) => 0,
        (false, false) => last,
    };
    (i, next, u - i as f32)
}

/// Value of one table, in f32 as specified; the column as stored, scale 1.
fn table(bank: &DraftBank, column: &[f32], x: f32) -> f32 {
    let (i, next, t) = interval(x, bank.start, bank.step, column.len(), bank.modulo);
    let (b, c) = (column[i], column[next]);
    if bank.interpolation == Interpolation::Linear {
        return b + (c - b) * t;
    }
    let last = column.len() - 1;
    let s = 1.0 - t;
    let h01 = t * t * (3.0 - 2.0 * t);
    let h10 = t * s * s;
    let h11 = t * t * s;
    let left_end = i == 0 && !bank.modulo;
    let right_end = next == last && !bank.modulo;
    let w0 = if left_end { 0.0 } else { -0.5 * h10 };
    let mut w2 = if left_end { h01 + h10 } else { h01 + 0.5 * h10 };
    if right_end {
        w2 -= h11;
    }
    let w3 = if right_end { 0.0 } else { -0.5 * h11 };
    let a = if left_end {
        b
    } else {
        column[(i + last) % (last + 1)]
    };
    let d = if right_end {
        c
    } else {
        column[(next + 1) % (last + 1)]
    };
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
    let (i, next, t) = interval(x, axis.start, axis.step, points, axis.modulo);
    let a = grid_value(grid, inner, inputs, node * points + i, place);
    let b = grid_value(grid, inner, inputs, node * points + next, place);
    a + (b - a) * t
}

/// Value of a table in f64, as mathematics has it, and how far f32 may be from it.
fn exact(bank: &DraftBank, column: &[f32], x: f64) -> (f64, f64) {
    let n = column.len() as i64;
    let at = |i: i64| {
        f64::from(
            column[(if bank.modulo {
                i.rem_euclid(n)
            } else {
                i.clamp(0, n - 1)
            }) as usize],
        )
    };
    let distance = (x - f64::from(bank.start)) / f64::from(bank.step);
    let u = if bank.modulo {
        distance.rem_euclid(n as f64)
    } else {
        distance.clamp(0.0, (n - 1) as f64)
    };
    let i = (u.floor() as i64).min(if bank.modulo { n - 1 } else { n - 2 });
    let t = u - i as f64;
    let (b, c) = (at(i), at(i + 1));
    let ghost = |inside: bool, i: i64, otherwise: f64| {
        if inside || bank.modulo {
            at(i)
        } else {
            otherwise
        }
    };
    let a = ghost(i > 0, i - 1, 2.0 * b - c);
    let d = ghost(i + 2 < n, i + 2, 2.0 * c - b);
    let peak = column
        .iter()
        .fold(0.0_f64, |m, &v| m.max(f64::from(v).abs()));
    // The subtraction, the inverse and the product round once each, all relative to `distance`
    // (or, where the start cancels, to x / step); the period and its multiple twice more.
    let size = distance.abs().max((x / f64::from(bank.step)).abs()) + 1.0;
    let u_error = 6.0 * f64::from(f32::EPSILON) * size;
    // The steepest slope per step: 2·peak linear, for a cubic not above 4·peak.
    let error = 4.0 * peak * u_error + 12.0 * f64::from(f32::EPSILON) * peak;
    if bank.interpolation == Interpolation::Linear {
        (b + (c - b) * t, error)
    } else {
        let (m1, m2) = ((c - a) / 2.0, (d - b) / 2.0);
        let v = (2.0 * t.powi(3) - 3.0 * t * t + 1.0) * b
            + (t.powi(3) - 2.0 * t * t + t) * m1
            + (3.0 * t * t - 2.0 * t.powi(3)) * c
            + (t.powi(3) - t * t) * m2;
        (v, error)
    }
}

/// Corrections of tables and terms in f64, with a bound on what f32 may differ.
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
        // Difference between the extreme product and the true one, one rounding per factor.
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

//! Splits the closed form of a group into products of functions of one input each.

use super::form::{TURNS, Variables, turns};
use super::groups::Group;
use crate::schemes::points::Points;
use crate::schemes::products::{Factor, Function};
use nalgebra::{DMatrix, DVector, RowDVector};

/// In functions of two rotary axes, products below this fraction of the largest are rounding.
const RANK: f64 = 1e-10;
/// A constant counts as a sum of the functions of levers if the remainder is below this fraction of it.
const EXPLAINED: f64 = 1e-9;

/// The chains of a group, at least one: products of tables, each of another input.
pub(crate) fn chains(group: &Group, variables: &Variables, points: &[Points]) -> Vec<Vec<Factor>> {
    let form = &group.form.0;
    let offsets = offsets(form);
    let mut chains = Vec::new();
    for (lever, matrix) in form.iter().enumerate() {
        if lever == 0 && offsets.is_some() {
            continue;
        }
        for (turn, along) in all_products(matrix, variables.outer.len()) {
            let mut factors: Vec<Factor> = group.along.iter().map(plain).collect();
            if let Some(k) = lever.checked_sub(1) {
                let input = variables.levers[k];
                let offset = offsets.as_ref().map_or(0.0, |o| o[k]);
                let coordinate = points[input].at.iter().map(|x| x + offset);
                let coordinate = Factor {
                    is_coordinate: true,
                    ..plain(&function(input, coordinate.collect()))
                };
                multiply(&mut factors, coordinate);
            }
            // A constant function becomes a factor in another table.
            let mut times = 1.0;
            let of_outer = variables.outer.iter().zip(&turn).map(|(axis, turn)| {
                let values = points[*axis].at.iter().map(|angle| {
                    let turns = turns(*angle);
                    turns.iter().zip(turn).map(|(t, c)| t * c).sum()
                });
                (*axis, values.collect::<Vec<f64>>())
            });
            for (input, values) in of_outer.chain([(variables.middle, along.clone())]) {
                match constant(&values) {
                    Some(value) => times *= value,
                    None => multiply(&mut factors, plain(&function(input, values))),
                }
            }
            scale(&mut factors, times, group.output, points);
            chains.push(factors);
        }
    }
    chains
}

fn function(input: usize, values: Vec<f64>) -> Function {
    Function {
        input,
        signed: false,
        values,
    }
}

fn plain(function: &Function) -> Factor {
    Factor {
        function: function.clone(),
        is_coordinate: false,
    }
}

/// The value of a constant function, or `None`.
fn constant(values: &[f64]) -> Option<f64> {
    let largest = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let same = values
        .iter()
        .all(|v| (v - values[0]).abs() <= 1e-12 * largest);
    same.then(|| values[0])
}

/// Adds a factor; tables of the same input are merged into one.
fn multiply(factors: &mut Vec<Factor>, factor: Factor) {
    let function = &factor.function;
    let same = factors
        .iter_mut()
        .find(|f| f.function.input == function.input);
    let Some(known) = same else {
        factors.push(factor);
        return;
    };
    known.is_coordinate = false;
    known.function.signed |= function.signed;
    for (value, by) in known.function.values.iter_mut().zip(&function.values) {
        *value *= by;
    }
}

/// Multiplies a product by a number, in a table that is not shared if there is one. A product without factors gets a
/// table of the output axis.
pub fn scale(factors: &mut Vec<Factor>, times: f64, output: usize, points: &[Points]) {
    if factors.is_empty() {
        let values = vec![1.0; points[output].at.len()];
        factors.push(plain(&function(output, values)));
    }
    if times == 1.0 {
        return;
    }
    let own = factors.iter().position(|f| !f.is_coordinate).unwrap_or(0);
    factors[own].is_coordinate = false;
    for value in &mut factors[own].function.values {
        *value *= times;
    }
}

/// Offsets of the levers that include the constant of a form in their products: (Z − t)·f(A) instead of Z·f(A) −
/// t·f(A). `None` if there are none.
fn offsets(form: &[DMatrix<f64>]) -> Option<Vec<f64>> {
    let flat = |m: &DMatrix<f64>| DVector::from_column_slice(m.as_slice());
    let constant = flat(&form[0]);
    let levers: Vec<DVector<f64>> = form[1..].iter().map(flat).collect();
    let mut offsets = vec![0.0; levers.len()];
    let enough = EXPLAINED * constant.norm();
    if enough == 0.0 {
        return Some(offsets);
    }
    // Use a single lever if possible.
    for (k, lever) in levers.iter().enumerate() {
        let offset = constant.dot(lever) / lever.norm_squared();
        if (&constant - lever * offset).norm() <= enough {
            offsets[k] = offset;
            return Some(offsets);
        }
    }
    if levers.is_empty() {
        return None;
    }
    let found = DMatrix::from_columns(&levers)
        .svd(true, true)
        .solve(&constant, RANK)
        .ok()?;
    let sum = levers
        .iter()
        .zip(found.iter())
        .map(|(lever, offset)| lever * *offset);
    let rest = sum.fold(constant.clone(), |rest, part| rest - part);
    (rest.norm() <= enough).then(|| {
        // Rounding errors instead of zeros would keep tables from being shared.
        let most = found.amax();
        let clean = |offset: &f64| {
            if offset.abs() < RANK * most {
                0.0
            } else {
                *offset
            }
        };
        found.iter().map(clean).collect()
    })
}

/// A matrix as a sum of products: coefficients of the functions of each outer rotary axis, and values along the middle one.
fn all_products(matrix: &DMatrix<f64>, outer: usize) -> Vec<(Vec<Vec<f64>>, Vec<f64>)> {
    let mut all = Vec::new();
    for (turn, along) in products(matrix) {
        let along: Vec<f64> = along.iter().copied().collect();
        if outer == 1 {
            all.push((vec![turn.iter().copied().collect()], along));
            continue;
        }
        let both = DMatrix::from_row_slice(TURNS, TURNS, turn.as_slice());
        for (first, last) in products(&both) {
            let turns = vec![
                first.iter().copied().collect(),
                last.iter().copied().collect(),
            ];
            all.push((turns, along.clone()));
        }
    }
    all
}

/// A matrix as the smallest number of products of a column and a row, by repeatedly splitting off the row with the
/// largest number.
fn products(matrix: &DMatrix<f64>) -> Vec<(DVector<f64>, RowDVector<f64>)> {
    let enough = RANK * matrix.amax();
    let mut rest = matrix.clone();
    let mut products = Vec::new();
    while products.len() < matrix.nrows() && rest.amax() > enough {
        let (row, column) = rest.iamax_full();
        let along = rest.row(row).into_owned();
        let mut turn = rest.column(column) / rest[(row, column)];
        for t in turn.iter_mut().filter(|t| t.abs() < RANK) {
            *t = 0.0;
        }
        rest -= &turn * &along;
        rest.row_mut(row).fill(0.0);
        products.push((turn, along));
    }
    products
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sum_of_two_products_is_found_as_two_products() {
        let matrix = DMatrix::from_fn(TURNS, 7, |r, c| {
            let (r, c) = (r as f64, c as f64);
            (1.0 + r) * libm::cos(0.3 * c) + r * r * (0.1 + c)
        });
        let found = products(&matrix);
        assert_eq!(found.len(), 2);
        let sum = found
            .iter()
            .fold(DMatrix::zeros(TURNS, 7), |s, (u, v)| s + u * v);
        // Rounding of numbers up to 100.
        assert!((sum - matrix).amax() < 1e-12);
    }

    #[test]
    fn a_constant_that_is_part_of_levers_becomes_their_offsets() {
        let f = DMatrix::from_fn(
            TURNS,
            5,
            |r, c| if r == 0 { libm::sin(c as f64) } else { 0.0 },
        );
        let g = DMatrix::from_fn(TURNS, 5, |r, c| if r == 1 { 1.0 + c as f64 } else { 0.0 });
        let one = offsets(&[&f * -130.0, g.clone(), f.clone()]).unwrap();
        assert!(one[0] == 0.0 && (one[1] + 130.0).abs() < 1e-9);
        let two = offsets(&[&f * 20.0 + &g * 5.0, f.clone(), g.clone()]).unwrap();
        assert!((two[0] - 20.0).abs() < 1e-9 && (two[1] - 5.0).abs() < 1e-9);
        let h = DMatrix::from_element(TURNS, 5, 1.0);
        assert_eq!(offsets(&[h, f, g]), None);
    }
}

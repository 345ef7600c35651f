//! The triangular factor of a Jacobian, which gives steps and uncertainties.

use nalgebra::{DMatrix, DVector, DVectorView};
use std::iter::StepBy;
use std::ops::Range;

/// A Jacobian with columns scaled to length 1, as the triangle R of its QR factorisation.
#[derive(Clone, Debug)]
pub(crate) struct ScaledFactor {
    /// The unknowns it contains, ascending.
    unknowns: Vec<usize>,
    /// Original lengths of their columns; 1 for a column of zeros.
    lengths: Vec<f64>,
    /// Column of the triangle of each unknown.
    places: Vec<usize>,
    triangle: DMatrix<f64>,
}

/// An unknown whose column is zero except in some rows, where all other unknowns of this kind are zero. Coordinates
/// of balls are such unknowns.
#[derive(Clone, Debug)]
pub(crate) struct Alone {
    /// Index of the unknown.
    pub unknown: usize,
    /// The rows where it is nonzero.
    pub rows: StepBy<Range<usize>>,
}

impl ScaledFactor {
    /// For some of the unknowns, ascending; `jacobian` is equations × unknowns, with at least as many equations as
    /// unknowns. `None` if a column is not finite, or if its square overflows or underflows: the search for singular
    /// values would not end.
    ///
    /// The `alone` unknowns become the first columns of the triangle. They need no full reflection: their directions
    /// are subtracted from the other columns.
    pub fn new(jacobian: &DMatrix<f64>, unknowns: Vec<usize>, alone: &[Alone]) -> Option<Self> {
        let length = |unknown: &usize| {
            let column = jacobian.column(*unknown);
            match column.norm_squared() {
                0.0 if column.iter().all(|v| *v == 0.0) => Some(1.0),
                square if square.is_normal() => Some(square.sqrt()),
                _ => None,
            }
        };
        let lengths: Vec<f64> = unknowns.iter().map(length).collect::<Option<_>>()?;
        let place = |unknown: &usize| unknowns.binary_search(unknown).ok();
        let (first, alone): (Vec<usize>, Vec<&Alone>) = (alone.iter())
            .filter_map(|alone| Some((place(&alone.unknown)?, alone)))
            .unzip();
        let rest = (0..unknowns.len()).filter(|i| !first.contains(i));
        let order: Vec<usize> = first.iter().copied().chain(rest).collect();
        let (n, k) = (unknowns.len(), first.len());
        let numbers: Vec<usize> = order[k..].iter().map(|i| unknowns[*i]).collect();
        let mut others = jacobian.select_columns(&numbers);
        let mut whole = DMatrix::zeros(n, n);
        let directions: Vec<Vec<f64>> = (alone.iter().zip(&first))
            .map(|(alone, i)| {
                let column = jacobian.column(alone.unknown);
                let parts = alone.rows.clone().map(|row| column[row] / lengths[*i]);
                parts.collect()
            })
            .collect();
        for (i, direction) in directions.iter().enumerate() {
            whole[(i, i)] = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
        }
        for (c, mut column) in others.column_iter_mut().enumerate() {
            column /= lengths[order[k + c]];
            for (i, (alone, direction)) in alone.iter().zip(&directions).enumerate() {
                let rows = || alone.rows.clone().zip(direction);
                let part: f64 = rows().map(|(row, v)| v * column[row]).sum();
                whole[(i, k + c)] = part;
                for (row, v) in rows() {
                    column[row] -= part * v;
                }
            }
        }
        whole
            .view_mut((k, k), (n - k, n - k))
            .copy_from(&others.qr().unpack_r());
        let mut places = vec![0; n];
        for (place, i) in order.into_iter().enumerate() {
            places[i] = place;
        }
        Some(Self {
            unknowns,
            lengths,
            places,
            triangle: whole,
        })
    }

    /// For some of the unknowns.
    pub fn of(&self, unknowns: &[usize]) -> Self {
        let is_left = |i: &usize| unknowns.contains(&self.unknowns[*i]);
        let left: Vec<usize> = (0..self.unknowns.len()).filter(is_left).collect();
        if left.len() == self.unknowns.len() {
            return self.clone();
        }
        let mut columns: Vec<usize> = left.iter().map(|i| self.places[*i]).collect();
        columns.sort_unstable();
        let place = |i: &usize| columns.binary_search(&self.places[*i]).unwrap_or(0);
        Self {
            unknowns: left.iter().map(|i| self.unknowns[*i]).collect(),
            lengths: left.iter().map(|i| self.lengths[*i]).collect(),
            places: left.iter().map(place).collect(),
            triangle: self.triangle.select_columns(&columns).qr().unpack_r(),
        }
    }

    /// By how much the unknowns change, in the order of the factor, if equations change by each of these columns. `None` if
    /// that is not finite.
    pub fn absorbed<'c>(
        &self,
        jacobian: &DMatrix<f64>,
        columns: impl Iterator<Item = DVectorView<'c, f64>>,
    ) -> Option<DMatrix<f64>> {
        let columns: Vec<DVectorView<'c, f64>> = columns.collect();
        let mut by = DMatrix::zeros(self.unknowns().len(), columns.len());
        for (mut by, column) in by.column_iter_mut().zip(&columns) {
            let step = self.step(&jacobian.tr_mul(column))?;
            for (by, i) in by.iter_mut().zip(self.unknowns()) {
                *by = step[*i];
            }
        }
        Some(by)
    }

    /// The unknowns it contains.
    pub fn unknowns(&self) -> &[usize] {
        &self.unknowns
    }

    /// Original lengths of their columns.
    pub fn lengths(&self) -> &[f64] {
        &self.lengths
    }

    /// The combinations whose singular value is not above `least`: orthonormal columns, with one row for each
    /// unknown of the factor.
    pub fn hidden(&self, least: f64) -> DMatrix<f64> {
        let n = self.unknowns.len();
        if n == 0 || self.least_above(least) {
            return DMatrix::zeros(n, 0);
        }
        let svd = self.triangle.clone().svd(false, true);
        let values = &svd.singular_values;
        let vectors = svd.v_t.map(|v| v.transpose()).unwrap_or_default();
        let low: Vec<usize> = (0..values.len()).filter(|i| values[*i] <= least).collect();
        vectors.select_columns(&low).select_rows(&self.places)
    }

    /// True if all singular values are certainly above `least`. The smallest is at least the inverse of the
    /// Frobenius norm of R⁻¹, which takes a fraction of the time of computing it.
    fn least_above(&self, least: f64) -> bool {
        let inverse = self.inverse();
        inverse.is_some_and(|inverse| inverse.norm() * least < 1.0)
    }

    /// R⁻¹, if R is regular.
    fn inverse(&self) -> Option<DMatrix<f64>> {
        let n = self.triangle.ncols();
        let mut inverse = DMatrix::identity(n, n);
        for j in 0..n {
            // Below the diagonal everything is zero.
            let triangle = self.triangle.view((0, 0), (j + 1, j + 1));
            let mut column = inverse.view_mut((0, j), (j + 1, 1));
            if !triangle.solve_upper_triangular_mut(&mut column) {
                return None;
            }
        }
        Some(inverse)
    }

    /// Ratio of the largest to the smallest singular value.
    pub fn condition(&self) -> f64 {
        if self.unknowns.is_empty() {
            return 1.0;
        }
        let values = self.triangle.singular_values();
        values.max() / values.min()
    }

    /// The unit of each unknown: that of a column of length 1.
    pub fn units(&self) -> Vec<f64> {
        self.lengths.iter().map(|length| length.recip()).collect()
    }

    /// Values of the unknowns divided by the lengths of their columns, in the order of the triangle's columns.
    fn scaled(&self, values: &DVector<f64>) -> DVector<f64> {
        let mut scaled = DVector::zeros(self.places.len());
        for ((unknown, length), place) in self.unknowns.iter().zip(&self.lengths).zip(&self.places)
        {
            scaled[*place] = values[*unknown] / length;
        }
        scaled
    }

    /// The step that makes the gradient Jᵀ·r zero if the Jacobian is constant: for all unknowns, 0 for those that
    /// are not among its columns. `None` if it is not finite.
    pub fn step(&self, gradient: &DVector<f64>) -> Option<DVector<f64>> {
        let forward = self
            .triangle
            .tr_solve_upper_triangular(&-self.scaled(gradient))?;
        let back = self.triangle.solve_upper_triangular(&forward)?;
        let mut step = DVector::zeros(gradient.len());
        for ((unknown, length), place) in self.unknowns.iter().zip(&self.lengths).zip(&self.places)
        {
            step[*unknown] = back[*place] / length;
        }
        step.iter().all(|v| v.is_finite()).then_some(step)
    }

    /// The influence of an equation's own observation on it: 0 if the others determine it, 1 if nothing else does.
    /// `row` has the derivatives by all unknowns.
    pub(crate) fn leverage(&self, row: &DVector<f64>) -> Option<f64> {
        let y = self.triangle.tr_solve_upper_triangular(&self.scaled(row))?;
        Some(y.norm_squared())
    }

    /// [`Self::leverage`] of every equation of a Jacobian.
    pub fn leverages(&self, jacobian: &DMatrix<f64>) -> Option<Vec<f64>> {
        let inverse = self.inverse()?;
        let mut columns = vec![0; self.places.len()];
        for (i, place) in self.places.iter().enumerate() {
            columns[*place] = i;
        }
        let unknowns: Vec<usize> = columns.iter().map(|i| self.unknowns[*i]).collect();
        let mut ordered = jacobian.select_columns(&unknowns);
        for (mut column, i) in ordered.column_iter_mut().zip(&columns) {
            column /= self.lengths[*i];
        }
        let influence = ordered * inverse;
        Some(influence.row_iter().map(|row| row.norm_squared()).collect())
    }

    /// The variance of each of its unknowns for equations with a standard deviation of 1.
    pub fn variances(&self) -> Option<Vec<f64>> {
        let inverse = self.inverse()?;
        let variance = |(place, length): (&usize, &f64)| {
            inverse.row(*place).norm_squared() / (length * length)
        };
        Some(
            (self.places.iter())
                .zip(&self.lengths)
                .map(variance)
                .collect(),
        )
    }

    /// The covariance of its first `count` unknowns for equations with a standard deviation of 1.
    pub fn covariance(&self, count: usize) -> Option<DMatrix<f64>> {
        // (RᵀR)⁻¹ is R⁻¹·R⁻ᵀ.
        let rows = self.inverse()?.select_rows(&self.places[..count]);
        let mut covariance = &rows * rows.transpose();
        for i in 0..count {
            for j in 0..count {
                covariance[(i, j)] /= self.lengths[i] * self.lengths[j];
            }
        }
        Some(covariance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn jacobian() -> DMatrix<f64> {
        DMatrix::from_fn(30, 4, |i, j| {
            let x = i as f64 / 29.0 - 0.4;
            [1.0, 100.0 * x, x * x, libm::sin(7.0 * x)][j]
        })
    }

    #[test]
    fn step_and_covariance_are_those_of_the_normal_equations() {
        let j = jacobian();
        let factor = ScaledFactor::new(&j, vec![0, 1, 2, 3], &[]).unwrap();
        let inverse = j.tr_mul(&j).try_inverse().unwrap();
        let residuals = DVector::from_fn(30, |i, _| libm::cos(i as f64));
        let gradient = j.tr_mul(&residuals);
        let step = factor.step(&gradient).unwrap();
        // The normal equations square a condition number of 20.
        assert!((step + &inverse * &gradient).amax() < 1e-12);
        let found = factor.covariance(2).unwrap();
        assert!((found - inverse.view((0, 0), (2, 2))).amax() < 1e-13);
        let part = factor.of(&[1, 3]);
        let own = j.select_columns(&[1, 3]);
        let own = own.tr_mul(&own).try_inverse().unwrap();
        assert!((part.covariance(2).unwrap() - own).amax() < 1e-13);
        let step = part.step(&gradient).unwrap();
        assert_eq!([step[0], step[2]], [0.0, 0.0]);
        // The diagonal of J·(JᵀJ)⁻¹·Jᵀ.
        let hat = &j * inverse * j.transpose();
        let leverage = factor.leverage(&j.row(7).transpose()).unwrap();
        assert!((leverage - hat[(7, 7)]).abs() < 1e-12);
        let all = factor.leverages(&j).unwrap();
        assert!((DVector::from_vec(all) - hat.diagonal()).amax() < 1e-12);
        let variances = DVector::from_vec(factor.variances().unwrap());
        let covariance = factor.covariance(4).unwrap();
        assert!((variances - covariance.diagonal()).amax() < 1e-13);
    }

    #[test]
    fn a_sum_of_columns_and_a_column_of_zeros_are_hidden() {
        let mut j = jacobian().insert_columns(4, 2, 0.0);
        let sum = j.column(0) * 2.0 + j.column(2);
        j.set_column(4, &sum);
        let factor = ScaledFactor::new(&j, (0..6).collect(), &[]).unwrap();
        assert_eq!(factor.hidden(1e-12).ncols(), 2);
        assert!(factor.condition() > 1e12);
        let condition = factor.of(&[0, 1, 2, 3]).condition();
        assert!((1.0..30.0).contains(&condition), "{condition}");
        // Only members of the sum have a part, and the column of zeros.
        for (i, has) in [true, false, true, false, true, true]
            .into_iter()
            .enumerate()
        {
            assert_eq!(factor.hidden(1e-12).row(i).norm() > 1e-10, has, "{i}");
        }
    }

    #[test]
    fn columns_that_are_alone_in_their_rows_change_nothing() {
        // Two balls with one coordinate each: one has every third row of the first half.
        let rows = [(1..15).step_by(3), (15..30).step_by(3)];
        let mut j = jacobian().insert_columns(2, 2, 0.0);
        for (i, row) in rows.iter().enumerate() {
            for row in row.clone() {
                j[(row, 2 + i)] = 0.3 + row as f64;
            }
        }
        let alone: Vec<Alone> = (2..)
            .zip(rows)
            .map(|(unknown, rows)| Alone { unknown, rows })
            .collect();
        let all: Vec<usize> = (0..6).collect();
        let [one, other] =
            [&alone[..], &[]].map(|alone| ScaledFactor::new(&j, all.clone(), alone).unwrap());
        // Rounding with a condition number of 30.
        let near = |a: DMatrix<f64>, b: DMatrix<f64>| {
            assert!((&a - &b).amax() < 1e-13 * b.amax(), "{a} {b}")
        };
        let gradient = j.tr_mul(&DVector::from_fn(30, |i, _| libm::cos(i as f64)));
        let part = [0, 2, 3, 5];
        for [one, other] in [[&one, &other], [&one.of(&part), &other.of(&part)]] {
            assert_eq!(one.unknowns(), other.unknowns());
            assert_eq!(one.lengths(), other.lengths());
            let count = one.unknowns().len();
            near(
                one.covariance(count).unwrap(),
                other.covariance(count).unwrap(),
            );
            let step =
                |factor: &ScaledFactor| DMatrix::from_columns(&[factor.step(&gradient).unwrap()]);
            near(step(one), step(other));
            let row = j.row(18).transpose();
            assert!((one.leverage(&row).unwrap() - other.leverage(&row).unwrap()).abs() < 1e-13);
            let [one_by_one, all] = [one, other].map(|f| f.leverages(&j).unwrap()[18]);
            assert!((one.leverage(&row).unwrap() - all).abs() < 1e-13);
            assert!((one_by_one - all).abs() < 1e-13);
            assert!((one.condition() / other.condition() - 1.0).abs() < 1e-12);
        }
        // Hidden combination: a column that is the sum of the two others.
        let both = j.column(2) + j.column(3) * 2.0;
        let mut j = j.insert_column(6, 0.0);
        j.set_column(6, &both);
        let hidden = |alone: &[Alone]| {
            ScaledFactor::new(&j, (0..7).collect(), alone)
                .unwrap()
                .hidden(1e-12)
        };
        let [one, other] = [hidden(&alone), hidden(&[])];
        assert_eq!((one.shape(), other.shape()), ((7, 1), (7, 1)));
        near(&one * one[6].signum(), &other * other[6].signum());
    }

    #[test]
    fn what_is_no_finite_number_has_no_factor() {
        for wrong in [f64::NAN, f64::INFINITY, 1e200, 1e-200] {
            let mut j = jacobian();
            j.set_column(1, &DVector::from_element(30, wrong));
            assert!(ScaledFactor::new(&j, vec![0, 1], &[]).is_none(), "{wrong}");
            assert!(ScaledFactor::new(&j, vec![0, 2], &[]).is_some());
        }
    }
}

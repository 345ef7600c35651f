//! The triangle of a Jacobian: what it takes to make steps, and to say how well they are known.

use super::triangle::triangle;
use nalgebra::{DMatrix, DVector};

/// A Jacobian whose columns have been given the length 1, as the triangle R of its QR factorisation.
#[derive(Clone, Debug)]
pub(super) struct Factor {
    /// Which unknowns its columns are.
    columns: Vec<usize>,
    /// How long they were; 1 for a column of zeros.
    lengths: Vec<f64>,
    triangle: DMatrix<f64>,
}

impl Factor {
    /// Of some of the unknowns: equations × unknowns, no fewer equations than unknowns. None if a column is no
    /// finite number, or so long or short that its square is none: the search for singular values would not
    /// come to an end.
    pub fn new(jacobian: &DMatrix<f64>, unknowns: Vec<usize>) -> Option<Self> {
        let mut columns = jacobian.select_columns(&unknowns);
        let mut lengths = Vec::with_capacity(unknowns.len());
        for mut column in columns.column_iter_mut() {
            let length = match column.norm_squared() {
                0.0 if column.iter().all(|v| *v == 0.0) => 1.0,
                square if square.is_normal() => square.sqrt(),
                _ => return None,
            };
            column /= length;
            lengths.push(length);
        }
        Some(Self {
            columns: unknowns,
            triangle: triangle(columns),
            lengths,
        })
    }

    /// Of some of the unknowns.
    pub fn of(&self, unknowns: &[usize]) -> Self {
        let place = |unknown: &usize| self.columns.iter().position(|c| c == unknown);
        let places: Vec<usize> = unknowns.iter().filter_map(place).collect();
        if places.len() == self.columns.len() && places.is_sorted() {
            return self.clone();
        }
        Self {
            columns: places.iter().map(|p| self.columns[*p]).collect(),
            lengths: places.iter().map(|p| self.lengths[*p]).collect(),
            triangle: triangle(self.triangle.select_columns(&places)),
        }
    }

    /// Which unknowns it has.
    pub fn unknowns(&self) -> &[usize] {
        &self.columns
    }

    /// How long their columns were.
    pub fn lengths(&self) -> &[f64] {
        &self.lengths
    }

    /// The combinations whose singular value is not above `least`: orthonormal columns, one row for each of the
    /// factor's unknowns.
    pub fn hidden(&self, least: f64) -> DMatrix<f64> {
        let n = self.columns.len();
        if n == 0 || self.least_above(least) {
            return DMatrix::zeros(n, 0);
        }
        let svd = self.triangle.clone().svd(false, true);
        let values = &svd.singular_values;
        let vectors = svd.v_t.map(|v| v.transpose()).unwrap_or_default();
        let low: Vec<usize> = (0..values.len()).filter(|i| values[*i] <= least).collect();
        vectors.select_columns(&low)
    }

    /// True if all singular values are certainly above `least`: the smallest is no less than the inverse of the
    /// Frobenius norm of R⁻¹, which takes a fraction of the time of finding it.
    fn least_above(&self, least: f64) -> bool {
        let n = self.columns.len();
        let inverse = (self.triangle).solve_upper_triangular(&DMatrix::identity(n, n));
        inverse.is_some_and(|inverse| inverse.norm() * least < 1.0)
    }

    /// The largest singular value by the smallest.
    pub fn condition(&self) -> f64 {
        if self.columns.is_empty() {
            return 1.0;
        }
        let values = self.triangle.singular_values();
        values.max() / values.min()
    }

    /// What the unit of each unknown is here: a column of length 1.
    pub fn units(&self) -> Vec<f64> {
        self.lengths.iter().map(|length| length.recip()).collect()
    }

    /// The step that makes the gradient Jᵀ·r zero if the Jacobian stays as it is: of all unknowns, 0 for those
    /// that are not among its columns. None if that is no finite number.
    pub fn step(&self, gradient: &DVector<f64>) -> Option<DVector<f64>> {
        let scaled = self.columns.iter().zip(&self.lengths);
        let scaled: Vec<f64> = scaled.map(|(c, length)| -gradient[*c] / length).collect();
        let forward = self
            .triangle
            .tr_solve_upper_triangular(&DVector::from_vec(scaled))?;
        let back = self.triangle.solve_upper_triangular(&forward)?;
        let mut step = DVector::zeros(gradient.len());
        for ((c, length), value) in self.columns.iter().zip(&self.lengths).zip(back.iter()) {
            step[*c] = value / length;
        }
        step.iter().all(|v| v.is_finite()).then_some(step)
    }

    /// What part of an equation its own observation makes: 0 if the others tell it, 1 if nothing else does.
    /// `row` has the derivatives by all unknowns.
    pub fn leverage(&self, row: &DVector<f64>) -> Option<f64> {
        let scaled = self.columns.iter().zip(&self.lengths);
        let scaled: Vec<f64> = scaled.map(|(c, length)| row[*c] / length).collect();
        let y = self
            .triangle
            .tr_solve_upper_triangular(&DVector::from_vec(scaled))?;
        Some(y.norm_squared())
    }

    /// The covariance of its first `count` unknowns, if equations have a standard deviation of 1.
    pub fn covariance(&self, count: usize) -> Option<DMatrix<f64>> {
        let n = self.columns.len();
        // Rᵀ·Y = the first unit vectors: (RᵀR)⁻¹ is Y'·Y.
        let units = DMatrix::from_fn(n, count, |i, j| f64::from(u8::from(i == j)));
        let y = self.triangle.tr_solve_upper_triangular(&units)?;
        let mut covariance = y.tr_mul(&y);
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
            [1.0, 100.0 * x, x * x, (7.0 * x).sin()][j]
        })
    }

    #[test]
    fn step_and_covariance_are_those_of_the_normal_equations() {
        let j = jacobian();
        let factor = Factor::new(&j, vec![0, 1, 2, 3]).unwrap();
        let inverse = j.tr_mul(&j).try_inverse().unwrap();
        let residuals = DVector::from_fn(30, |i, _| (i as f64).cos());
        let gradient = j.tr_mul(&residuals);
        let step = factor.step(&gradient).unwrap();
        // The normal equations square a condition of 20.
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
    }

    #[test]
    fn a_sum_of_columns_and_a_column_of_zeros_are_hidden() {
        let mut j = jacobian().insert_columns(4, 2, 0.0);
        let sum = j.column(0) * 2.0 + j.column(2);
        j.set_column(4, &sum);
        let factor = Factor::new(&j, (0..6).collect()).unwrap();
        assert_eq!(factor.hidden(1e-12).ncols(), 2);
        assert!(factor.condition() > 1e12);
        let condition = factor.of(&[0, 1, 2, 3]).condition();
        assert!((1.0..30.0).contains(&condition), "{condition}");
        // Only what is in the sum has a part, and the column of zeros.
        for (i, has) in [true, false, true, false, true, true]
            .into_iter()
            .enumerate()
        {
            assert_eq!(factor.hidden(1e-12).row(i).norm() > 1e-10, has, "{i}");
        }
    }

    #[test]
    fn what_is_no_finite_number_has_no_factor() {
        for wrong in [f64::NAN, f64::INFINITY, 1e200, 1e-200] {
            let mut j = jacobian();
            j.set_column(1, &DVector::from_element(30, wrong));
            assert!(Factor::new(&j, vec![0, 1]).is_none(), "{wrong}");
            assert!(Factor::new(&j, vec![0, 2]).is_some());
        }
    }
}

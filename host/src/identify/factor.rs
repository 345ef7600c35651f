//! The triangle of a Jacobian: what it takes to make steps, and to say how well they are known.

use nalgebra::{DMatrix, DVector};

/// A Jacobian whose columns have been given the length 1, as the triangle R of its QR factorisation.
#[derive(Debug)]
pub(super) struct Factor {
    /// Which unknowns its columns are.
    columns: Vec<usize>,
    /// How long they were; 1 for a column of zeros.
    lengths: Vec<f64>,
    triangle: DMatrix<f64>,
}

/// Singular values, and the combinations that belong to the smallest of them.
pub(super) struct Spectrum {
    /// The largest singular value by the smallest.
    pub condition: f64,
    /// Orthonormal columns, one row for each of the factor's unknowns.
    pub hidden: DMatrix<f64>,
}

impl Factor {
    /// Of all unknowns: equations × unknowns, no fewer equations than unknowns.
    pub fn new(mut jacobian: DMatrix<f64>) -> Self {
        let lengths: Vec<f64> = (jacobian.column_iter())
            .map(|column| Some(column.norm()).filter(|l| *l > 0.0).unwrap_or(1.0))
            .collect();
        for (mut column, length) in jacobian.column_iter_mut().zip(&lengths) {
            column /= *length;
        }
        Self {
            columns: (0..lengths.len()).collect(),
            triangle: jacobian.qr().unpack_r(),
            lengths,
        }
    }

    /// Of some of the unknowns.
    pub fn of(&self, unknowns: &[usize]) -> Self {
        let place = |unknown: &usize| self.columns.iter().position(|c| c == unknown);
        let places: Vec<usize> = unknowns.iter().filter_map(place).collect();
        Self {
            columns: places.iter().map(|p| self.columns[*p]).collect(),
            lengths: places.iter().map(|p| self.lengths[*p]).collect(),
            triangle: self.triangle.select_columns(&places).qr().unpack_r(),
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

    /// The combinations whose singular value is not above `least`.
    pub fn spectrum(&self, least: f64) -> Spectrum {
        if self.columns.is_empty() {
            return Spectrum {
                condition: 1.0,
                hidden: DMatrix::zeros(0, 0),
            };
        }
        let svd = self.triangle.clone().svd(false, true);
        let values = &svd.singular_values;
        let vectors = svd.v_t.map(|v| v.transpose()).unwrap_or_default();
        let low: Vec<usize> = (0..values.len()).filter(|i| values[*i] <= least).collect();
        Spectrum {
            condition: values.max() / values.min(),
            hidden: vectors.select_columns(&low),
        }
    }

    /// What the unit of each unknown is here: a column of length 1.
    pub fn units(&self) -> Vec<f64> {
        self.lengths.iter().map(|length| length.recip()).collect()
    }

    /// The step that makes the gradient Jᵀ·r zero if the Jacobian stays as it is: of all unknowns, 0 for those
    /// that are not among its columns.
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
        Some(step)
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
        let factor = Factor::new(j.clone());
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
    }

    #[test]
    fn a_sum_of_columns_and_a_column_of_zeros_are_hidden() {
        let mut j = jacobian().insert_columns(4, 2, 0.0);
        let sum = j.column(0) * 2.0 + j.column(2);
        j.set_column(4, &sum);
        let factor = Factor::new(j);
        let spectrum = factor.spectrum(1e-12);
        assert_eq!(spectrum.hidden.ncols(), 2);
        assert!(spectrum.condition > 1e12);
        let condition = factor.of(&[0, 1, 2, 3]).spectrum(1e-12).condition;
        assert!((1.0..30.0).contains(&condition), "{condition}");
        // Only what is in the sum has a part, and the column of zeros.
        for (i, has) in [true, false, true, false, true, true]
            .into_iter()
            .enumerate()
        {
            assert_eq!(spectrum.hidden.row(i).norm() > 1e-10, has, "{i}");
        }
    }
}

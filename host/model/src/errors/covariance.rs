//! Joint uncertainties of parameters.

mod file;

use super::Parameter;
pub use file::{read, write};
use nalgebra::{DMatrix, SymmetricEigen};

/// The covariance of some parameters, in the product of the units of each pair.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Covariance {
    /// The parameters.
    pub parameters: Vec<Parameter>,
    /// Symmetric; one row and column for each parameter.
    pub matrix: DMatrix<f64>,
}

impl Covariance {
    /// With additional parameters that have known standard uncertainties but no known correlations.
    #[must_use]
    pub(crate) fn with_uncorrelated(
        mut self,
        others: impl Iterator<Item = (Parameter, f64)>,
    ) -> Self {
        let known = self.parameters.len();
        let (more, uncertainties): (Vec<Parameter>, Vec<f64>) = others.unzip();
        self.parameters.extend(more);
        self.matrix = self
            .matrix
            .resize(self.parameters.len(), self.parameters.len(), 0.0);
        for (i, u) in uncertainties.into_iter().enumerate() {
            self.matrix[(known + i, known + i)] = u * u;
        }
        self
    }

    /// The covariance without these parameters.
    #[must_use]
    pub fn without(&self, parameters: &[Parameter]) -> Self {
        let is_other = |i: &usize| !parameters.contains(&self.parameters[*i]);
        let others: Vec<usize> = (0..self.parameters.len()).filter(is_other).collect();
        Self {
            parameters: others.iter().map(|i| self.parameters[*i]).collect(),
            matrix: self.matrix.select_rows(&others).select_columns(&others),
        }
    }

    /// Prepends parameters that were found with these: `own` is their covariance if these were exact, `pull` the
    /// derivative by each of these (one row for each parameter found).
    #[must_use]
    pub fn joined(&self, found: &[Parameter], own: &DMatrix<f64>, pull: &DMatrix<f64>) -> Self {
        let (n, k) = (found.len(), self.parameters.len());
        let across = pull * &self.matrix;
        let mut matrix = DMatrix::zeros(n + k, n + k);
        matrix
            .view_mut((0, 0), (n, n))
            .copy_from(&(own + &across * pull.transpose()));
        matrix.view_mut((0, n), (n, k)).copy_from(&across);
        matrix
            .view_mut((n, 0), (k, n))
            .copy_from(&across.transpose());
        matrix.view_mut((n, n), (k, k)).copy_from(&self.matrix);
        Self {
            parameters: [found, &self.parameters].concat(),
            matrix,
        }
    }

    /// The standard uncertainty of each parameter.
    #[must_use]
    pub(crate) fn standard_uncertainties(&self) -> Vec<f64> {
        self.matrix.diagonal().iter().map(|v| v.sqrt()).collect()
    }

    /// A matrix R with R·Rᵀ equal to this: R times standard normal numbers has this covariance.
    #[must_use]
    pub fn root(&self) -> DMatrix<f64> {
        let (correlation, units) = self.correlation();
        if units.is_empty() {
            return DMatrix::zeros(0, 0);
        }
        let eigen = SymmetricEigen::new(correlation);
        let mut root = eigen.eigenvectors;
        for (mut column, value) in root.column_iter_mut().zip(eigen.eigenvalues.iter()) {
            column *= value.max(0.0).sqrt();
        }
        for (mut row, unit) in root.row_iter_mut().zip(units) {
            row *= unit;
        }
        root
    }

    /// Correlations and standard uncertainties. An exact parameter has no correlations.
    #[must_use]
    pub fn correlation(&self) -> (DMatrix<f64>, Vec<f64>) {
        let units = self.standard_uncertainties();
        let n = units.len();
        let correlation = DMatrix::from_fn(n, n, |i, j| match (i == j, units[i] * units[j]) {
            (true, _) => 1.0,
            (false, 0.0) => 0.0,
            (false, both) => self.matrix[(i, j)] / both,
        });
        (correlation, units)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameter(name: &str) -> Parameter {
        Parameter::parse(name).unwrap()
    }

    #[test]
    fn a_root_has_the_covariance() {
        let covariance = Covariance {
            parameters: ["EXX1", "EB0A", "EC0A"].map(parameter).to_vec(),
            matrix: DMatrix::from_row_slice(
                3,
                3,
                &[4e-12, 1e-12, 0.0, 1e-12, 1e-12, 0.0, 0.0, 0.0, 0.0],
            ),
        };
        let root = covariance.root();
        // Relative to 4e-12: rounding.
        assert!((&root * root.transpose() - &covariance.matrix).amax() < 1e-26);
        assert_eq!(Covariance::default().root().len(), 0);
    }

    #[test]
    fn what_was_known_before_pulls_what_is_found_with_it() {
        // x = y − 2·k is found with y of variance 1 and k, known before, of variance 9.
        let before = Covariance {
            parameters: vec![parameter("EXX1")],
            matrix: DMatrix::from_element(1, 1, 9.0),
        };
        let own = DMatrix::from_element(1, 1, 1.0);
        let pull = DMatrix::from_element(1, 1, -2.0);
        let both = before.joined(&[parameter("EYY1")], &own, &pull);
        assert_eq!(both.parameters, ["EYY1", "EXX1"].map(parameter));
        assert_eq!(both.matrix.as_slice(), [37.0, -18.0, -18.0, 9.0]);
        assert_eq!(both.without(&[parameter("EYY1")]), before);
    }
}

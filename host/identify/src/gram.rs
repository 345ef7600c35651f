//! Linear least squares with parts of the equations left out, by the normal equations of each part.
//!
//! The normal equations square the condition, which is enough to compare models: solutions that count come from
//! [`ScaledFactor`](crate::factor::ScaledFactor).

use nalgebra::{Cholesky, DMatrix, DVector};

/// Which part each equation belongs to; those of none are never left out.
pub(crate) struct Split {
    /// Equations of each part, then of none.
    equations: Vec<Vec<usize>>,
}

impl Split {
    /// `parts` has one number for each equation, any numbers.
    pub fn new(parts: &[Option<usize>]) -> Self {
        let mut numbers: Vec<usize> = parts.iter().flatten().copied().collect();
        numbers.sort_unstable();
        numbers.dedup();
        let of = |number: Option<usize>| {
            let own = parts.iter().enumerate().filter(|(_, p)| **p == number);
            own.map(|(i, _)| i).collect()
        };
        let named = numbers.iter().map(|n| of(Some(*n)));
        Self {
            equations: named.chain([of(None)]).collect(),
        }
    }

    /// Number of parts.
    pub fn parts(&self) -> usize {
        self.equations.len() - 1
    }
}

/// What a left-out part leaves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LeftOutPart {
    pub equations: usize,
    /// Mean square.
    pub mean: f64,
}

/// The normal equations of each part, with columns of length 1.
pub(crate) struct Gram {
    lengths: DVector<f64>,
    /// Of each part, then of the equations of none: Xᵀ·X, Xᵀ·r, rᵀ·r.
    parts: Vec<(DMatrix<f64>, DVector<f64>, f64)>,
    equations: Vec<usize>,
}

/// A prior of this many times the data of an unknown, for what the data do not determine.
const RIDGE: f64 = 1e-9;
/// An unknown whose column has less than this part of its length in the other parts is of the left-out part alone.
const OWN: f64 = 1e-12;

impl Gram {
    /// For equations X·x + r ≈ 0.
    pub fn new(matrix: &DMatrix<f64>, residuals: &DVector<f64>, split: &Split) -> Self {
        let (scaled, lengths) = scaled(matrix.clone());
        let part = |equations: &Vec<usize>| {
            let own = scaled.select_rows(equations);
            let left = residuals.select_rows(equations);
            (own.tr_mul(&own), own.tr_mul(&left), left.norm_squared())
        };
        Self {
            lengths,
            parts: split.equations.iter().map(part).collect(),
            equations: split.equations.iter().map(Vec::len).collect(),
        }
    }

    /// The sum over all parts but one.
    fn sum(&self, without: Option<usize>) -> (DMatrix<f64>, DVector<f64>) {
        let n = self.lengths.len();
        let mut sum = (DMatrix::zeros(n, n), DVector::zeros(n));
        for (number, (square, side, _)) in self.parts.iter().enumerate() {
            if Some(number) != without {
                sum.0 += square;
                sum.1 += side;
            }
        }
        sum
    }

    /// What each part leaves if the others predict it. Unknowns that occur in no other part, such as a set-up, fit it.
    pub fn by_part(&self) -> Vec<LeftOutPart> {
        let part = |number: usize| {
            let (square, side) = self.sum(Some(number));
            let own: Vec<usize> = (0..side.len()).filter(|i| square[(*i, *i)] < OWN).collect();
            let mut x = solved(square, &side);
            let (square, side, rest) = &self.parts[number];
            own.iter().for_each(|i| x[*i] = 0.0);
            let gradient = square * &x + side;
            let small = square.select_rows(&own).select_columns(&own);
            let fit = solved(small, &gradient.select_rows(&own));
            for (i, value) in own.iter().zip(fit.iter()) {
                x[*i] = *value;
            }
            let left = rest + 2.0 * x.dot(side) + x.dot(&(square * &x));
            LeftOutPart {
                equations: self.equations[number],
                mean: left.max(0.0) / self.equations[number] as f64,
            }
        };
        (0..self.parts.len() - 1).map(part).collect()
    }

    /// For some of the unknowns.
    pub fn of(&self, unknowns: &[usize]) -> Self {
        let part = |(square, side, rest): &(DMatrix<f64>, DVector<f64>, f64)| {
            let square = square.select_columns(unknowns).select_rows(unknowns);
            (square, side.select_rows(unknowns), *rest)
        };
        Self {
            lengths: self.lengths.select_rows(unknowns),
            parts: self.parts.iter().map(part).collect(),
            equations: self.equations.clone(),
        }
    }

    /// For each part: the square that it leaves if the others predict it, in units of what would be left if equations had
    /// a variance of 1 and the unknowns were all that there is.
    pub fn by_part_of_expected(&self) -> Vec<f64> {
        let part = |(number, left): (usize, LeftOutPart)| {
            let (square, _) = self.sum(Some(number));
            let n = square.nrows();
            let others: Vec<usize> = (0..n).filter(|i| square[(*i, *i)] >= OWN).collect();
            let known = square.select_columns(&others).select_rows(&others);
            let count = others.len();
            let factor = Cholesky::new(known + DMatrix::identity(count, count) * RIDGE);
            let own = &self.parts[number].0;
            let own = own.select_columns(&others).select_rows(&others);
            let from_others = factor.map_or(f64::INFINITY, |factor| factor.solve(&own).trace());
            let free = left.equations.saturating_sub(n - count);
            left.mean * left.equations as f64 / (free as f64 + from_others)
        };
        self.by_part().into_iter().enumerate().map(part).collect()
    }

    /// Root mean square of all parts, each predicted from the others.
    pub fn left_out(&self) -> f64 {
        let all = self.by_part();
        let sum: f64 = all.iter().map(|l| l.mean * l.equations as f64).sum();
        let count: usize = all.iter().map(|l| l.equations).sum();
        (sum / count as f64).sqrt()
    }

    /// For each of the groups of further unknowns: how much the sum of squares of all equations shrinks if they are added
    /// to `unknowns`, per unknown.
    pub fn gains(&self, unknowns: &[usize], groups: &[Vec<usize>]) -> Vec<f64> {
        let (square, side) = self.sum(None);
        let n = unknowns.len();
        let own = square.select_columns(unknowns).select_rows(unknowns);
        let Some(factor) = Cholesky::new(own + DMatrix::identity(n, n) * RIDGE) else {
            return vec![0.0; groups.len()];
        };
        let rest = factor.solve(&side.select_rows(unknowns));
        let gain = |group: &Vec<usize>| {
            let cross = square.select_columns(group).select_rows(unknowns);
            let left = square.select_columns(group).select_rows(group)
                - cross.tr_mul(&factor.solve(&cross));
            let gradient = side.select_rows(group) - cross.tr_mul(&rest);
            -solved(left, &gradient).dot(&gradient) / group.len() as f64
        };
        groups.iter().map(gain).collect()
    }

    /// The solution of all equations.
    pub fn solution(&self) -> DVector<f64> {
        let (square, side) = self.sum(None);
        solved(square, &side).component_div(&self.lengths)
    }

    /// The variance of an equation, from what all equations leave.
    pub fn variance(&self) -> f64 {
        let (square, side) = self.sum(None);
        let x = solved(square, &side);
        let rest: f64 = self.parts.iter().map(|(.., rest)| rest).sum();
        let left = (rest + x.dot(&side)).max(0.0);
        let count: usize = self.equations.iter().sum();
        left / count.saturating_sub(x.len()).max(1) as f64
    }

    /// The covariance of the unknowns, from all equations and what they leave.
    pub fn covariance(&self) -> DMatrix<f64> {
        let (square, _) = self.sum(None);
        let n = square.nrows();
        let variance = self.variance();
        let inverse = Cholesky::new(square + DMatrix::identity(n, n) * RIDGE);
        let inverse = inverse.map_or(DMatrix::zeros(n, n), |c| c.inverse());
        let scale = |i: usize, j: usize| variance / (self.lengths[i] * self.lengths[j]);
        DMatrix::from_fn(n, n, |i, j| scale(i, j) * inverse[(i, j)])
    }

    /// Standard uncertainties of the unknowns, from all equations and what they leave.
    pub fn deviations(&self) -> DVector<f64> {
        self.covariance().diagonal().map(f64::sqrt)
    }

    /// Values of the unknowns in units of their standard uncertainty.
    pub fn significance(&self) -> Vec<f64> {
        let pairs = self.solution();
        let deviations = self.deviations();
        let ratio = pairs.iter().zip(deviations.iter());
        ratio
            .map(|(x, u)| x.abs() / u.max(f64::MIN_POSITIVE))
            .collect()
    }
}

/// A matrix with columns of length 1, and their lengths; 1 for a column of zeros.
pub(crate) fn scaled(mut matrix: DMatrix<f64>) -> (DMatrix<f64>, DVector<f64>) {
    let lengths = matrix.column_iter().map(|column| match column.norm() {
        0.0 => 1.0,
        norm => norm,
    });
    let lengths = DVector::from_iterator(matrix.ncols(), lengths);
    for (mut column, length) in matrix.column_iter_mut().zip(lengths.iter()) {
        column /= *length;
    }
    (matrix, lengths)
}

/// The x with square·x + side = 0.
fn solved(square: DMatrix<f64>, side: &DVector<f64>) -> DVector<f64> {
    let n = square.nrows();
    let factor = Cholesky::new(square + DMatrix::identity(n, n) * RIDGE);
    factor.map_or(DVector::zeros(n), |factor| factor.solve(&-side))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_left_out_is_predicted_as_by_a_fit_of_the_others() {
        let matrix = DMatrix::from_fn(40, 4, |i, j| {
            let t = i as f64 / 40.0;
            // The last unknown is an offset of the last part alone.
            [1.0, t, libm::sin(9.0 * t), f64::from(u8::from(i >= 30))][j]
        });
        let residuals = DVector::from_fn(40, |i, _| libm::cos(i as f64 * 0.7) + i as f64 * 0.02);
        let parts: Vec<Option<usize>> = (0..40).map(|i| Some(i / 10)).collect();
        let found = Gram::new(&matrix, &residuals, &Split::new(&parts)).by_part();
        for (part, found) in found.iter().enumerate() {
            let own: Vec<usize> = (10 * part..10 * part + 10).collect();
            let others: Vec<usize> = (0..40).filter(|i| !own.contains(i)).collect();
            let columns: &[usize] = if part == 3 { &[0, 1, 2] } else { &[0, 1, 2, 3] };
            let x = matrix.select_rows(&others).select_columns(columns);
            let x = x
                .svd(true, true)
                .solve(&-residuals.select_rows(&others), 1e-12);
            let mut left = matrix.select_rows(&own).select_columns(columns) * x.unwrap();
            left += residuals.select_rows(&own);
            if part == 3 {
                // The offset takes the mean.
                left.add_scalar_mut(-left.mean());
            }
            // The prior is 1e-9 of the data, and the normal equations square a condition of 10.
            let expected = left.norm_squared() / 10.0;
            assert!((found.mean / expected - 1.0).abs() < 1e-6, "{part}");
        }
    }

    #[test]
    fn a_part_is_compared_with_what_chance_would_leave_of_it() {
        let matrix = DMatrix::from_fn(40, 3, |i, j| (i as f64 / 40.0).powi(j as i32));
        let residuals = DVector::from_fn(40, |i, _| libm::cos(i as f64 * 0.7) + i as f64 * 0.02);
        let parts: Vec<Option<usize>> = (0..40).map(|i| Some(i / 10)).collect();
        let gram = Gram::new(&matrix, &residuals, &Split::new(&parts));
        for (part, found) in gram.by_part_of_expected().iter().enumerate() {
            let own: Vec<usize> = (10 * part..10 * part + 10).collect();
            let others: Vec<usize> = (0..40).filter(|i| !own.contains(i)).collect();
            let known = matrix.select_rows(&others);
            let inverse = known.tr_mul(&known).try_inverse().unwrap();
            let x = -&inverse * known.tr_mul(&residuals.select_rows(&others));
            let own_rows = matrix.select_rows(&own);
            let left = &own_rows * x + residuals.select_rows(&own);
            // The variance of a prediction: that of the equation and that of the unknowns.
            let expected = 10.0 + (&own_rows * inverse * own_rows.transpose()).trace();
            // As above.
            assert!(
                (found * expected / left.norm_squared() - 1.0).abs() < 1e-5,
                "{part}"
            );
        }
    }

    #[test]
    fn a_gain_is_what_a_fit_with_the_group_leaves_less() {
        let matrix = DMatrix::from_fn(30, 4, |i, j| (i as f64 / 30.0).powi(j as i32));
        let residuals = DVector::from_fn(30, |i, _| libm::cos(i as f64 * 0.3));
        let split = Split::new(&[None; 30]);
        let gram = Gram::new(&matrix, &residuals, &split);
        let left = |columns: &[usize]| {
            let own = matrix.select_columns(columns);
            let x = own
                .clone()
                .svd(true, true)
                .solve(&-&residuals, 1e-12)
                .unwrap();
            (own * x + &residuals).norm_squared()
        };
        let groups = [vec![1], vec![2, 3]];
        for (group, found) in groups.iter().zip(gram.gains(&[0], &groups)) {
            let with = [&[0], &group[..]].concat();
            let expected = (left(&[0]) - left(&with)) / group.len() as f64;
            // The prior is 1e-9 of the data; powers of up to 3 have a condition of 100.
            assert!((found / expected - 1.0).abs() < 1e-4, "{found} {expected}");
        }
    }

    #[test]
    fn significance_is_that_of_a_straight_line() {
        let matrix = DMatrix::from_fn(20, 2, |i, j| [1.0, i as f64][j]);
        let residuals = DVector::from_fn(20, |i, _| -0.5 * i as f64 + [0.1, -0.1][i % 2]);
        let parts: Vec<Option<usize>> = (0..20).map(|i| Some(i / 5)).collect();
        let gram = Gram::new(&matrix, &residuals, &Split::new(&parts));
        let inverse = matrix.tr_mul(&matrix).try_inverse().unwrap();
        let x = -&inverse * matrix.tr_mul(&residuals);
        let left = (&matrix * &x + &residuals).norm_squared() / 18.0;
        let expected = x[1].abs() / (left * inverse[(1, 1)]).sqrt();
        // The prior is 1e-9 of the data, whose squares are 3000 times those of what is left.
        assert!((gram.significance()[1] / expected - 1.0).abs() < 1e-5);
    }
}

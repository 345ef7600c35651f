//! The triangle of a QR factorisation, many columns at a time.
//!
//! Householder reflections as nalgebra makes them, but gathered: 32 of them are applied to the columns behind as
//! three products of matrices (Schreiber and Van Loan, 1989), which a processor does several times as fast as
//! reflections one by one.

use nalgebra::{DMatrix, DVector};

/// Columns that are reflected together.
const PANEL: usize = 32;

/// R of `columns` = Q·R; no fewer rows than columns.
pub(super) fn triangle(mut columns: DMatrix<f64>) -> DMatrix<f64> {
    let (m, n) = columns.shape();
    for start in (0..n).step_by(PANEL) {
        let width = PANEL.min(n - start);
        let end = start + width;
        let (reflections, weights) = reflected(&mut columns, start, width);
        if end == n {
            break;
        }
        // Qᵀ·C = C − V·Tᵀ·Vᵀ·C
        let mut behind = columns.view_mut((start, end), (m - start, n - end));
        let onto = weights.transpose() * (reflections.transpose() * &behind);
        behind.gemm(-1.0, &reflections, &onto, 1.0);
    }
    columns.rows(0, n).upper_triangle()
}

/// Makes a triangle of a panel, at its own rows and below: the unit vectors of its reflections, and T with
/// H₁·H₂⋯ = I − V·T·Vᵀ.
fn reflected(
    columns: &mut DMatrix<f64>,
    start: usize,
    width: usize,
) -> (DMatrix<f64>, DMatrix<f64>) {
    let rows = columns.nrows() - start;
    let mut reflections = DMatrix::zeros(rows, width);
    let mut weights = DMatrix::zeros(width, width);
    for j in 0..width {
        let mut axis: DVector<f64> = DVector::zeros(rows);
        axis.rows_mut(j, rows - j)
            .copy_from(&columns.view((start + j, start + j), (rows - j, 1)));
        let length = axis.norm();
        let onto = if axis[j] > 0.0 { -length } else { length };
        axis[j] -= onto;
        let norm = axis.norm();
        if norm > 0.0 {
            axis /= norm;
            for c in j..width {
                let mut column = columns.column_mut(start + c);
                let mut column = column.rows_mut(start, rows);
                let part = axis.dot(&column);
                column.axpy(-2.0 * part, &axis, 1.0);
            }
            // T of one more: its column is −2·T·Vᵀ·v, then 2.
            let across = reflections.columns(0, j).tr_mul(&axis);
            let above = weights.view((0, 0), (j, j)) * across * -2.0;
            weights.view_mut((0, j), (j, 1)).copy_from(&above);
            weights[(j, j)] = 2.0;
            reflections.set_column(j, &axis);
        }
    }
    (reflections, weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_triangle_is_that_of_nalgebra_up_to_signs() {
        for (m, n) in [(5, 1), (40, 31), (70, 64), (200, 101), (33, 33)] {
            let mut a = DMatrix::from_fn(m, n, |i, j| ((i * 7 + j * j * 3) as f64).sin());
            // One column like another, and one of zeros.
            if n > 60 {
                let same = a.column(3).into_owned();
                a.set_column(50, &same);
                a.fill_column(20, 0.0);
            }
            let found = triangle(a.clone());
            // RᵀR = AᵀA to rounding, and zeros below.
            let off = (found.tr_mul(&found) - a.tr_mul(&a)).amax();
            assert!(off < 1e-12 * m as f64, "{m} {n}: {off}");
            if n <= 60 {
                let off = (found.abs() - a.qr().unpack_r().abs()).amax();
                assert!(off < 1e-12 * m as f64, "{m} {n}: {off}");
            }
        }
    }
}

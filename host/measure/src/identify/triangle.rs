//! The triangle of a QR factorisation, many columns at a time.
//!
//! Householder reflections as nalgebra makes them, but gathered: those of 32 columns are applied to the columns
//! behind as three products of matrices (Schreiber and Van Loan, 1989), which a processor does several times as fast
//! as reflections one by one. The 32 are found in the same way, half by half (Elmroth and Gustavson, 2000).

use nalgebra::{DMatrix, DMatrixView, DMatrixViewMut};
use std::ops::Range;

/// Columns that are reflected together.
const PANEL: usize = 32;
/// Of these, so many are reflected one by one.
const ALONE: usize = 8;
/// Products of fewer rows or columns are made without copies.
const NARROW: usize = 6;

/// R of `columns` = Q·R; no fewer rows than columns.
pub(super) fn triangle(mut columns: DMatrix<f64>) -> DMatrix<f64> {
    let (m, n) = columns.shape();
    for start in (0..n).step_by(PANEL) {
        let (rows, width) = (m - start, PANEL.min(n - start));
        let end = start + width;
        let mut panel = Panel::new(rows, width);
        panel.reflect(
            &mut columns.view_mut((start, start), (rows, width)),
            0..width,
        );
        if end < n {
            panel.apply(0..width, columns.view_mut((start, end), (rows, n - end)));
        }
    }
    columns.rows(0, n).upper_triangle()
}

/// The reflections of some columns: H₁·H₂⋯ = I − V·T·Vᵀ.
struct Panel {
    /// V: unit vectors, each with nothing above its own row.
    reflections: DMatrix<f64>,
    /// T, an upper triangle.
    weights: DMatrix<f64>,
}

impl Panel {
    fn new(rows: usize, width: usize) -> Self {
        Self {
            reflections: DMatrix::zeros(rows, width),
            weights: DMatrix::zeros(width, width),
        }
    }

    /// Makes a triangle of some of its columns, the first of which have been reflected.
    fn reflect(&mut self, columns: &mut DMatrixViewMut<'_, f64>, range: Range<usize>) {
        if range.len() <= ALONE {
            for j in range.clone() {
                self.reflect_one(columns, j, &range);
            }
            return;
        }
        let middle = range.start + range.len() / 2;
        let (first, second) = (range.start..middle, middle..range.end);
        self.reflect(columns, first.clone());
        let rows = columns.nrows();
        let behind = columns.view_mut((0, middle), (rows, second.len()));
        self.apply(first.clone(), behind);
        self.reflect(columns, second.clone());
        // T of both: −T₁·V₁ᵀ·V₂·T₂ beside T₁ and T₂.
        let across = onto(&self.of(&first, middle), &self.of(&second, middle));
        let both = self.weight(&first) * across * self.weight(&second) * -1.0;
        self.weights
            .view_mut((first.start, middle), (first.len(), second.len()))
            .copy_from(&both);
    }

    /// Reflects column `j` of those in `range` onto its own row.
    fn reflect_one(
        &mut self,
        columns: &mut DMatrixViewMut<'_, f64>,
        j: usize,
        range: &Range<usize>,
    ) {
        let rows = columns.nrows() - j;
        let mut axis = self.reflections.column_mut(j);
        let mut axis = axis.rows_mut(j, rows);
        axis.copy_from(&columns.column(j).rows(j, rows));
        let length = axis.norm();
        let onto = if axis[0] > 0.0 { -length } else { length };
        axis[0] -= onto;
        let norm = axis.norm();
        if norm == 0.0 {
            return;
        }
        axis /= norm;
        for c in j..range.end {
            let mut column = columns.column_mut(c);
            let mut column = column.rows_mut(j, rows);
            let part = axis.dot(&column);
            column.axpy(-2.0 * part, &axis, 1.0);
        }
        // T of one more: its column is −2·T·Vᵀ·v, then 2.
        let before = range.start..j;
        let across = self.of(&before, j).tr_mul(&self.of(&(j..j + 1), j));
        let above = self.weight(&before) * across * -2.0;
        self.weights
            .view_mut((before.start, j), (before.len(), 1))
            .copy_from(&above);
        self.weights[(j, j)] = 2.0;
    }

    /// Qᵀ·C = C − V·Tᵀ·Vᵀ·C with some of the reflections.
    fn apply(&self, range: Range<usize>, mut behind: DMatrixViewMut<'_, f64>) {
        let (rows, columns) = behind.shape();
        let from = range.start;
        let mut behind = behind.view_mut((from, 0), (rows - from, columns));
        let reflections = self.of(&range, from);
        let parts = onto(&reflections, &behind.as_view());
        let parts = self.weight(&range).transpose() * parts;
        behind.gemm(-1.0, &reflections, &parts, 1.0);
    }

    /// Some of the reflections, from a row on.
    fn of(&self, range: &Range<usize>, row: usize) -> DMatrixView<'_, f64> {
        let rows = self.reflections.nrows() - row;
        self.reflections
            .view((row, range.start), (rows, range.len()))
    }

    fn weight(&self, range: &Range<usize>) -> DMatrixView<'_, f64> {
        let (start, width) = (range.start, range.len());
        self.weights.view((start, start), (width, width))
    }
}

/// Vᵀ·C.
fn onto(reflections: &DMatrixView<'_, f64>, columns: &DMatrixView<'_, f64>) -> DMatrix<f64> {
    match reflections.ncols().min(columns.ncols()) < NARROW {
        true => reflections.tr_mul(columns),
        false => reflections.transpose() * columns,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_triangle_is_that_of_nalgebra_up_to_signs() {
        for (m, n) in [
            (5, 1),
            (40, 31),
            (60, 13),
            (70, 64),
            (200, 101),
            (33, 33),
            (9, 9),
        ] {
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

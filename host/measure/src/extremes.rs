//! The smallest and the largest of some numbers.

/// From the smallest to the largest; from infinity to minus infinity if there are none.
pub(crate) fn extremes(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    let ends = [f64::INFINITY, f64::NEG_INFINITY];
    let values = values.into_iter();
    values.fold(ends, |[low, high], value| [low.min(value), high.max(value)])
}

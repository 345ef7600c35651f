//! Searches along one variable.

/// The place in an interval of positive numbers with the lowest score, by golden-section search over the logarithm, and the
/// score there. Each step leaves 0.62 of the interval.
pub(crate) fn narrowed(
    [low, high]: [f64; 2],
    steps: usize,
    mut score: impl FnMut(f64) -> f64,
) -> (f64, f64) {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let (mut low, mut high) = (libm::log(low), libm::log(high));
    let inner = |low: f64, high: f64| [high - GOLDEN * (high - low), low + GOLDEN * (high - low)];
    let mut at = |log: f64| (log, score(libm::exp(log)));
    let [mut left, mut right] = inner(low, high).map(&mut at);
    for _ in 0..steps {
        if left.1 < right.1 {
            (high, right) = (right.0, left);
            left = at(inner(low, high)[0]);
        } else {
            (low, left) = (left.0, right);
            right = at(inner(low, high)[1]);
        }
    }
    let (log, least) = if left.1 < right.1 { left } else { right };
    (libm::exp(log), least)
}

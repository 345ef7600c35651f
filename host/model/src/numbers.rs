//! The smallest and the largest of some numbers, and numbers of the normal distribution.

use rand::RngExt;
use rand_pcg::Pcg64Mcg;

/// From the smallest to the largest; from infinity to minus infinity if there are none.
pub fn extremes(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    let ends = [f64::INFINITY, f64::NEG_INFINITY];
    let values = values.into_iter();
    values.fold(ends, |[low, high], value| [low.min(value), high.max(value)])
}

/// A number of the standard normal distribution (Box and Muller).
pub fn normal(random: &mut Pcg64Mcg) -> f64 {
    let radius = (-2.0 * libm::log(1.0 - random.random::<f64>())).sqrt();
    radius * libm::cos(std::f64::consts::TAU * random.random::<f64>())
}

//! The smallest and the largest of some numbers, their order, and numbers of the normal distribution and of Student's.
//!
//! Sorting is compiled once, here, and not for every type and comparison.

use rand::RngExt;
use rand_pcg::Pcg64Mcg;

/// From the smallest to the largest; from infinity to minus infinity if there are none.
pub fn extremes(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    let ends = [f64::INFINITY, f64::NEG_INFINITY];
    let values = values.into_iter();
    values.fold(ends, |[low, high], value| [low.min(value), high.max(value)])
}

/// Sorts numbers, the smallest first.
pub fn ascending(values: &mut [f64]) {
    values.sort_by(f64::total_cmp);
}

/// The places of keys, that of the smallest first. Places of equal keys stay in their order.
#[must_use]
pub fn order(keys: &[f64]) -> Vec<usize> {
    let mut places: Vec<usize> = (0..keys.len()).collect();
    places.sort_by(|a, b| keys[*a].total_cmp(&keys[*b]));
    places
}

/// Items, that with the smallest key first. Items with equal keys stay in their order.
pub fn by<T>(items: Vec<T>, key: impl Fn(&T) -> f64) -> Vec<T> {
    let keys: Vec<f64> = items.iter().map(key).collect();
    let mut items: Vec<Option<T>> = items.into_iter().map(Some).collect();
    let places = order(&keys).into_iter();
    places.filter_map(|place| items[place].take()).collect()
}

/// A number of the standard normal distribution (Box and Muller).
pub fn normal(random: &mut Pcg64Mcg) -> f64 {
    let radius = (-2.0 * libm::log(1.0 - random.random::<f64>())).sqrt();
    radius * libm::cos(std::f64::consts::TAU * random.random::<f64>())
}

/// What 95 % of values do not exceed on either side, in standard deviations that were found with this many degrees of freedom:
/// 97.5 % quantiles of Student's distribution.
#[must_use]
pub fn student(freedom: usize) -> f64 {
    const QUANTILES: [f64; 6] = [12.71, 4.30, 3.18, 2.78, 2.57, 2.45];
    // The series for more is off by less than 0.01.
    let part = 1.0 / freedom.max(1) as f64;
    let series = 1.96 + part * (2.37 + 2.8 * part);
    QUANTILES.get(freedom.max(1) - 1).copied().unwrap_or(series)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn students_quantiles_are_those_of_tables() {
        for (freedom, quantile) in [
            (1, 12.706),
            (5, 2.571),
            (6, 2.447),
            (10, 2.228),
            (30, 2.042),
            (1000, 1.962),
        ] {
            assert!((student(freedom) - quantile).abs() < 0.01, "{freedom}");
        }
    }

    #[test]
    fn equal_keys_stay_in_their_order() {
        let items = vec![
            ('a', 2.0),
            ('b', -1.0),
            ('c', 2.0),
            ('d', f64::INFINITY),
            ('e', -1.0),
        ];
        let names: String = by(items.clone(), |(_, key)| *key)
            .iter()
            .map(|(name, _)| name)
            .collect();
        assert_eq!(names, "beacd");
        let names: String = by(items, |(_, key)| -key)
            .iter()
            .map(|(name, _)| name)
            .collect();
        assert_eq!(names, "dacbe");
        assert_eq!(order(&[]), [0; 0]);
    }
}

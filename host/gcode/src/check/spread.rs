//! Mean, 95 % and maximum of many values, in little memory.

use serde::Serialize;

/// What is said of many values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Statistics {
    /// Mean.
    pub mean: f64,
    /// 95 % are not larger, to 2 %.
    pub p95: f64,
    /// Maximum.
    pub max: f64,
}

/// Values in classes, each of which is 2 % wide.
#[derive(Clone, Debug)]
pub struct Spread {
    classes: Vec<u64>,
    count: u64,
    sum: f64,
    max: f64,
}

/// The least value that is told from 0.
const LEAST: f64 = 1e-6;
const WIDTH: f64 = 1.02;
/// As far as 1e9.
const CLASSES: usize = 1800;

impl Default for Spread {
    fn default() -> Self {
        Self {
            classes: vec![0; CLASSES],
            count: 0,
            sum: 0.0,
            max: 0.0,
        }
    }
}

impl Spread {
    /// Takes in a value that is not negative.
    pub fn add(&mut self, value: f64) {
        let class = (libm::log((value / LEAST).max(1.0)) / libm::log(WIDTH)) as usize;
        self.classes[class.min(CLASSES - 1)] += 1;
        self.count += 1;
        self.sum += value;
        self.max = self.max.max(value);
    }

    /// The largest value so far.
    #[must_use]
    pub fn largest(&self) -> f64 {
        self.max
    }

    /// What is said of them.
    #[must_use]
    pub fn statistics(&self) -> Statistics {
        if self.count == 0 {
            return Statistics::default();
        }
        let mut left = (0.95 * self.count as f64).ceil() as u64;
        let mut p95 = self.max;
        for (class, count) in self.classes.iter().enumerate() {
            if *count >= left {
                p95 = (LEAST * WIDTH.powi(class as i32 + 1)).min(self.max);
                break;
            }
            left -= count;
        }
        Statistics {
            mean: self.sum / self.count as f64,
            p95,
            max: self.max,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ninety_five_percent_are_told_to_two() {
        let mut spread = Spread::default();
        (1..=1000).for_each(|k| spread.add(f64::from(k) * 0.01));
        let statistics = spread.statistics();
        assert!((statistics.mean - 5.005).abs() < 1e-12);
        assert!(
            statistics.p95 >= 9.5 && statistics.p95 < 9.5 * 1.021,
            "{statistics:?}"
        );
        assert_eq!(statistics.max, 10.0);
    }
}

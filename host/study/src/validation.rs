//! `validation.json`: what was measured at other positions without and with a compensation, by
//! `trueaxis linuxcnc calibrate`.

use serde::{Deserialize, Serialize};

/// Scatter of the tip around the balls (µm).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scatter {
    /// Root mean square over the probings.
    pub rms_um: f64,
    /// The largest.
    pub largest_um: f64,
}

impl Scatter {
    /// Of distances (mm).
    #[must_use]
    pub fn of(distances: &[f64]) -> Self {
        let squares: f64 = distances.iter().map(|mm| mm * mm).sum();
        Self {
            rms_um: (squares / distances.len() as f64).sqrt() * 1e3,
            largest_um: distances.iter().copied().fold(0.0, f64::max) * 1e3,
        }
    }
}

/// A compensation, verified by probings from which nothing was identified.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Validation {
    /// Number of probings, each made before and after.
    pub probings: usize,
    /// The machine as it was found.
    pub before: Scatter,
    /// The machine with the new compensation.
    pub after: Scatter,
    /// What probing itself scatters, from what identification left (µm).
    pub probing_um: f64,
    /// What is not known of the parameters (µm, 95 %, mean over the travel).
    pub coverage_um: f64,
    /// The largest accepted `after.rms_um`: both, and the scatter of so few rows (µm).
    pub expected_um: f64,
    /// Errors that were not measured, `[unseen]` of the error file: they are in none of these figures but `after`, as far
    /// as they show at these positions.
    #[serde(default)]
    pub unseen: Vec<String>,
    /// Whether the new compensation is in use.
    pub is_kept: bool,
}

/// One-sided 95 % quantiles of Student's t, for 1 to 10 degrees of freedom; for more, the last one is on the safe side.
const T: [f64; 10] = [
    6.314, 2.920, 2.353, 2.132, 2.015, 1.943, 1.895, 1.860, 1.833, 1.812,
];

/// How much smaller the distances of the same rows have become.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gain {
    /// Mean (in the unit of the distances).
    pub mean: f64,
    /// The gain that is exceeded with 95 % probability: Student's t of the paired differences.
    pub least: f64,
}

impl Gain {
    /// From the distances of each row before and after from the mean place at its ball; `None` for different rows, or too
    /// few. Each ball takes one row's worth of information for its mean, and one with a single row has no distances.
    #[must_use]
    pub fn of(balls: &[usize], before: &[f64], after: &[f64]) -> Option<Self> {
        if balls.len() != before.len() || before.len() != after.len() {
            return None;
        }
        let count = |ball| balls.iter().filter(|other| **other == ball).count();
        let rows = (0..balls.len()).filter(|i| count(balls[*i]) > 1);
        let rows: Vec<usize> = rows.collect();
        let mut places: Vec<usize> = rows.iter().map(|i| balls[*i]).collect();
        places.sort_unstable();
        places.dedup();
        let independent = rows.len() - places.len();
        if independent < 2 {
            return None;
        }
        let gains = || rows.iter().map(|i| before[*i] - after[*i]);
        let mean = gains().sum::<f64>() / rows.len() as f64;
        let square = gains().map(|g| (g - mean).powi(2)).sum::<f64>() / rows.len() as f64;
        let variance = square * independent as f64 / (independent - 1) as f64;
        let t = T[(independent - 2).min(T.len() - 1)];
        Some(Self {
            mean,
            least: mean - t * (variance / independent as f64).sqrt(),
        })
    }

    /// Whether the later ones are smaller with 95 % probability.
    #[must_use]
    pub fn is_sure(self) -> bool {
        self.least > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    #[test]
    fn rows_are_paired() {
        // Every row gains 1 ± 0.1, though rows differ by far more.
        let before = [10.0, 2.0, 7.0, 30.0, 4.0, 9.0];
        let after = [9.1, 0.9, 6.0, 28.9, 3.1, 1.0];
        // The last row is alone at its ball.
        let balls = [0, 0, 0, 0, 0, 1];
        let gain = Gain::of(&balls, &before, &after).unwrap();
        // Mean 1, mean square deviation 0.008, four independent rows, t of three degrees of freedom.
        assert!((gain.mean - 1.0).abs() < 1e-12);
        let least = 1.0 - 2.353 * (0.008 * 4.0 / 3.0 / 4.0_f64).sqrt();
        assert!((gain.least - least).abs() < 1e-12);
        assert!(gain.is_sure());
        assert!(!Gain::of(&balls, &after, &before).unwrap().is_sure());
        assert_eq!(Gain::of(&balls, &before, &after[..4]), None);
        assert_eq!(Gain::of(&balls[..2], &before[..2], &after[..2]), None);
    }

    /// A machine that has not changed is called better at most once in twenty times, however few rows a ball has.
    #[test]
    fn noise_is_a_gain_in_at_most_one_of_twenty_cases() {
        let mut random = Pcg64Mcg::seed_from_u64(1);
        // A component with noise of 1.
        let mut component = || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
        let cases = 4000;
        for balls in [
            &[0; 10][..],
            &[0, 0, 0, 0, 0, 1, 1, 1, 1, 1],
            &[0, 0, 0, 0, 1, 1, 1, 2, 2, 2],
            &[0, 0, 1, 1, 2, 2, 3, 3, 4, 4],
            &[0, 0, 1, 1, 2, 2, 3, 3, 4, 5],
            &[0, 0, 1, 1],
        ] {
            let mut distances = || {
                let tips: Vec<[f64; 3]> = (balls.iter())
                    .map(|_| std::array::from_fn(|_| component()))
                    .collect();
                let distance = |i: usize| {
                    let own = || (0..tips.len()).filter(|k| balls[*k] == balls[i]);
                    let square = |axis: usize| {
                        let mean = own().map(|k| tips[k][axis]).sum::<f64>() / own().count() as f64;
                        (tips[i][axis] - mean).powi(2)
                    };
                    (0..3).map(square).sum::<f64>().sqrt()
                };
                (0..tips.len()).map(distance).collect::<Vec<f64>>()
            };
            let sure = (0..cases).filter(|_| {
                let (before, after) = (distances(), distances());
                Gain::of(balls, &before, &after).unwrap().is_sure()
            });
            let sure = sure.count();
            // 5 % of 4000 are 200, with a standard deviation of 14; the distances of a ball depend on each other by less
            // than is taken off for its mean, so that it can be fewer.
            assert!((80..242).contains(&sure), "{balls:?}: {sure}");
        }
    }
}

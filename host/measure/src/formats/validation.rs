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

/// A compensation, proven by probings from which nothing was identified.
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
    pub band_um: f64,
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
    /// From the distances of each row before and after; `None` for fewer than two rows, or different ones.
    #[must_use]
    pub fn of(before: &[f64], after: &[f64]) -> Option<Self> {
        let rows = before.len();
        if rows != after.len() || rows < 2 {
            return None;
        }
        let gains = || before.iter().zip(after).map(|(b, a)| b - a);
        let mean = gains().sum::<f64>() / rows as f64;
        let variance = gains().map(|g| (g - mean).powi(2)).sum::<f64>() / (rows - 1) as f64;
        let t = T[(rows - 2).min(T.len() - 1)];
        Some(Self {
            mean,
            least: mean - t * (variance / rows as f64).sqrt(),
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
        let before = [10.0, 2.0, 7.0, 30.0, 4.0];
        let after = [9.1, 0.9, 6.0, 28.9, 3.1];
        let gain = Gain::of(&before, &after).unwrap();
        // Mean 1, standard deviation 0.1, t of four degrees of freedom.
        assert!((gain.mean - 1.0).abs() < 1e-12);
        assert!((gain.least - (1.0 - 2.132 * 0.1 / 5.0_f64.sqrt())).abs() < 1e-12);
        assert!(gain.is_sure());
        assert!(!Gain::of(&after, &before).unwrap().is_sure());
        assert_eq!(Gain::of(&before, &after[..4]), None);
        assert_eq!(Gain::of(&before[..1], &after[..1]), None);
    }

    /// A machine that has not changed is called better once in twenty times.
    #[test]
    fn noise_is_a_gain_in_one_of_twenty_cases() {
        let mut random = Pcg64Mcg::seed_from_u64(1);
        // The length of an error of three components with noise of 1.
        let mut distance = || {
            let component =
                |random: &mut Pcg64Mcg| (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
            let square: f64 = (0..3).map(|_| component(&mut random).powi(2)).sum();
            square.sqrt()
        };
        let cases = 4000;
        let mut sure = 0;
        for _ in 0..cases {
            let before: Vec<f64> = (0..10).map(|_| distance()).collect();
            let after: Vec<f64> = (0..10).map(|_| distance()).collect();
            sure += usize::from(Gain::of(&before, &after).unwrap().is_sure());
        }
        // 5 % of 4000 are 200, with a standard deviation of 14.
        assert!((158..242).contains(&sure), "{sure}");
    }
}

//! The set-up to start from.

use super::{InitialSample, Kind, Setting, SettingPart, SetupPriors};
use nalgebra::{DMatrix, DVector};

impl Kind {
    /// A first set-up: [`Instrument::start`](super::Instrument::start), improved by least squares.
    #[must_use]
    pub fn start(self, given: &SetupPriors, samples: &[InitialSample]) -> Setting {
        /// Each round reduces the error to its square.
        const ROUNDS: usize = 12;
        /// Combinations with a smaller effect than this part of the largest are left as they are.
        const LEAST: f64 = 1e-6;
        let instrument = self.instrument();
        let mut setting = instrument.start(given, samples);
        let parts: Vec<SettingPart> = (instrument.parts().iter().copied())
            .filter(|part| given.sigma(*part).is_none())
            .collect();
        if samples.is_empty() || parts.is_empty() {
            return setting;
        }
        for _ in 0..ROUNDS {
            let (jacobian, rest) = self.linearized(&setting, samples, &parts);
            let svd = jacobian.svd(true, true);
            let least = LEAST * svd.singular_values.max();
            let Ok(step) = svd.solve(&rest, least.max(f64::MIN_POSITIVE)) else {
                break;
            };
            if !step.iter().all(|v| v.is_finite()) {
                break;
            }
            for (part, step) in parts.iter().zip(step.iter()) {
                setting = setting.moved(*part, step / part.lever());
            }
        }
        setting
    }

    /// The derivatives of readings by parts of a set-up, and what is missing of them.
    fn linearized(
        self,
        setting: &Setting,
        samples: &[InitialSample],
        parts: &[SettingPart],
    ) -> (DMatrix<f64>, DVector<f64>) {
        let instrument = self.instrument();
        let rows = 3 * samples.len();
        let (mut jacobian, mut rest) = (DMatrix::zeros(rows, parts.len()), DVector::zeros(rows));
        for (i, InitialSample { commanded, read }) in samples.iter().enumerate() {
            let seen = commanded.seen_nominally();
            let reads = instrument.reads(commanded, setting, &seen);
            rest.fixed_rows_mut::<3>(3 * i).copy_from(&(read - reads));
            for (k, part) in parts.iter().enumerate() {
                let column = instrument.by_part(commanded, setting, &seen, *part);
                let column = column / part.lever();
                jacobian.fixed_view_mut::<3, 1>(3 * i, k).copy_from(&column);
            }
        }
        (jacobian, rest)
    }
}

//! Problems that differ from a given one.

use super::Problem;
use crate::Unknown;
use crate::formats::probings::Probings;
use crate::observed::Observed;
use rand_pcg::Pcg64Mcg;
use trueaxis_model::numbers::normal;

impl Problem<'_> {
    /// With all rows an hour later than drift began.
    pub(crate) fn after_an_hour(&self) -> Self {
        let mut other = self.clone();
        for row in &mut other.places {
            row.hours = [1.0; 6];
        }
        for row in &mut other.observed.rows {
            row.hours = [1.0; 6];
        }
        other
    }

    /// With nothing but probings.
    pub(crate) fn of_probings(&self) -> Self {
        let mut other = self.clone();
        other.observed = Observed::default();
        other.unknowns.retain(|unknown| {
            !matches!(
                unknown,
                Unknown::Setup(..) | Unknown::Tool(..) | Unknown::Drift(..)
            )
        });
        other
    }

    /// This problem with other axis positions, in the order of the file.
    pub(crate) fn with_positions(&self, probings: &Probings) -> Self {
        let mut other = self.clone();
        for place in &mut other.places {
            place.q = self
                .machine
                .to_kinematic(&probings.rows[place.row].position);
        }
        other
    }

    /// This problem with random errors of the lengths of bars and coordinates of the stylus, according to their
    /// standard uncertainties.
    pub(crate) fn with_chance_lengths(mut self, random: &mut Pcg64Mcg) -> Self {
        for bar in &mut self.bars {
            bar.length += bar.sigma * normal(random);
        }
        let known: Vec<(usize, f64)> = self.known_coordinates().collect();
        for (i, sigma) in known {
            self.stylus.tip[i] += sigma * normal(random);
        }
        self
    }

    /// This problem with only balls and stylus as unknowns.
    pub(crate) fn of_setup(&self) -> Self {
        let mut other = self.clone();
        let is_setup = |u: &Unknown| u.parameter().is_none();
        other.unknowns.retain(is_setup);
        other
    }

    /// This problem with an unknown stylus.
    pub(crate) fn without_stylus(&self) -> Self {
        let mut other = self.clone();
        other.stylus.sigma = [None; 3];
        other
    }

    /// This problem without bars.
    pub(crate) fn without_bars(&self) -> Self {
        Self {
            bars: Vec::new(),
            ..self.clone()
        }
    }
}

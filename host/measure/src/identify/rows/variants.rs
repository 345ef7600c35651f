//! Problems that differ from a given one.

use super::Problem;
use crate::formats::probings::Probings;
use crate::identify::Unknown;
use crate::identify::observed::Observed;
use crate::simulate::normal;
use rand_pcg::Pcg64Mcg;

impl Problem<'_> {
    /// With all rows an hour later than drift began.
    pub(in crate::identify) fn after_an_hour(&self) -> Self {
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
    pub(in crate::identify) fn of_probings(&self) -> Self {
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
    pub(in crate::identify) fn with_positions(&self, probings: &Probings) -> Self {
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
    pub(in crate::identify) fn with_chance_lengths(mut self, random: &mut Pcg64Mcg) -> Self {
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
    pub(in crate::identify) fn of_setup(&self) -> Self {
        let mut other = self.clone();
        let is_setup = |u: &Unknown| u.parameter().is_none();
        other.unknowns.retain(is_setup);
        other
    }

    /// This problem with an unknown stylus.
    pub(in crate::identify) fn without_stylus(&self) -> Self {
        let mut other = self.clone();
        other.stylus.sigma = [None; 3];
        other
    }

    /// This problem without bars.
    pub(in crate::identify) fn without_bars(&self) -> Self {
        Self {
            bars: Vec::new(),
            ..self.clone()
        }
    }
}

//! How many points peaks take, with straight lines and with cubics between them.

use super::cover::Function;
use super::cubic;
use super::limits::{LEAST_INTERVALS, LEAST_SEEN, MOST_INTERVALS, MOST_SEEN, SEEN_PER_PEAK};
use super::tables::Found;
use crate::kinematics::{NotConverged, Policy};
use std::collections::BTreeMap;

/// What interpolation of a variable's tables leaves on so many intervals, which see every peak.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    intervals: usize,
    /// With straight lines, and with cubics (in units of the tolerance).
    errors: [f64; 2],
}

impl Seen {
    /// Looks at the tables whose variable has no kinks, where the policy makes peaks.
    pub fn all(found: &Found<'_>) -> Result<BTreeMap<usize, Self>, NotConverged> {
        let peaks = matches!(found.sampler.kinematics.policy, Policy::Direction { .. });
        let bent = found.tables().into_iter().map(|(v, (bent, _))| (v, bent));
        bent.filter(|(v, bent)| {
            let variable = &found.sampler.variables[*v];
            peaks && !bent.is_empty() && variable.is_rich() && cubic::may_be(variable)
        })
        .map(|(v, bent)| Ok((v, Self::of(found, v, &bent)?)))
        .collect()
    }

    fn of(found: &Found<'_>, v: usize, functions: &[Function]) -> Result<Self, NotConverged> {
        let variable = &found.sampler.variables[v];
        // A peak is as wide as the damping; a few points on it are enough to tell, for the tables are
        // measured anyway.
        let [low, high] = variable.range;
        let intervals = match found.sampler.kinematics.policy {
            Policy::Direction { damping } => (SEEN_PER_PEAK * (high - low) / damping) as usize,
            Policy::Orientation | Policy::Position => LEAST_SEEN,
        };
        let intervals = intervals.clamp(LEAST_SEEN, MOST_SEEN);
        let grid = cubic::grid(variable, intervals);
        let [cubic, linear] = found.interpolation_errors(v, functions, &grid)?;
        Ok(Self {
            intervals,
            errors: [linear, cubic],
        })
    }

    /// How many intervals leave `most`, of straight lines and of cubics: their errors fall with the square
    /// and with the third power of the distance.
    pub fn wanted(&self, most: f64) -> [usize; 2] {
        let wanted = |k: usize, power: f64| {
            let more = (self.errors[k] / (0.85 * most)).powf(1.0 / power);
            let wanted = (self.intervals as f64 * more).ceil() as usize;
            wanted.clamp(LEAST_INTERVALS, MOST_INTERVALS)
        };
        [wanted(0, 2.0), wanted(1, 3.0)]
    }
}

//! Evenly spaced points along an input, with all divisions and checks done once at load.

use crate::description::Interpolation;
use crate::load_error::{LoadError, Part};

/// Evenly spaced points along one input.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span {
    /// Position of the first point.
    pub start: f32,
    /// 1 / step.
    pub inverse_step: f32,
    /// From 0 to below this many steps from the start, the kernel reads two neighbouring rows of f32 samples directly;
    /// 0 if it must not.
    pub direct: f32,
    /// Below this many steps from the start the position is used unchanged …
    pub limit: f32,
    /// … otherwise it is replaced by this: the end of the last interval, or the first point with modulo.
    pub beyond: f32,
    /// points · step, or 0 without modulo.
    pub period: f32,
    /// 1 / period, or 0 without modulo.
    pub inverse_period: f32,
    /// Index of the last point.
    pub last: u32,
    /// Index of the point after the last: the last itself, or the first with modulo.
    pub after: u32,
    /// Index of the input within `Inputs`, read as one array.
    pub slot: u8,
}

impl Span {
    pub(super) const EMPTY: Self = Self {
        start: 0.0,
        inverse_step: 0.0,
        direct: 0.0,
        limit: 0.0,
        beyond: 0.0,
        period: 0.0,
        inverse_period: 0.0,
        last: 0,
        after: 0,
        slot: 0,
    };

    /// Checks the points (guarantee 2) and computes the reciprocals that evaluation multiplies by.
    pub(crate) fn new(
        part: Part,
        slot: u8,
        start: f32,
        step: f32,
        points: u32,
        modulo: bool,
        interpolation: Interpolation,
    ) -> Result<Self, LoadError> {
        let inverse_step = 1.0 / step;
        if !(step > 0.0 && step.is_finite() && inverse_step.is_finite()) {
            return Err(LoadError::Step { part });
        }
        let reads = interpolation.reads();
        // Above 2²⁴ not every index is exact in f32.
        if !(reads..=1 << 24).contains(&points) {
            return Err(LoadError::Points { part, points });
        }
        let last = points - 1;
        if !(start.is_finite() && (start + last as f32 * step).is_finite()) {
            return Err(LoadError::Start { part });
        }
        if modulo {
            let period = points as f32 * step;
            let inverse_period = 1.0 / period;
            if !(period.is_finite() && inverse_period.is_finite()) {
                return Err(LoadError::Period { part });
            }
            Ok(Self {
                start,
                inverse_step,
                direct: 0.0,
                limit: points as f32,
                beyond: 0.0,
                period,
                inverse_period,
                last,
                after: 0,
                slot,
            })
        } else {
            let intervals = (points + 1 - reads) as f32;
            Ok(Self {
                start,
                inverse_step,
                direct: intervals,
                limit: intervals,
                beyond: intervals,
                period: 0.0,
                inverse_period: 0.0,
                last,
                after: last,
                slot,
            })
        }
    }

    pub(crate) fn is_modulo(&self) -> bool {
        self.period > 0.0
    }

    /// Number of points.
    pub(super) fn points(&self) -> u64 {
        u64::from(self.last) + 1
    }
}

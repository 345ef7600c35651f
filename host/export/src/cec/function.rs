//! Functions of one axis: the factors of terms.

use super::TravelDirection;
use super::spacing::Spacing;
use trueaxis::Interpolation;

/// The identity of a function: functions of the same origin are equal.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Origin {
    /// A table of the blob, for a direction of travel.
    Table(usize, TravelDirection),
    /// The product of several functions of one axis.
    Product(Vec<Origin>),
}

/// A function of the position of one axis.
#[derive(Clone, Debug)]
pub struct AxisFunction {
    pub origin: Origin,
    /// Index of the axis.
    pub input: usize,
    pub spacing: Spacing,
    pub travel: TravelDirection,
    pub interpolation: Interpolation,
    /// Values at the points; for a cubic table, coefficients.
    pub values: Vec<f64>,
}

impl AxisFunction {
    /// Largest magnitude of a value.
    pub fn peak(&self) -> f64 {
        self.values.iter().fold(0.0, |peak, v| v.abs().max(peak))
    }

    /// First and last position, or its period.
    pub fn span(&self) -> [f64; 2] {
        let beyond = match (self.spacing.modulo, self.interpolation) {
            (true, _) => 0,
            (false, Interpolation::Linear) => 1,
            (false, Interpolation::Cubic) => 3,
        };
        let intervals = self.spacing.points - beyond;
        [f64::from(self.spacing.start), self.spacing.at(intervals)]
    }

    /// Value at a position, in its own direction of travel.
    pub fn at(&self, position: f64) -> f64 {
        let Spacing {
            start,
            step,
            points,
            modulo,
        } = self.spacing;
        let [_, end] = self.span();
        let mut u = (position - f64::from(start)) / f64::from(step);
        let most = (end - f64::from(start)) / f64::from(step);
        u = match modulo {
            true => u.rem_euclid(points as f64),
            false => u.clamp(0.0, most),
        };
        let i = u.floor();
        let t = u - i;
        let value = |k: usize| {
            let k = i as usize + k;
            let k = if modulo {
                k % points
            } else {
                k.min(points - 1)
            };
            self.values[k]
        };
        match self.interpolation {
            Interpolation::Linear => value(0) + (value(1) - value(0)) * t,
            Interpolation::Cubic => {
                let s = 1.0 - t;
                let w0 = s * s * s / 6.0;
                let w2 = (1.0 + 3.0 * t + 3.0 * t * t - 3.0 * t * t * t) / 6.0;
                let w3 = t * t * t / 6.0;
                let w1 = 1.0 - w0 - w2 - w3;
                w0 * value(0) + w1 * value(1) + w2 * value(2) + w3 * value(3)
            }
        }
    }

    /// Largest difference from another function, at and between the points.
    pub fn difference(&self, other: &dyn Fn(f64) -> f64, span: [f64; 2]) -> f64 {
        let count = BETWEEN * self.spacing.points.max(256);
        (0..=count)
            .map(|k| span[0] + (span[1] - span[0]) * k as f64 / count as f64)
            .map(|x| (self.at(x) - other(x)).abs())
            .fold(0.0, f64::max)
    }
}

/// Number of positions per interval at which a difference is evaluated.
const BETWEEN: usize = 8;

/// Values of a function at equidistant points over a span.
pub fn sampled(
    function: &dyn Fn(f64) -> f64,
    [from, to]: [f64; 2],
    intervals: usize,
    modulo: bool,
) -> (Spacing, Vec<f64>) {
    let spacing = Spacing {
        start: from as f32,
        step: ((to - from) / intervals as f64) as f32,
        points: if modulo { intervals } else { intervals + 1 },
        modulo,
    };
    let values = (0..spacing.points).map(|k| function(spacing.at(k)));
    (spacing, values.collect())
}

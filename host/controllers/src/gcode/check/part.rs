//! The part of the way at which a written position belongs.

use super::{Along, Check};
use crate::gcode::axes::{COUNT, PerLetter, is_rotary};
use crate::gcode::trace::{Field, Lost, Path};
use crate::gcode::travel_directions::TravelDirections;

impl Check<'_> {
    /// The part of the way at which a written position belongs: the nearest, where the tolerances of linear and of
    /// rotary axes count alike. (With a degree for a millimetre, half a micrometre along a short path would seem to be
    /// microradians.)
    pub(super) fn part(
        &self,
        along: &Along<'_>,
        at: &PerLetter,
        ways: &TravelDirections,
    ) -> Result<f64, Lost> {
        let (segment, last_t) = (along.segment, along.last_t);
        let back = Field {
            undo: true,
            ..along.field
        };
        let q = back.node(0.0, at, ways)?.to;
        let degree = self.options.tolerance / self.options.direction.to_degrees();
        let counts: PerLetter = std::array::from_fn(|i| match is_rotary(i) {
            true => degree * degree,
            false => 1.0,
        });
        let t = match &segment.path {
            Path::Line(from, to) => {
                let (mut dot, mut square) = (0.0, 0.0);
                for i in 0..COUNT {
                    dot += counts[i] * (q[i] - from[i]) * (to[i] - from[i]);
                    square += counts[i] * (to[i] - from[i]).powi(2);
                }
                if square > 0.0 { dot / square } else { 1.0 }
            }
            Path::Arc(arc) => {
                let [i, j, _] = arc.axes;
                let angle = |p: &PerLetter| (p[j] - arc.centre[1]).atan2(p[i] - arc.centre[0]);
                let turn = std::f64::consts::TAU / arc.sweep.abs();
                let mut t = (angle(&q) - angle(&arc.from)) / arc.sweep;
                // The turn at which it is next to where it was.
                t += ((last_t - t) / turn).round() * turn;
                if t < last_t - 0.5 * turn.min(1.0) {
                    t += turn;
                }
                t
            }
        };
        // From there to the nearest point of the path: across a steep helix the angle tells little.
        let mut t = t.clamp(0.0, 1.0);
        if let Path::Arc(_) = segment.path {
            for _ in 0..4 {
                let (low, high) = ((t - 1e-6).max(0.0), (t + 1e-6).min(1.0));
                let (a, b, here) = (
                    segment.path.at(low),
                    segment.path.at(high),
                    segment.path.at(t),
                );
                let (mut dot, mut square) = (0.0, 0.0);
                for i in 0..COUNT {
                    let way = (b[i] - a[i]) / (high - low);
                    dot += counts[i] * (q[i] - here[i]) * way;
                    square += counts[i] * way * way;
                }
                t = (t + dot / square).clamp(0.0, 1.0);
            }
        }
        Ok(t)
    }
}

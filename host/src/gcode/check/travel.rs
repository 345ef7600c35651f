//! Which way axes go along a motion of the program.

use super::Check;
use crate::gcode::axes::COUNT;
use crate::gcode::correct::Backlash;
use crate::gcode::program::Segment;
use crate::gcode::trace::{Field, Lost, Path};
use std::f64::consts::FRAC_PI_2;
use trueaxis::Travel;

impl Check<'_> {
    /// Takes the directions of travel along.
    pub(super) fn follow(&mut self, field: &Field<'_>, segment: &Segment) -> Result<(), Lost> {
        let before = self.ways.clone();
        let steps = match segment.path {
            Path::Line(..) if field.tip.is_none() => 1,
            _ => 64,
        };
        let mut parts: Vec<f64> = (1..=steps).map(|k| k as f64 / steps as f64).collect();
        if let Path::Arc(arc) = segment.path {
            // Where an axis of the plane turns round: at every quarter.
            let [i, j, _] = arc.axes;
            let start = (arc.from[j] - arc.centre[1]).atan2(arc.from[i] - arc.centre[0]);
            let quarters = (arc.sweep.abs() / FRAC_PI_2) as i32 + 4;
            let turns =
                (-quarters..=quarters).map(|k| (f64::from(k) * FRAC_PI_2 - start) / arc.sweep);
            parts.extend(turns.filter(|t| *t > 0.0 && *t < 1.0));
            parts.sort_by(f64::total_cmp);
        }
        for t in parts {
            let q = field.axes(&segment.path.at(t))?;
            self.ways.come_to(self.tables, &q);
        }
        if self.options.backlash == Backlash::Leave && before.missing(self.tables).is_none() {
            self.ways = before;
        }
        Ok(())
    }

    /// Which way every axis goes at a part of the way.
    pub(super) fn head(
        &mut self,
        field: &Field<'_>,
        segment: &Segment,
        t: f64,
    ) -> Result<(), Lost> {
        let (from, to) = if t < 0.999 {
            (t, t + 0.001)
        } else {
            (t - 0.001, t)
        };
        let [from, to] = [from, to].map(|t| field.axes(&segment.path.at(t)));
        let (from, to) = (from?, to?);
        for i in 0..COUNT {
            let by = to[i] - from[i];
            if by > 1e-9 {
                self.all[i] = Travel::Positive;
            } else if by < -1e-9 {
                self.all[i] = Travel::Negative;
            }
        }
        Ok(())
    }
}

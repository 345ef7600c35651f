//! Which way axes go along a motion of the program.

use super::arriving::NEAR;
use super::{Along, Check};
use crate::gcode::axes::{COUNT, PerLetter};
use crate::gcode::correct::Backlash;
use crate::gcode::interpret::bits;
use crate::gcode::program::Segment;
use crate::gcode::tables::Tables;
use crate::gcode::trace::{Field, Lost, Path};
use crate::gcode::travel_directions::TravelDirections;
use std::f64::consts::FRAC_PI_2;
use trueaxis::Travel;

/// A hysteresis that is told from none (mm, degrees).
const FINEST: f64 = 1e-3;
/// A 64th of a move is halved so often at most.
const MOST_HALVINGS: u32 = 8;

/// The parts of the way at which an axis of the plane of an arc turns round, in order: at every quarter.
pub(super) fn quarters(path: &Path) -> Vec<f64> {
    let Path::Arc(arc) = path else {
        return Vec::new();
    };
    let [i, j, _] = arc.axes;
    let start = (arc.from[j] - arc.centre[1]).atan2(arc.from[i] - arc.centre[0]);
    let count = (arc.sweep.abs() / FRAC_PI_2) as i32 + 4;
    let turns = (-count..=count).map(|k| (f64::from(k) * FRAC_PI_2 - start) / arc.sweep);
    let mut turns: Vec<f64> = turns.filter(|t| *t > 0.0 && *t < 1.0).collect();
    turns.sort_by(f64::total_cmp);
    turns
}

/// Directions of travel, and the corrected place at which a motion ends with them.
pub(super) type End = (TravelDirections, PerLetter);

impl Along<'_> {
    /// Takes directions along from one part of the way to another, past every place where an axis of an arc turns
    /// round: how far one has come back counts from there.
    pub(super) fn goes(
        &self,
        tables: &Tables<'_>,
        ways: &mut TravelDirections,
        [from, to]: [f64; 2],
    ) -> Result<(), Lost> {
        let first = self.quarters.partition_point(|t| *t <= from);
        let between = self.quarters[first..].iter().take_while(|t| **t < to);
        for t in between.chain([&to]) {
            ways.come_to(tables, &self.field.axes(&self.segment.path.at(*t))?);
        }
        Ok(())
    }
}

impl Check<'_> {
    /// False where directions stay what they are, whichever way axes go: reversals are left out.
    pub(super) fn axes_turn(&self) -> bool {
        self.options.backlash != Backlash::Leave || self.ways.missing(self.tables).is_some()
    }

    /// Where a motion of the program ends, corrected, with the directions of travel there; and where else it may. Axes
    /// that follow the tip come back slowly: whether one has turned round yet the last digits of words may decide.
    pub(super) fn ends(
        &self,
        field: &Field<'_>,
        segment: &Segment,
    ) -> Result<(End, Vec<End>), Lost> {
        let end = |slack: f64| {
            let mut ways = self.ways.clone().rounded_by(NEAR.map(|near| slack * near));
            self.follow(field, segment, &mut ways)?;
            let ways = ways.rounded_by([0.0; 2]);
            let to = field.node(1.0, &segment.to(), &ways)?.to;
            Ok((ways, to))
        };
        let first: End = end(0.0)?;
        let mut others: Vec<End> = Vec::new();
        if field.tip.is_some() && self.tables.directional != 0 {
            for slack in [1.0, -1.0] {
                let other = end(slack)?;
                if other.0.travel != first.0.travel {
                    others.push(other);
                }
            }
        }
        Ok((first, others))
    }

    /// Takes the directions of travel along.
    fn follow(
        &self,
        field: &Field<'_>,
        segment: &Segment,
        ways: &mut TravelDirections,
    ) -> Result<(), Lost> {
        if !self.axes_turn() {
            return Ok(());
        }
        let steps = match segment.path {
            Path::Line(..) if field.tip.is_none() => 1,
            _ => 64,
        };
        let mut parts: Vec<f64> = (1..=steps).map(|k| k as f64 / steps as f64).collect();
        parts.extend(quarters(&segment.path));
        parts.sort_by(f64::total_cmp);
        let mut from = (0.0, field.axes(&segment.path.at(0.0))?);
        for t in parts {
            let to = (t, field.axes(&segment.path.at(t))?);
            if field.tip.is_some() {
                self.follow_bent(field, segment, [from, to], MOST_HALVINGS, ways)?;
            }
            ways.come_to(self.tables, &to.1);
            from = to;
        }
        Ok(())
    }

    /// Axes that follow the tip bend, and turn round anywhere: looked at between two places as often as it takes to
    /// miss no way back that counts.
    fn follow_bent(
        &self,
        field: &Field<'_>,
        segment: &Segment,
        [from, to]: [(f64, PerLetter); 2],
        halvings: u32,
        ways: &mut TravelDirections,
    ) -> Result<(), Lost> {
        let t = 0.5 * (from.0 + to.0);
        let q = field.axes(&segment.path.at(t))?;
        let is_bent = bits(self.tables.directional).any(|i| {
            let off = (q[i] - 0.5 * (from.1[i] + to.1[i])).abs();
            // A parabola goes back within it if its ends differ by less than 4 times as much.
            let may_turn = (to.1[i] - from.1[i]).abs() < 8.0 * off;
            may_turn && off > 0.1 * self.tables.hysteresis[i].max(FINEST)
        });
        if is_bent && halvings > 0 {
            self.follow_bent(field, segment, [from, (t, q)], halvings - 1, ways)?;
            ways.come_to(self.tables, &q);
            self.follow_bent(field, segment, [(t, q), to], halvings - 1, ways)?;
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

//! Directions of travel along a path, and where on it an axis reverses.
//!
//! Directions are those of the axes with their corrections ([`Tables::middle`](crate::tables::Tables::middle)): a correction
//! may move an axis back that the program holds still. An axis has reversed once it has come back by more than its reversal
//! threshold. The reversal itself is where it came back from: the corrected path steps there, not where the reversal threshold
//! is used up.

use super::{Field, Lost, MOST_PARTS, Path, Travels};
use crate::axes::PerLetter;
use crate::interpret::bits;
use crate::tables::{FINEST, OF_THRESHOLD};
use crate::travel_directions::{TravelDirections, opposite, sign};
use trueaxis_model::numbers::{ascending, by};

/// A part of a path on which no axis reverses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    /// Where it begins, as a part of the way.
    pub from: f64,
    /// Where it ends.
    pub to: f64,
    /// The directions of travel on it.
    pub travel: Travels,
}

/// Parts that a path of the tip is looked at in, at least.
const PARTS: usize = 64;
/// A part is halved so often at most.
const HALVINGS: u32 = 8;

/// A place on the path: the part of the way, and where the axes are commanded to, whichever way they travel.
type Place = (f64, PerLetter);

impl Field<'_> {
    /// The stretches of a path between reversals, of which there is one at least; `ways` are the directions at its start,
    /// then those at its end.
    ///
    /// # Errors
    /// A place of the tip that no axis positions reach.
    pub fn stretches(
        &self,
        path: &Path,
        ways: &mut TravelDirections,
    ) -> Result<Vec<Stretch>, Lost> {
        let whole = |travel| Stretch {
            from: 0.0,
            to: 1.0,
            travel,
        };
        let directional = self.tables.directional;
        if directional == 0 || !self.turns {
            return Ok(vec![whole(ways.travel)]);
        }
        let (mut travel, reversals) = self.reversals(path, ways)?;
        let mut stretches = vec![whole(travel)];
        for (t, axis) in reversals {
            travel[axis] = opposite(travel[axis]);
            let last = stretches.len() - 1;
            if t > stretches[last].from {
                stretches[last].to = t;
                stretches.push(Stretch {
                    from: t,
                    to: 1.0,
                    travel,
                });
            } else {
                stretches[last].travel = travel;
            }
        }
        Ok(stretches)
    }

    /// The directions at the start of a path, and where which axis turns round along it.
    fn reversals(
        &self,
        path: &Path,
        ways: &mut TravelDirections,
    ) -> Result<(Travels, Vec<(f64, usize)>), Lost> {
        let directional = self.tables.directional;
        let mut travel = ways.travel;
        let places = self.places(path)?;
        let mut reversals: Vec<(f64, usize)> = Vec::new();
        // Where each axis last began to go its way, on this path.
        let mut since = [0; crate::axes::COUNT];
        for (k, (_, at)) in places.iter().enumerate().skip(1) {
            let before = ways.travel;
            ways.come_to(self.tables, at);
            for axis in bits(directional).filter(|axis| ways.travel[*axis] != before[*axis]) {
                let way = sign(ways.travel[axis]);
                // The farthest place in the direction before.
                let back = |n: &usize| way * places[*n].1[axis];
                let from = (since[axis]..k).min_by(|a, b| back(a).total_cmp(&back(b)));
                since[axis] = from.unwrap_or(0);
                match before[axis] {
                    // Not known until now: it has been this one since the beginning.
                    trueaxis::Travel::Unknown => travel[axis] = ways.travel[axis],
                    _ => reversals.push((places[since[axis]].0, axis)),
                }
            }
        }
        Ok((travel, by(reversals, |(place, _)| *place)))
    }

    /// Places of a path, between which no axis turns round and back by what counts.
    fn places(&self, path: &Path) -> Result<Vec<Place>, Lost> {
        let place = |t: f64| self.place(path, t);
        let first = place(0.0)?;
        let mut places = vec![first];
        let parts = self.parts(path).min(MOST_PARTS);
        let (count, halvings) = match (self.tip, path) {
            (Some(_), _) => (parts.max(PARTS), HALVINGS),
            (None, Path::Line(..)) if self.tables.keeps_straight(&path.by()) => (1, 0),
            (None, Path::Line(..)) => (parts, HALVINGS),
            // Where it turns axes round is known.
            (None, Path::Arc(_)) => (parts, 0),
        };
        let mut parts: Vec<f64> = (1..count).map(|k| k as f64 / count as f64).collect();
        if let Path::Arc(arc) = path {
            parts.extend(arc.turns_round());
            ascending(&mut parts);
        }
        parts.push(1.0);
        for t in parts {
            self.bent(path, place(t)?, halvings, &mut places)?;
        }
        Ok(places)
    }

    /// The place at a part of the way.
    fn place(&self, path: &Path, t: f64) -> Result<Place, Lost> {
        Ok((t, self.middle(&self.axes(&path.at(t))?)))
    }

    /// Adds a place, and others before it where axes may turn round in between.
    fn bent(
        &self,
        path: &Path,
        to: Place,
        halvings: u32,
        places: &mut Vec<Place>,
    ) -> Result<(), Lost> {
        if let Some(from) = places.last().copied()
            && halvings > 0
        {
            let middle = self.place(path, 0.5 * (from.0 + to.0))?;
            let is_bent = bits(self.tables.directional).any(|i| {
                let off = (middle.1[i] - 0.5 * (from.1[i] + to.1[i])).abs();
                // A parabola goes back within it if its ends differ by less than 4 times as much.
                let may_turn = (to.1[i] - from.1[i]).abs() < 8.0 * off;
                may_turn && off > OF_THRESHOLD * self.tables.reversal_threshold[i].max(FINEST)
            });
            if is_bent {
                self.bent(path, middle, halvings - 1, places)?;
                return self.bent(path, to, halvings - 1, places);
            }
        }
        places.push(to);
        Ok(())
    }
}

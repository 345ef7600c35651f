//! Directions of travel along a path, and where on it an axis reverses.
//!
//! An axis has reversed once it has come back by more than its reversal threshold. The reversal itself is where it came back
//! from: the corrected path steps there, not where the reversal threshold is used up.

use super::{Field, Lost, Path, Travels};
use crate::axes::PerLetter;
use crate::interpret::bits;
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

/// Parts that a path of the tip, or an arc while other axes move, is looked at in.
const PARTS: usize = 64;
/// A part is halved so often at most.
const HALVINGS: u32 = 8;
/// The smallest reversal threshold that differs from none (mm, degrees).
const FINEST: f64 = 1e-3;

/// A place on the path: the part of the way, and the axes.
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
        for (k, (_, q)) in places.iter().enumerate().skip(1) {
            let before = ways.travel;
            ways.come_to(self.tables, q);
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
        let place = |t: f64| Ok((t, self.axes(&path.at(t))?));
        let first = place(0.0)?;
        let mut places = vec![first];
        let mut parts: Vec<f64> = match (path, self.tip) {
            (Path::Line(..), None) => Vec::new(),
            (Path::Arc(_), None) => Vec::new(),
            _ => (1..PARTS).map(|k| k as f64 / PARTS as f64).collect(),
        };
        if let Path::Arc(arc) = path {
            parts.extend(arc.turns_round());
            ascending(&mut parts);
        }
        parts.push(1.0);
        for t in parts {
            self.bent(path, place(t)?, HALVINGS, &mut places)?;
        }
        Ok(places)
    }

    /// Adds a place, and others before it where axes that follow the tip may turn round in between.
    fn bent(
        &self,
        path: &Path,
        to: Place,
        halvings: u32,
        places: &mut Vec<Place>,
    ) -> Result<(), Lost> {
        if let (Some(_), Some(from)) = (self.tip, places.last().copied())
            && halvings > 0
        {
            let t = 0.5 * (from.0 + to.0);
            let q = self.axes(&path.at(t))?;
            let is_bent = bits(self.tables.directional).any(|i| {
                let off = (q[i] - 0.5 * (from.1[i] + to.1[i])).abs();
                // A parabola goes back within it if its ends differ by less than 4 times as much.
                let may_turn = (to.1[i] - from.1[i]).abs() < 8.0 * off;
                may_turn && off > 0.02 * self.tables.reversal_threshold[i].max(FINEST)
            });
            if is_bent {
                self.bent(path, (t, q), halvings - 1, places)?;
                return self.bent(path, to, halvings - 1, places);
            }
        }
        places.push(to);
        Ok(())
    }
}

//! The smallest clearance of two sets of solids while axes move.

use super::distance::distance;
use nalgebra::Vector3;
use trueaxis_kinematics::{Carriers, Htm, Nominal};
use trueaxis_model::machine::{Branch, Carrier, MAX_AXES, Machine, PerAxis, SolidShape};

/// A solid on its carrier.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// What carries it.
    pub carrier: Carrier,
    /// Shape.
    pub shape: SolidShape,
    /// Own frame in that of its carrier (mm, rad).
    pub place: Htm,
}

/// Two bodies that must stay apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyPair {
    /// Their indices.
    pub bodies: [usize; 2],
    /// Their least distance (mm).
    pub keep: f64,
}

/// Where two bodies come too close.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Index of the pair.
    pub pair: usize,
    /// Their distance (mm), within [`RESOLVED`]; 0 or less if they meet.
    pub apart: f64,
    /// Axis positions (mm, deg).
    pub at: PerAxis,
}

/// Distances are resolved to this (mm): a move is refused if it comes closer than what is asked and this.
pub const RESOLVED: f64 = 0.01;

/// Where the clearance of a move is least, if that is less than asked anywhere: of all pairs, the one that misses most.
/// `None` proves that every pair keeps its distance everywhere on the move. All axes start and stop together (mm, deg).
#[must_use]
pub fn nearest(
    machine: &Machine,
    bodies: &[Body],
    pairs: &[BodyPair],
    from: &PerAxis,
    to: &PerAxis,
) -> Option<Nearest> {
    let mut search = ClearanceSearch {
        machine,
        nominal: Nominal::new(machine),
        bodies,
        pairs,
        ends: [machine.to_kinematic(from), machine.to_kinematic(to)],
        misses: 0.0,
        found: None,
    };
    let all: Vec<usize> = (0..pairs.len()).collect();
    search.interval(0.0, 1.0, &all);
    search.found
}

/// The pairs that may come closer than asked while each axis is anywhere between its least and its largest position here
/// (mm, deg).
#[must_use]
pub(crate) fn may_meet(
    machine: &Machine,
    bodies: &[Body],
    pairs: &[BodyPair],
    positions: &[PerAxis],
) -> Vec<BodyPair> {
    let bound = |choose: fn(f64, f64) -> f64, from: f64| {
        positions.iter().fold([from; MAX_AXES], |ends, position| {
            std::array::from_fn(|i| choose(ends[i], position[i]))
        })
    };
    let low = machine.to_kinematic(&bound(f64::min, f64::INFINITY));
    let high = machine.to_kinematic(&bound(f64::max, f64::NEG_INFINITY));
    let middle: PerAxis = std::array::from_fn(|i| 0.5 * (low[i] + high[i]));
    let half: PerAxis = std::array::from_fn(|i| 0.5 * (high[i] - low[i]));
    let look = Look::new(machine, &Nominal::new(machine), &middle);
    let may = |pair: &&BodyPair| {
        let [a, b] = pair.bodies.map(|i| look.placed(&bodies[i], &half));
        let needed = pair.keep + a.moves + b.moves;
        a.spheres_apart(&b) < needed
            && distance((a.shape, &a.place), (b.shape, &b.place)).least < needed
    };
    pairs.iter().filter(may).copied().collect()
}

struct ClearanceSearch<'a> {
    machine: &'a Machine,
    nominal: Nominal<'a>,
    bodies: &'a [Body],
    pairs: &'a [BodyPair],
    /// mm, rad.
    ends: [PerAxis; 2],
    /// Pairs whose distance minus what is asked is at least this need not be looked at: 0, then what was found.
    misses: f64,
    found: Option<Nearest>,
}

impl ClearanceSearch<'_> {
    /// Looks at a part of the move, from 0 to 1, of which only these pairs are not known to be clear.
    fn interval(&mut self, from: f64, to: f64, pairs: &[usize]) {
        let middle = 0.5 * (from + to);
        let [start, end] = &self.ends;
        let q: PerAxis = std::array::from_fn(|i| start[i] + middle * (end[i] - start[i]));
        let half = std::array::from_fn(|i| 0.5 * (to - from) * (end[i] - start[i]).abs());
        let look = Look::new(self.machine, &self.nominal, &q);
        let mut rest = Vec::new();
        for &number in pairs {
            let BodyPair { bodies, keep } = self.pairs[number];
            let [a, b] = bodies.map(|i| look.placed(&self.bodies[i], &half));
            let moves = a.moves + b.moves;
            if a.spheres_apart(&b) - moves - keep >= self.misses {
                continue;
            }
            let apart = distance((a.shape, &a.place), (b.shape, &b.place));
            let here = Nearest {
                pair: number,
                apart: apart.most,
                at: self.machine.to_command(&q),
            };
            let misses = apart.most - keep - RESOLVED;
            if misses < self.misses {
                self.misses = misses;
                self.found = Some(here);
            }
            // Bodies that meet cannot come closer.
            if apart.most <= 0.0 {
                return;
            }
            if apart.least - moves - keep >= self.misses {
                continue;
            }
            // Rounding keeps both bounds from meeting, so that dividing does not help: it is not verified to be clear.
            if moves < 0.1 * RESOLVED {
                self.misses = self.misses.min(apart.least - keep);
                self.found.get_or_insert(here);
                continue;
            }
            rest.push(number);
        }
        if rest.is_empty() {
            return;
        }
        self.interval(from, middle, &rest);
        if self.found.is_none_or(|found| found.apart > 0.0) {
            self.interval(middle, to, &rest);
        }
    }
}

/// The machine at one position.
struct Look<'a> {
    machine: &'a Machine,
    carriers: Carriers,
    /// Rotary axes as lines in the foundation frame: a point and a direction.
    lines: [Option<[Vector3<f64>; 2]>; MAX_AXES],
}

/// A body there.
struct PlacedBody<'b> {
    shape: &'b SolidShape,
    place: Htm,
    /// The farthest that a point of it goes (mm).
    moves: f64,
}

impl PlacedBody<'_> {
    /// Distance of the spheres around both (mm), which is not more than their own.
    fn spheres_apart(&self, other: &Self) -> f64 {
        (self.place.t - other.place.t).norm() - self.shape.reach() - other.shape.reach()
    }
}

impl<'a> Look<'a> {
    fn new(machine: &'a Machine, nominal: &Nominal<'_>, q: &PerAxis) -> Self {
        let carriers = nominal.carriers(q);
        let line = |i: usize| {
            let letter = machine.axes.get(i)?.letter;
            let frame = &carriers.axes[i];
            (letter.is_rotary()).then(|| [frame.t, frame.r.column(letter.component()).into()])
        };
        Self {
            machine,
            lines: std::array::from_fn(line),
            carriers,
        }
    }

    /// A body, while no axis goes farther than `half` (mm, rad) from here.
    ///
    /// One axis after the other is taken from here to where it is at another time, the innermost first: those farther out
    /// are still here, so that each moves the body by no more than its way, times the lever for a rotary one.
    fn placed<'b>(&self, body: &'b Body, half: &PerAxis) -> PlacedBody<'b> {
        let place = match body.carrier {
            Carrier::Foundation => body.place,
            Carrier::Axis(axis) => self.carriers.axes[axis] * body.place,
            Carrier::Spindle => self.carriers.spindle * body.place,
            Carrier::Workpiece => self.carriers.workpiece * body.place,
        };
        let moves = carried_by(self.machine, body.carrier).map(|axis| match &self.lines[axis] {
            None => half[axis],
            Some([point, way]) => {
                half[axis] * ((place.t - point).cross(way).norm() + body.shape.reach())
            }
        });
        PlacedBody {
            shape: &body.shape,
            moves: moves.sum(),
            place,
        }
    }
}

/// The axes that move what is fixed to a carrier.
fn carried_by(machine: &Machine, carrier: Carrier) -> impl Iterator<Item = usize> + use<'_> {
    let (branch, last) = match carrier {
        Carrier::Foundation => (None, 0),
        Carrier::Axis(axis) => (Some(machine.axes[axis].branch), axis),
        Carrier::Spindle => (Some(Branch::Tool), machine.axes.len()),
        Carrier::Workpiece => (Some(Branch::Workpiece), machine.axes.len()),
    };
    let axes = machine.axes.iter().enumerate();
    axes.filter(move |(i, axis)| Some(axis.branch) == branch && *i <= last)
        .map(|(i, _)| i)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Table C and X, Y on the workpiece's side, Z on the tool's.
    fn machine() -> Machine {
        let axis = |name: &str, branch: &str, range: &str| {
            format!("[[axis]]\nname = \"{name}\"\nbranch = \"{branch}\"\nrange = {range}\n")
        };
        let text = format!(
            "name = \"m\"\n{}{}{}{}[spindle]\naxis = \"z\"\n[tool]\ntip_mm = [0.0, 0.0, -100.0]\n",
            axis("X", "workpiece", "[-500.0, 500.0]"),
            axis("Y", "workpiece", "[-500.0, 500.0]"),
            axis("C", "workpiece", "[-360.0, 360.0]"),
            axis("Z", "tool", "[-500.0, 500.0]"),
        );
        Machine::from_toml(&text).unwrap()
    }

    fn ball(carrier: Carrier, place: [f64; 3], radius: f64) -> Body {
        Body {
            carrier,
            shape: SolidShape::Sphere { radius },
            place: Htm::translation(place.into()),
        }
    }

    fn at(position: &[f64]) -> PerAxis {
        let mut all = PerAxis::default();
        all[..position.len()].copy_from_slice(position);
        all
    }

    /// Pins that are 0.1 mm thick, on a way of 900 mm.
    #[test]
    fn the_shortest_meeting_on_a_long_move_is_found() {
        let machine = machine();
        let keep = |keep: f64| {
            [BodyPair {
                bodies: [0, 1],
                keep,
            }]
        };
        for place in [-311.0, 0.0, 87.123] {
            let bodies = [
                ball(Carrier::Spindle, [0.0, 0.03, 0.0], 0.05),
                ball(Carrier::Workpiece, [place, 0.0, 0.0], 0.05),
            ];
            let (from, to) = (at(&[-450.0, 0.0, 0.0, 0.0]), at(&[450.0, 0.0, 0.0, 0.0]));
            let found = nearest(&machine, &bodies, &keep(0.0), &from, &to).unwrap();
            // They overlap on 0.19 mm.
            assert!(found.apart <= RESOLVED && (found.at[0] + place).abs() < 0.11);
            // Past each other at 0.03 mm, after turning by a part of a degree.
            let (from, to) = (at(&[-450.0, 0.2, 0.0, 0.0]), at(&[450.0, 0.2, 0.0, 0.0]));
            assert!(nearest(&machine, &bodies, &keep(0.0), &from, &to).is_none());
            let found = nearest(&machine, &bodies, &keep(0.1), &from, &to).unwrap();
            assert!((found.apart - 0.07).abs() < RESOLVED, "{found:?}");
        }
    }

    /// A ball on a circle of 200 mm passes another one at its far side, at 3 mm.
    #[test]
    fn a_turn_is_a_circle() {
        let machine = machine();
        let bodies = [
            ball(Carrier::Foundation, [-213.0, 0.0, 0.0], 5.0),
            ball(Carrier::Axis(2), [200.0, 0.0, 0.0], 5.0),
        ];
        let pair = |keep: f64| {
            [BodyPair {
                bodies: [0, 1],
                keep,
            }]
        };
        let (from, to) = (at(&[0.0, 0.0, 10.0, 0.0]), at(&[0.0, 0.0, 350.0, 0.0]));
        assert!(nearest(&machine, &bodies, &pair(2.98), &from, &to).is_none());
        let found = nearest(&machine, &bodies, &pair(3.5), &from, &to).unwrap();
        assert!((found.apart - 3.0).abs() < RESOLVED);
        assert!((found.at[2] - 180.0).abs() < 1.0);
        let short = at(&[0.0, 0.0, 150.0, 0.0]);
        assert!(nearest(&machine, &bodies, &pair(50.0), &from, &short).is_none());
        assert_eq!(
            may_meet(&machine, &bodies, &pair(3.0), &[from, to]).len(),
            1
        );
        assert!(
            may_meet(
                &machine,
                &bodies,
                &pair(3.0),
                &[from, at(&[0.0, 0.0, 30.0, 0.0])]
            )
            .is_empty()
        );
    }
}

//! Where a corrected path is divided so that straight lines, or arcs, keep it.

use super::arc::Arc;
use super::axes::{COUNT, PerLetter, is_rotary};
use super::limits::Limits;
use super::trace::Node;
use std::f64::consts::TAU;

/// The difference of a node to the straight line between two others.
fn off_line(first: &Node, last: &Node, node: &Node) -> PerLetter {
    let whole = last.t - first.t;
    let part = if whole > 0.0 {
        (node.t - first.t) / whole
    } else {
        0.0
    };
    std::array::from_fn(|i| node.to[i] - first.to[i] - part * (last.to[i] - first.to[i]))
}

/// Numbers of the nodes at which straight lines end, the last one among them: each line as long as the limits allow.
pub fn straight(nodes: &[Node], limits: &Limits, ends: &mut Vec<usize>) {
    let last = nodes.len().saturating_sub(1);
    let mut from = 0;
    while from < last {
        let keeps = |to: usize| is_straight(&nodes[from..=to], limits);
        let (mut good, mut step) = (from + 1, 1);
        // In strides that double while they hold, then in ones that halve.
        let mut grows = true;
        while step > 0 && good < last {
            let to = (good + step).min(last);
            if keeps(to) {
                good = to;
                step = if grows { 2 * step } else { step / 2 };
            } else {
                grows = false;
                step /= 2;
            }
        }
        ends.push(good);
        from = good;
    }
}

/// True if a straight line between the first and the last of them keeps all nodes.
#[must_use]
pub fn is_straight(nodes: &[Node], limits: &Limits) -> bool {
    let (Some(first), Some(last)) = (nodes.first(), nodes.last()) else {
        return true;
    };
    nodes[1..nodes.len().max(2) - 1]
        .iter()
        .all(|node| limits.of(&off_line(first, last, node)) <= 1.0)
}

/// Ends of an arc that are no farther apart are one place (mm): what words are rounded by, in two axes.
const MEETS: f64 = 2e-4;
/// A radius that is fitted is another one by less, in parts of it.
const ANOTHER: f64 = 0.1;
/// Steps towards the best centre: each is as exact as the deviations are small beside the radius.
const STEPS: usize = 6;

/// How far nodes are off a circle, and how that changes if its centre goes along each of one or two ways.
struct Deviations {
    /// The largest and the smallest difference to the radius, each with its slope along the first way.
    outermost: [f64; 2],
    innermost: [f64; 2],
    /// Normal equations of all differences.
    a: [[f64; 2]; 2],
    b: [f64; 2],
}

impl Deviations {
    /// The circle goes through `begin`; `plane` are its axes.
    fn new(
        nodes: &[Node],
        plane: [usize; 2],
        begin: [f64; 2],
        centre: [f64; 2],
        ways: &[[f64; 2]],
    ) -> Self {
        let out = |at: [f64; 2]| {
            let by = [at[0] - centre[0], at[1] - centre[1]];
            let radius = libm::hypot(by[0], by[1]);
            (radius, [by[0] / radius, by[1] / radius])
        };
        let (radius, begin) = out(begin);
        let mut all = Self {
            outermost: [f64::NEG_INFINITY, 0.0],
            innermost: [f64::INFINITY, 0.0],
            a: [[0.0; 2]; 2],
            b: [0.0; 2],
        };
        for node in nodes {
            let (distance, normal) = out(plane.map(|axis| node.to[axis]));
            let mut slope = [0.0; 2];
            for (slope, way) in slope.iter_mut().zip(ways) {
                *slope = (begin[0] - normal[0]) * way[0] + (begin[1] - normal[1]) * way[1];
            }
            all.add(distance - radius, slope);
        }
        all
    }

    fn add(&mut self, off: f64, slope: [f64; 2]) {
        if off > self.outermost[0] {
            self.outermost = [off, slope[0]];
        }
        if off < self.innermost[0] {
            self.innermost = [off, slope[0]];
        }
        for row in 0..2 {
            self.b[row] -= slope[row] * off;
            for column in 0..2 {
                self.a[row][column] += slope[row] * slope[column];
            }
        }
    }

    /// How far the centre goes along each way.
    fn best_step(&self, ways: usize) -> [f64; 2] {
        let Self { a, b, .. } = self;
        let (by, determinant) = match ways {
            // All slopes have one sign: the largest distance is least where the farthest places on both sides are
            // equally far off.
            1 => (
                [-(self.outermost[0] + self.innermost[0]), 0.0],
                self.outermost[1] + self.innermost[1],
            ),
            _ => (
                [
                    b[0] * a[1][1] - b[1] * a[0][1],
                    b[1] * a[0][0] - b[0] * a[1][0],
                ],
                a[0][0] * a[1][1] - a[0][1] * a[1][0],
            ),
        };
        by.map(|by| by / determinant)
    }
}

/// The arc from one place to the last node that is nearest to the corrected nodes of an arc, if there is one: its centre
/// and its radius are fitted so that the largest distance from it is least; of a full turn by least squares.
#[must_use]
pub fn fitted(arc: &Arc, from: &PerLetter, nodes: &[Node]) -> Option<Arc> {
    let (first, last) = (nodes.first()?, nodes.last()?);
    let [i, j, _] = arc.axes;
    let mut to = last.to;
    let chord = [to[i] - from[i], to[j] - from[j]];
    let length = libm::hypot(chord[0], chord[1]);
    let part = (last.t - first.t) * arc.sweep;
    let whole = (part.abs() / TAU).round();
    let closes = (part.abs() - whole * TAU).abs() < 1e-9 && whole > 0.0;
    // Ways on which the centre keeps the distances of both ends alike: any, or along the line that halves the chord.
    let mut centre = arc.centre;
    let ways: &[[f64; 2]] = if closes {
        // It ends where it begins, but for the last digits of words.
        if length > 0.75 * MEETS {
            return None;
        }
        (to[i], to[j]) = (from[i], from[j]);
        &[[1.0, 0.0], [0.0, 1.0]]
    } else {
        // The last digits of words could make a full turn of it, or nothing.
        if length < 10.0 * MEETS {
            return None;
        }
        let way = [chord[0] / length, chord[1] / length];
        let middle = [0.5 * (from[i] + to[i]), 0.5 * (from[j] + to[j])];
        let along = (centre[0] - middle[0]) * way[0] + (centre[1] - middle[1]) * way[1];
        centre = [centre[0] - along * way[0], centre[1] - along * way[1]];
        &[[-way[1], way[0]]]
    };
    let begun = centre;
    for _ in 0..STEPS {
        let off = Deviations::new(nodes, [i, j], [from[i], from[j]], centre, ways);
        for (by, way) in off.best_step(ways.len()).iter().zip(ways) {
            centre = [centre[0] + by * way[0], centre[1] + by * way[1]];
        }
    }
    // So short an arc says little of its radius: it keeps that of the program.
    let radius = libm::hypot(from[i] - centre[0], from[j] - centre[1]);
    let nominal = arc.radii()[0];
    let is_like = (radius - nominal).abs() <= ANOTHER * nominal;
    let centre = if is_like { centre } else { begun };
    let turns = (part.abs() / TAU - 1e-9).ceil().max(1.0) as u32;
    let fitted = Arc::new(*from, to, arc.axes, centre, arc.sweep < 0.0, turns);
    ((fitted.sweep - part).abs() <= 0.1).then_some(fitted)
}

/// How far the corrected nodes of an arc are from a fitted one at most, in parts of what is allowed.
#[must_use]
pub(crate) fn off_arc(fitted: &Arc, nodes: &[Node], limits: &Limits) -> f64 {
    let (Some(first), Some(last)) = (nodes.first(), nodes.last()) else {
        return 0.0;
    };
    let span = last.t - first.t;
    let radius = fitted.radii()[0];
    let turns = (0..COUNT).any(|k| is_rotary(k) && fitted.from[k] != fitted.to[k]);
    let off = nodes.iter().map(|node| {
        let t = (node.t - first.t) / span;
        let at = fitted.at(t);
        let off: PerLetter = std::array::from_fn(|k| node.to[k] - at[k]);
        match turns {
            true => limits.of(&off),
            false => limits.of(&across(&off, &fitted.slope(t), radius)),
        }
    });
    off.fold(0.0, f64::max)
}

/// What of a difference is across a path of this slope, whose radius is given: where along the path something is does not
/// matter, but for how far the path curves away by there.
#[must_use]
pub(crate) fn across(off: &PerLetter, slope: &PerLetter, radius: f64) -> PerLetter {
    let square: f64 = slope.iter().map(|d| d * d).sum();
    if square == 0.0 {
        return *off;
    }
    let along = off.iter().zip(slope).map(|(o, s)| o * s).sum::<f64>() / square;
    let curved = 0.5 * along * along * square / radius;
    let rest: PerLetter = std::array::from_fn(|k| off[k] - along * slope[k]);
    let length = rest.iter().map(|d| d * d).sum::<f64>().sqrt();
    match length > 0.0 {
        true => rest.map(|d| d * (1.0 + curved / length)),
        false => rest,
    }
}

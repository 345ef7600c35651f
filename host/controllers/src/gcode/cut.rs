//! Where a corrected path is cut so that straight lines, or arcs, keep it.

use super::arc::Arc;
use super::axes::{COUNT, PerLetter};
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

/// Numbers of the nodes at which straight lines end, the last one among them.
pub fn straight(nodes: &[Node], limits: &Limits, ends: &mut Vec<usize>) {
    // Those still to be looked at, the next one last.
    let mut later = vec![nodes.len().saturating_sub(1)];
    let mut from = 0;
    while let Some(&to) = later.last() {
        let mut worst = (1.0, None);
        if to > from + 1 {
            for k in from + 1..to {
                let off = limits.of(&off_line(&nodes[from], &nodes[to], &nodes[k]));
                if off > worst.0 {
                    worst = (off, Some(k));
                }
            }
        }
        match worst.1 {
            Some(k) => later.push(k),
            None => {
                ends.push(to);
                from = to;
                later.pop();
            }
        }
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

/// An arc from one place to another that keeps the corrected nodes of an arc, if there is one.
#[must_use]
pub fn arc(arc: &Arc, from: &PerLetter, nodes: &[Node], limits: &Limits) -> Option<Arc> {
    let shifted = fitted(arc, from, nodes)?;
    (off_arc(arc, &shifted, nodes, limits) <= 1.0).then_some(shifted)
}

/// The arc from one place to another that is nearest to the corrected nodes of an arc, if there is one.
#[must_use]
pub fn fitted(arc: &Arc, from: &PerLetter, nodes: &[Node]) -> Option<Arc> {
    let (first, last) = (nodes.first()?, nodes.last()?);
    let [i, j, _] = arc.axes;
    let mut to = last.to;
    // The centre goes along with the mean of the nodes.
    let mut moved = [0.0; 2];
    for node in nodes {
        let at = arc.at(node.t);
        moved[0] += (node.to[i] - at[i]) / nodes.len() as f64;
        moved[1] += (node.to[j] - at[j]) / nodes.len() as f64;
    }
    let mut centre = [arc.centre[0] + moved[0], arc.centre[1] + moved[1]];
    let chord = [to[i] - from[i], to[j] - from[j]];
    let length = chord[0].hypot(chord[1]);
    let part = (last.t - first.t) * arc.sweep;
    let whole = (part.abs() / TAU).round();
    let closes = (part.abs() - whole * TAU).abs() < 1e-9 && whole > 0.0;
    if closes {
        // It ends where it begins, but for the last digits of words.
        if length > MEETS {
            return None;
        }
        (to[i], to[j]) = (from[i], from[j]);
    } else {
        // The last digits of words could make a full turn of it, or nothing.
        if length < 10.0 * MEETS {
            return None;
        }
        // As far from one end as from the other: on the line that halves the chord.
        let way = [chord[0] / length, chord[1] / length];
        let middle = [0.5 * (from[i] + to[i]), 0.5 * (from[j] + to[j])];
        let along = (centre[0] - middle[0]) * way[0] + (centre[1] - middle[1]) * way[1];
        centre[0] -= along * way[0];
        centre[1] -= along * way[1];
    }
    let turns = (part.abs() / TAU - 1e-9).ceil().max(1.0) as u32;
    let shifted = Arc::new(*from, to, arc.axes, centre, arc.sweep < 0.0, turns);
    ((shifted.sweep - part).abs() <= 0.1).then_some(shifted)
}

/// How far the corrected nodes of an arc are from a shifted one at most, in parts of what is allowed.
#[must_use]
pub(crate) fn off_arc(arc: &Arc, shifted: &Arc, nodes: &[Node], limits: &Limits) -> f64 {
    let (Some(first), Some(last)) = (nodes.first(), nodes.last()) else {
        return 0.0;
    };
    let [i, j, _] = arc.axes;
    let span = last.t - first.t;
    let off = nodes.iter().map(|node| {
        let at = shifted.at((node.t - first.t) / span);
        let mut off: PerLetter = std::array::from_fn::<f64, COUNT, _>(|k| node.to[k] - at[k]);
        let flat = (0..COUNT).all(|k| k == i || k == j || arc.from[k] == arc.to[k]);
        if flat {
            // Where along the arc it is does not matter, but how far from it.
            let way = [at[i] - shifted.centre[0], at[j] - shifted.centre[1]];
            let radius = way[0].hypot(way[1]);
            let out = (off[i] * way[0] + off[j] * way[1]) / radius;
            let square = off[i].powi(2) + off[j].powi(2) - out.powi(2);
            // Along the circle by s is off it by s²/2r.
            off[i] = out.abs() + 0.5 * square.max(0.0) / radius;
            off[j] = 0.0;
        }
        limits.of(&off)
    });
    off.fold(0.0, f64::max)
}

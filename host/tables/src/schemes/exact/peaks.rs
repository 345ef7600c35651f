//! Finds where a correction changes quickly along a rotary axis: where the tool is nearly parallel to another rotary
//! axis, the damped solution has a peak as wide as its damping.

use super::turning::{responses, within_travel};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use std::f64::consts::TAU;
use trueaxis_model::kinematics::{Kinematics, Policy};

/// Number of random positions of the other axes at which peaks are searched.
const PLACES: usize = 2;
/// Samples per damping along the axis, and their largest number.
const LOOKS: f64 = 2.0;
const MOST_LOOKS: usize = 1500;
/// Number of nodes at the peaks: as many as the functions of a peak, its slopes, their squares and products.
const NODES: usize = 16;
/// A sine or cosine alone makes no step longer than this many times the mean.
const STEEP: f64 = 2.5;

/// Nodes where the responses to small errors change quickly, evenly spaced along the path of the responses; none if
/// they change at about the same rate everywhere.
pub fn nodes(kinematics: &Kinematics<'_>, index: usize) -> Vec<f64> {
    let Policy::Direction { damping } = kinematics.policy else {
        return Vec::new();
    };
    let machine = kinematics.machine;
    let [low, high] = machine.axes[index].travel.map(f64::to_radians);
    // Everything repeats after one turn.
    let high = high.min(low + TAU);
    let steps = ((high - low) * LOOKS / damping).ceil() as usize;
    let steps = steps.clamp(60, MOST_LOOKS);
    let at = |k: usize| low + (high - low) * k as f64 / steps as f64;
    let mut random = Pcg64Mcg::seed_from_u64(5);
    // Change of the responses in each step, relative to their size.
    let mut ways = vec![0.0; steps];
    for _ in 0..PLACES {
        let start = within_travel(machine, &mut random);
        let rows: Vec<Vec<f64>> = (0..=steps)
            .map(|k| {
                let mut q = start;
                q[index] = at(k);
                responses(kinematics, &q)
            })
            .collect();
        let size = |row: &[f64]| row.iter().map(|x| x * x).sum::<f64>().sqrt();
        let largest = rows.iter().map(|row| size(row)).fold(0.0, f64::max);
        for (way, pair) in ways.iter_mut().zip(rows.windows(2)) {
            let step: Vec<f64> = pair[0].iter().zip(&pair[1]).map(|(a, b)| b - a).collect();
            *way += size(&step) / largest.max(f64::MIN_POSITIVE);
        }
    }
    let whole: f64 = ways.iter().sum();
    let steepest = ways.iter().copied().fold(0.0, f64::max);
    if steepest * steps as f64 <= STEEP * whole {
        return Vec::new();
    }
    let mut nodes = Vec::with_capacity(NODES);
    let mut gone = 0.0;
    for (k, way) in ways.iter().enumerate() {
        let next = whole * (nodes.len() as f64 + 0.5) / NODES as f64;
        if nodes.len() < NODES && gone + way > next {
            nodes.push(at(k) + (at(k + 1) - at(k)) * (next - gone) / way);
        }
        gone += way;
    }
    nodes
}

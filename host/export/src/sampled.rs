//! A compensation on the grid of a controller that has fewer inputs.

use crate::positions::travel;
use serde::Serialize;
use trueaxis::{Axis, Travel};
use trueaxis_model::machine::MAX_AXES;
use trueaxis_model::parallel;
use trueaxis_model::validate::Command;

/// Equidistant positions along an axis (mm, deg).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Nodes {
    /// The first.
    pub start: f64,
    /// From one to the next; positive.
    pub step: f64,
    /// How many; at least 2.
    pub count: usize,
}

impl Nodes {
    /// `count` of them from one end of a range to the other.
    #[must_use]
    pub fn over([low, high]: [f64; 2], count: usize) -> Self {
        Self {
            start: low,
            step: (high - low) / (count - 1) as f64,
            count,
        }
    }

    /// The position of one.
    #[must_use]
    pub fn at(&self, index: usize) -> f64 {
        self.start + self.step * index as f64
    }

    /// The node before a position, and how far the position is towards the next one, from 0 to 1. Before the first
    /// and after the last node, that node.
    #[must_use]
    pub fn cell(&self, position: f64) -> (usize, f64) {
        let along = ((position - self.start) / self.step).clamp(0.0, (self.count - 1) as f64);
        let node = (along as usize).min(self.count - 2);
        (node, along - node as f64)
    }
}

/// `M` values at each node of a grid over some axes.
#[derive(Clone, Debug, PartialEq)]
pub struct SampledGrid<const M: usize> {
    /// The nodes along each axis.
    pub nodes: Vec<Nodes>,
    /// The values; the index of the first axis changes fastest.
    pub values: Vec<[f64; M]>,
}

impl<const M: usize> SampledGrid<M> {
    /// Evaluates `value` at all nodes.
    pub fn of(nodes: &[Nodes], value: impl Fn(&[f64]) -> [f64; M] + Sync) -> Self {
        let count = nodes.iter().map(|n| n.count).product();
        let indices: Vec<usize> = (0..count).collect();
        let values = parallel::map(&indices, |index| {
            let mut rest = *index;
            let along = nodes.iter().map(|axis| {
                let k = rest % axis.count;
                rest /= axis.count;
                axis.at(k)
            });
            value(&along.collect::<Vec<_>>())
        });
        Self {
            nodes: nodes.to_vec(),
            values,
        }
    }

    /// Multilinear interpolation; the outermost nodes hold beyond the grid.
    #[must_use]
    pub fn at(&self, position: &[f64]) -> [f64; M] {
        let cells: Vec<(usize, f64)> = (self.nodes.iter().zip(position))
            .map(|(nodes, p)| nodes.cell(*p))
            .collect();
        let mut sum = [0.0; M];
        for corner in 0..1 << cells.len() {
            let (mut index, mut stride, mut weight) = (0, 1, 1.0);
            for (axis, (nodes, (node, t))) in self.nodes.iter().zip(&cells).enumerate() {
                let next = corner >> axis & 1;
                index += stride * (node + next);
                stride *= nodes.count;
                weight *= if next == 1 { *t } else { 1.0 - t };
            }
            for (sum, value) in sum.iter_mut().zip(self.values[index]) {
                *sum += weight * value;
            }
        }
        sum
    }
}

/// Places of the axes that a grid does not have: all corners of the travel, and some places within it.
///
/// A correction that is affine in these axes is extreme at a corner, so the middle of the extremes is the best value
/// there; within, others are nearly so.
pub struct OtherAxes(Vec<Command>);

/// Number of random places beside the corners.
const WITHIN: usize = 24;

impl OtherAxes {
    /// Takes the places within the travel from random `commands`. `inputs` are the axes that the grid has.
    #[must_use]
    pub fn new(axes: &[Axis], inputs: &[usize], commands: &[Command]) -> Self {
        let others: Vec<usize> = (0..axes.len()).filter(|i| !inputs.contains(i)).collect();
        if others.is_empty() {
            return Self(commands.iter().take(1).copied().collect());
        }
        let corners = commands.iter().cycle().take(1 << others.len());
        let corners = corners.enumerate().map(|(corner, command)| {
            let mut command = *command;
            for (k, axis) in others.iter().enumerate() {
                command.axes[*axis] = travel(&axes[*axis])[corner >> k & 1] as f32;
            }
            command
        });
        Self(
            corners
                .chain(commands.iter().take(WITHIN).copied())
                .collect(),
        )
    }

    /// The middle between the extremes of values over all places. `set` moves the axes of the grid.
    pub fn middle<const M: usize>(
        &self,
        set: impl Fn(&mut Command),
        values: impl Fn(&Command) -> [f64; M],
    ) -> [f64; M] {
        let mut extremes = [[f64::INFINITY, f64::NEG_INFINITY]; M];
        for command in &self.0 {
            let mut command = *command;
            set(&mut command);
            for ([low, high], value) in extremes.iter_mut().zip(values(&command)) {
                *low = low.min(value);
                *high = high.max(value);
            }
        }
        extremes.map(|[low, high]| (low + high) / 2.0)
    }
}

/// A command with all directions of travel unknown, which stands for the mean of both.
#[must_use]
pub fn without_direction(command: &Command) -> Command {
    Command {
        travel: [Travel::Unknown; MAX_AXES],
        ..*command
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A product of straight lines is what multilinear interpolation keeps; beyond the grid its edge holds.
    #[test]
    fn a_grid_interpolates_linearly_in_each_axis() {
        let nodes = [
            Nodes::over([-1.0, 3.0], 3),
            Nodes::over([0.0, 10.0], 6),
            Nodes::over([5.0, 6.0], 2),
        ];
        let f = |p: &[f64]| [p[0] * p[1] - 2.0 * p[2], (1.0 + p[0]) * p[1] * p[2]];
        let grid = SampledGrid::of(&nodes, f);
        assert_eq!(grid.values.len(), 36);
        for p in [[0.3, 7.7, 5.25], [-1.0, 0.0, 5.0], [3.0, 10.0, 6.0]] {
            for (found, expected) in grid.at(&p).iter().zip(f(&p)) {
                // Rounding of numbers up to 240.
                assert!((found - expected).abs() < 1e-12 * 240.0);
            }
        }
        assert_eq!(grid.at(&[-9.0, 99.0, 5.5]), grid.at(&[-1.0, 10.0, 5.5]));
    }
}

//! The grid of commands to which a scheme is fitted: the same number of positions of every axis, evenly spaced over
//! its travel.

use trueaxis_model::machine::{Axis, Machine, PerAxis};
use trueaxis_model::parallel;

/// Nodes of a block, and number of blocks in memory at a time: more than any computer has cores.
const BLOCK: usize = 1000;
const HELD: usize = 128;

/// A grid of commands (mm, rad).
pub struct Lattice {
    along: Vec<Vec<f64>>,
}

impl Lattice {
    /// An equal number of positions along every axis, including both ends of its travel; 10 give 10⁵ nodes with five
    /// axes, as in the source document (section 5.9.1). A single position is the middle.
    pub fn over(machine: &Machine, positions: usize) -> Self {
        let axes = machine.axes.iter();
        Self {
            along: axes.map(|axis| evenly(axis, positions)).collect(),
        }
    }

    /// With another number of positions along one axis.
    pub fn evenly(self, machine: &Machine, axis: usize, positions: usize) -> Self {
        self.with(axis, &evenly(&machine.axes[axis], positions))
    }

    /// With given positions along one axis (mm, rad).
    pub fn with(mut self, axis: usize, positions: &[f64]) -> Self {
        self.along[axis] = positions.to_vec();
        self
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.along.iter().map(Vec::len).product()
    }

    /// The command (mm, rad) of a node.
    fn command(&self, mut node: usize) -> PerAxis {
        let mut q = PerAxis::default();
        for (q, positions) in q.iter_mut().zip(&self.along).rev() {
            *q = positions[node % positions.len()];
            node /= positions.len();
        }
        q
    }

    /// Sums the contributions of all nodes, block by block on all cores. Blocks are added in order, so the sum does
    /// not depend on the number of cores. Only a few partial sums are held in memory.
    pub fn sum<S: Send, E: Send>(
        &self,
        nothing: impl Fn() -> S + Sync,
        add: impl Fn(&mut S, &PerAxis) -> Result<(), E> + Sync,
        join: impl Fn(&mut S, S),
    ) -> Result<S, E> {
        let of_block = |block: usize| {
            let mut sum = nothing();
            let mut nodes = block * BLOCK..self.nodes().min((block + 1) * BLOCK);
            nodes.try_for_each(|node| add(&mut sum, &self.command(node)))?;
            Ok(sum)
        };
        let blocks = self.nodes().div_ceil(BLOCK);
        let mut total = nothing();
        for first in (0..blocks).step_by(HELD) {
            let some = Vec::from_iter(first..blocks.min(first + HELD));
            for sum in parallel::try_map(&some, |block| of_block(*block))? {
                join(&mut total, sum);
            }
        }
        Ok(total)
    }
}

fn evenly(axis: &Axis, positions: usize) -> Vec<f64> {
    let [low, high] = axis.travel.map(|t| axis.to_kinematic(t));
    let part = |k: usize| match positions {
        1 => 0.5,
        n => k as f64 / (n - 1) as f64,
    };
    (0..positions)
        .map(|k| low + (high - low) * part(k))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mill() -> Machine {
        Machine::from_toml(include_str!("../../../../examples/mill-21/machine.toml")).unwrap()
    }

    #[test]
    fn every_combination_of_positions_is_a_node_once() {
        let machine = mill();
        let lattice = Lattice::over(&machine, 4).with(1, &[7.0, 9.0]);
        assert_eq!(lattice.nodes(), 32);
        let mut seen: Vec<String> = (0..32)
            .map(|n| format!("{:?}", lattice.command(n)))
            .collect();
        seen.sort();
        seen.dedup();
        assert_eq!(seen.len(), 32);
        // The last axis is the fastest index.
        let [x, y, z] = [0, 1, 2].map(|i| lattice.command(13)[i]);
        let third = |i: usize, k: f64| {
            let [low, high] = machine.axes[i].travel;
            low + (high - low) * k / 3.0
        };
        let off = (x - third(0, 1.0)).abs() + (y - 9.0).abs() + (z - third(2, 1.0)).abs();
        assert!(off < 1e-12, "{x} {y} {z}");
    }

    #[test]
    fn sums_take_in_every_node() {
        let lattice = Lattice::over(&mill(), 13);
        let add = |sum: &mut (usize, f64), q: &PerAxis| {
            sum.0 += 1;
            sum.1 += q[2];
            Ok::<(), ()>(())
        };
        let join = |total: &mut (usize, f64), sum: (usize, f64)| {
            total.0 += sum.0;
            total.1 += sum.1;
        };
        let (nodes, sum) = lattice.sum(|| (0, 0.0), add, join).unwrap();
        assert_eq!(nodes, 13 * 13 * 13);
        // The mean of Z, which goes from -400 to 0.
        assert!((sum / 2197.0 + 200.0).abs() < 1e-9);
    }
}

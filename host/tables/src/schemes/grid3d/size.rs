//! Chooses the size of a grid (section 4.5.1, Fig. 4.4).

use super::mesh::{Mesh, Zone, add, before, correction, error, evenly};
use super::{Rms, Wanted};
use crate::schemes::SchemeError;
use trueaxis_model::kinematics::{Kinematics, NotConverged};
use trueaxis_model::machine::PerAxis;
use trueaxis_model::parallel;
use trueaxis_model::validate::{Region, random_commands};

/// Number of the random commands at which grids are compared (Eq. 12).
const COMMANDS: usize = 2000;

/// The smallest number of nodes of a linear axis.
const LEAST: usize = 2;
/// The largest distance (deg) between nodes of a rotary axis. With half a turn or more, nodes may all lie at the zeros of a
/// sine, and one more changes nothing.
const APART: f64 = 45.0;

/// The inputs of the choice.
pub struct Sizing<'a> {
    kinematics: &'a Kinematics<'a>,
    axes: [usize; 3],
    /// Position of the other axes (mm, rad).
    at: PerAxis,
    zone: Zone,
    wanted: &'a Wanted,
    /// Random commands (mm, rad) in the zone, with the other axes at `at`.
    commands: Vec<PerAxis>,
}

impl<'a> Sizing<'a> {
    pub fn new(
        kinematics: &'a Kinematics<'a>,
        axes: [usize; 3],
        at: PerAxis,
        zone: Zone,
        wanted: &'a Wanted,
    ) -> Result<Self, SchemeError> {
        let drawn = random_commands(kinematics, Region::Travel, COMMANDS, wanted.seed)?;
        let commands = drawn.iter().map(|command| {
            let mut q = at;
            for (axis, [low, high]) in axes.into_iter().zip(zone) {
                let [from, to] = kinematics.machine.axes[axis].travel;
                let part = (f64::from(command.axes[axis]) - from) / (to - from);
                q[axis] = kinematics.machine.axes[axis].to_kinematic(low + (high - low) * part);
            }
            q
        });
        Ok(Self {
            kinematics,
            axes,
            at,
            zone,
            wanted,
            commands: commands.collect(),
        })
    }

    /// The smallest grid to which one more node along each axis adds less than the threshold.
    ///
    /// # Errors
    /// [`SchemeError::Threshold`] if no grid up to the largest meets it.
    pub fn smallest(&self) -> Result<Mesh<'a>, SchemeError> {
        let most = self.wanted.most;
        let mut sizes = match self.wanted.per_axis {
            true => self.along_each()?,
            false => self.least(),
        };
        let mut mesh = self.mesh(sizes)?;
        let mut left = self.left(&mesh);
        loop {
            // If the larger grid hardly improves on it, the smaller one is large enough.
            let finer = self.mesh(sizes.map(|n| n + 1))?;
            let left_by_finer = self.left(&finer);
            let change = self.change(left, left_by_finer);
            if change < self.wanted.threshold {
                return Ok(mesh);
            }
            if sizes.iter().all(|n| *n >= most) {
                return Err(SchemeError::Threshold {
                    threshold_um: 1e3 * self.wanted.threshold,
                    most,
                    change_um: 1e3 * change,
                });
            }
            sizes = sizes.map(|n| (n + 1).min(most));
            if sizes == finer.sizes() {
                (mesh, left) = (finer, left_by_finer);
            } else {
                mesh = self.mesh(sizes)?;
                left = self.left(&mesh);
            }
        }
    }

    /// Norm of the root mean squares (mm) of the remaining error with `nodes` nodes along each axis (Fig. 4.5).
    pub fn left_by(&self, nodes: usize) -> Result<f64, NotConverged> {
        let [x, y, z] = self.left(&self.mesh([nodes; 3])?);
        Ok((x * x + y * y + z * z).sqrt())
    }

    /// The smallest number of nodes along each axis.
    fn least(&self) -> [usize; 3] {
        std::array::from_fn(|k| {
            let [low, high] = self.zone[k];
            match self.kinematics.machine.axes[self.axes[k]]
                .letter
                .is_rotary()
            {
                true => (((high - low) / APART).ceil() as usize + 1).min(self.wanted.most),
                false => LEAST,
            }
        })
    }

    fn mesh(&self, sizes: [usize; 3]) -> Result<Mesh<'a>, NotConverged> {
        Mesh::new(self.kinematics, self.axes, &self.at, &self.zone, sizes)
    }

    /// ‖RMS − RMS‖ of Eq. 11 (mm).
    fn change(&self, [x, y, z]: [f64; 3], [u, v, w]: [f64; 3]) -> f64 {
        ((x - u).powi(2) + (y - v).powi(2) + (z - w).powi(2)).sqrt()
    }

    /// Eq. 12 for a grid, along each direction of the tool frame (mm).
    fn left(&self, mesh: &Mesh<'_>) -> [f64; 3] {
        self.rms(&parallel::map(&self.commands, |q| mesh.left(q)))
    }

    fn rms(&self, errors: &[[f64; 3]]) -> [f64; 3] {
        let count = errors.len() as f64;
        std::array::from_fn(|k| {
            let root = errors.iter().map(|e| e[k] * e[k]).sum::<f64>().sqrt();
            match self.wanted.rms {
                Rms::Usual => root / count.sqrt(),
                Rms::Printed => root / count,
            }
        })
    }

    /// For each axis, the smallest number of nodes to which one more adds less than the threshold, if corrections
    /// were exact along the others; the largest permitted number if there is none.
    fn along_each(&self) -> Result<[usize; 3], NotConverged> {
        let mut sizes = self.least();
        for (k, size) in sizes.iter_mut().enumerate() {
            let mut left = self.left_along(k, *size)?;
            while *size < self.wanted.most {
                let next = self.left_along(k, *size + 1)?;
                if self.change(left, next) < self.wanted.threshold {
                    break;
                }
                *size += 1;
                left = next;
            }
        }
        Ok(sizes)
    }

    /// Eq. 12 if corrections are interpolated along one axis only, between `nodes` nodes.
    fn left_along(&self, k: usize, nodes: usize) -> Result<[f64; 3], NotConverged> {
        let (kinematics, axis) = (self.kinematics, self.axes[k]);
        let of_axis = &kinematics.machine.axes[axis];
        let nodes = evenly(self.zone[k].map(|q| of_axis.to_kinematic(q)), nodes);
        let of = |q: &PerAxis| {
            let (first, ratio) = before(&nodes, q[axis]);
            let mut dq = PerAxis::default();
            for (node, part) in [(first, 1.0 - ratio), (first + 1, ratio)] {
                let mut there = *q;
                there[axis] = nodes[node];
                add(&mut dq, part, &correction(kinematics, &there)?);
            }
            Ok(error(kinematics, q, &dq))
        };
        let errors: Vec<[f64; 3]> = parallel::try_map(&self.commands, of)?;
        Ok(self.rms(&errors))
    }
}

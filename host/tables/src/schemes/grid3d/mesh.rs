//! A grid of three axes with the kinematic correction at its nodes.

use crate::schemes::moments::SAMPLED;
use trueaxis_model::errors::{Situation, Switches};
use trueaxis_model::kinematics::{Kinematics, NotConverged};
use trueaxis_model::machine::PerAxis;
use trueaxis_model::parallel;

/// Corrections at the nodes of a grid; the first axis is the slowest index.
pub struct Mesh<'a> {
    /// Indices of its axes.
    pub axes: [usize; 3],
    /// Positions of the nodes along each (mm, rad).
    pub along: [Vec<f64>; 3],
    /// The kinematic correction (mm, rad).
    pub corrections: Vec<PerAxis>,
    kinematics: &'a Kinematics<'a>,
}

impl<'a> Mesh<'a> {
    /// A grid with evenly spaced nodes of each axis over a zone (mm, deg). Other axes are at `at` (mm, rad).
    pub fn new(
        kinematics: &'a Kinematics<'a>,
        axes: [usize; 3],
        at: &PerAxis,
        zone: &Zone,
        sizes: [usize; 3],
    ) -> Result<Self, NotConverged> {
        let machine = kinematics.machine;
        let along: [Vec<f64>; 3] = std::array::from_fn(|k| {
            let axis = &machine.axes[axes[k]];
            evenly(zone[k].map(|q| axis.to_kinematic(q)), sizes[k])
        });
        let nodes = Vec::from_iter(0..sizes.iter().product());
        let corrections = parallel::try_map(&nodes, |node: &usize| {
            let of = place(*node, sizes);
            let mut q = *at;
            for k in 0..3 {
                q[axes[k]] = along[k][of[k]];
            }
            correction(kinematics, &q)
        })?;
        Ok(Self {
            axes,
            corrections,
            along,
            kinematics,
        })
    }

    /// The place of each node along the axes.
    pub fn places(&self) -> impl Iterator<Item = [usize; 3]> {
        let sizes = self.sizes();
        (0..self.corrections.len()).map(move |node| place(node, sizes))
    }

    /// Number of nodes along each axis.
    pub fn sizes(&self) -> [usize; 3] {
        self.along.each_ref().map(Vec::len)
    }

    /// Remaining volumetric error at a command (mm, rad) with interpolated corrections (mm), Eq. 10.
    pub fn left(&self, q: &PerAxis) -> [f64; 3] {
        let between: [(usize, f64); 3] =
            std::array::from_fn(|k| before(&self.along[k], q[self.axes[k]]));
        let [_, y, z] = self.sizes();
        let mut dq = PerAxis::default();
        // Eq. 14: the weight of each corner is its proximity along each axis.
        for corner in 0..8_usize {
            let (mut node, mut part) = (0, 1.0);
            for (k, (first, ratio)) in between.into_iter().enumerate() {
                let up = corner >> k & 1;
                node = node * [1, y, z][k] + first + up;
                part *= if up == 1 { ratio } else { 1.0 - ratio };
            }
            add(&mut dq, part, &self.corrections[node]);
        }
        error(self.kinematics, q, &dq)
    }
}

/// The place of a node along each axis.
fn place(node: usize, sizes: [usize; 3]) -> [usize; 3] {
    [
        node / (sizes[1] * sizes[2]),
        node / sizes[2] % sizes[1],
        node % sizes[2],
    ]
}

/// Range of the nodes of each axis (mm, deg).
pub type Zone = [[f64; 2]; 3];

/// Evenly spaced nodes of an axis.
pub fn evenly([low, high]: [f64; 2], nodes: usize) -> Vec<f64> {
    let part = |k: usize| k as f64 / (nodes - 1) as f64;
    (0..nodes).map(|k| low + (high - low) * part(k)).collect()
}

/// The node before a position, and the fraction of the way to the next one (0 to 1, Eq. 13).
pub fn before(nodes: &[f64], position: f64) -> (usize, f64) {
    let step = nodes[1] - nodes[0];
    let first = ((position - nodes[0]) / step).max(0.0) as usize;
    let first = first.min(nodes.len() - 2);
    (first, (position - nodes[first]) / step)
}

/// The kinematic correction (mm, rad) with the machine's own tool and unknown direction of travel.
pub fn correction(kinematics: &Kinematics<'_>, q: &PerAxis) -> Result<PerAxis, NotConverged> {
    let situation = Situation::default();
    Ok(kinematics
        .correction_within(q, &situation, &Switches::ALL, SAMPLED)?
        .dq)
}

/// The translation (mm, tool frame) of the volumetric error with a correction.
pub fn error(kinematics: &Kinematics<'_>, q: &PerAxis, dq: &PerAxis) -> [f64; 3] {
    kinematics
        .volumetric_error(q, dq, &Situation::default())
        .t
        .into()
}

/// Adds `part` times a correction to another.
pub fn add(sum: &mut PerAxis, part: f64, dq: &PerAxis) {
    for (sum, d) in sum.iter_mut().zip(dq) {
        *sum += part * d;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueaxis_model::errors::{ErrorModel, Parameter};
    use trueaxis_model::machine::Machine;

    fn kolibri() -> (Machine, ErrorModel) {
        let machine =
            Machine::from_toml(include_str!("../../../../../examples/kolibri/machine.toml"))
                .unwrap();
        let mut errors = ErrorModel::perfect(&machine);
        for (name, value) in [
            ("EXX2", 1e-6),
            ("EYY3", 1e-9),
            ("EZZ2", 2e-6),
            ("EB0Z", 1e-4),
        ] {
            assert!(errors.set(&machine, Parameter::parse(name).unwrap(), value));
        }
        (machine, errors)
    }

    #[test]
    fn nothing_is_left_at_the_nodes_and_something_between_them() {
        let (machine, errors) = kolibri();
        let kinematics = Kinematics::new(&machine, &errors);
        let axes = ['Z', 'X', 'Y'].map(|letter| machine.index(letter).unwrap());
        let zone = axes.map(|i| machine.axes[i].travel);
        let at = machine.to_kinematic(&[0.0, 30.0, 40.0, 0.0, 0.0]);
        let mesh = Mesh::new(&kinematics, axes, &at, &zone, [3, 4, 5]).unwrap();
        assert_eq!(mesh.corrections.len(), 60);
        let size = |left: [f64; 3]| left.map(f64::abs).into_iter().fold(0.0, f64::max);
        let mut between = 0.0_f64;
        for node in 0..60 {
            let place = [node / 20, node / 5 % 4, node % 5];
            let mut q = at;
            for k in 0..3 {
                q[axes[k]] = mesh.along[k][place[k]];
            }
            // Corrections are sampled to 1e-9 mm.
            assert!(size(mesh.left(&q)) < 1e-8, "{node}");
            q[axes[0]] += 10.0;
            between = between.max(size(mesh.left(&q)));
        }
        assert!(between > 1e-4, "{between}");
    }
}

//! The scheme `grid3d`: corrections at the nodes of a grid of three axes, usually the linear ones, for one position of the
//! others.
//!
//! Source document, Chapter 4. A node holds the kinematic correction at its position; between nodes the controller
//! interpolates linearly along each axis (Eqs. 13, 14). The grid is the smallest one, starting at 2×2×2, to which
//! one more node adds less than a threshold (Eqs. 10–12). Under the policy `position` the corrections are those of
//! the linear axes alone, as in the document; otherwise the nodes also hold corrections of the rotary axes.

mod mesh;
mod size;

use super::blank::blank;
use super::{Options, SchemeError, SchemeResult};
use mesh::Mesh;
use size::Sizing;
use std::ops::RangeInclusive;
use trueaxis::{Draft, DraftGrid, GridAxis};
use trueaxis_model::errors::{ErrorModel, Motion};
use trueaxis_model::kinematics::{Kinematics, Policy};
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_model::validate::calibrated;

/// How the remaining error is reduced to one number for each direction (Eq. 12).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Rms {
    /// The root of the mean square.
    Usual,
    /// As printed in Eq. 12.
    ///
    /// The root of the sum of squares divided by the number of positions, which is 1/√2000 of the usual value.
    Printed,
}

/// Options of this scheme.
#[derive(Clone, Debug, PartialEq)]
pub struct Wanted {
    /// The grid is large enough if one more node changes the remaining error by less than this (mm).
    pub threshold: f64,
    /// How that error is computed.
    pub rms: Rms,
    /// Seed of the random commands at which it is computed.
    pub seed: u64,
    /// Choose the number of nodes for each axis, instead of the same number for all.
    pub per_axis: bool,
    /// Largest number of nodes along an axis.
    pub most: usize,
    /// Cover only the calibrated range of each axis, not its travel: the zone of the document (Fig. 4.8).
    pub calibrated: bool,
    /// The axes of the grid (by index), linear or rotary; the linear ones if `None`.
    pub inputs: Option<[usize; 3]>,
    /// Position of the other axes (mm, deg, one value per axis; those of the grid's are ignored). By default they are at
    /// 0, or at the nearest end of their travel.
    pub rotary: Option<Vec<f64>>,
}

impl Default for Wanted {
    fn default() -> Self {
        Self {
            threshold: 1e-4,
            rms: Rms::Usual,
            seed: 12,
            per_axis: false,
            most: 25,
            calibrated: false,
            inputs: None,
            rotary: None,
        }
    }
}

impl Wanted {
    /// The index of each axis that is not one of the grid's, and its position (mm, deg).
    #[must_use]
    pub fn held(&self, machine: &Machine) -> Vec<(usize, f64)> {
        let is_held = |i: usize| match self.inputs {
            Some(inputs) => !inputs.contains(&i),
            None => machine.axes[i].letter.is_rotary(),
        };
        let others = machine.axes.iter().enumerate();
        let others = others.filter(|(i, _)| is_held(*i));
        let position = |i: usize, [low, high]: [f64; 2]| match &self.rotary {
            Some(position) => position.get(i).copied().unwrap_or_default(),
            None => 0.0_f64.max(low).min(high),
        };
        others
            .map(|(i, axis)| (i, position(i, axis.travel)))
            .collect()
    }
}

/// Finds the grid for a machine and its errors.
///
/// # Errors
/// [`SchemeError`]: the machine does not have three linear axes, no grid meets the threshold, or the kinematic
/// correction fails.
pub fn compile(
    machine: &Machine,
    errors: &ErrorModel,
    wanted: &Wanted,
    options: &Options,
) -> Result<SchemeResult, SchemeError> {
    let axes = inputs(machine, wanted)?;
    let kinematics = Kinematics::new(machine, errors).with_policy(options.policy);
    let zero = options.zero(machine, errors)?;
    let zone = axes.map(|i| zone(machine, errors, i, wanted.calibrated));
    let sizing = Sizing::new(&kinematics, axes, held_at(machine, wanted), zone, wanted)?;
    let mesh = sizing.smallest()?;
    let sizes = mesh.sizes();
    let [x, y, z] = sizes;
    let names = axes.map(|i| machine.axes[i].letter);
    let mut notes = vec![format!(
        "nodes: {x} of {}, {y} of {}, {z} of {}{}",
        names[0],
        names[1],
        names[2],
        place(machine, &wanted.held(machine))
    )];
    let is_short = |(i, zone): (usize, [f64; 2])| zone != machine.axes[i].travel;
    if axes.into_iter().zip(zone).any(is_short) {
        notes.push(
            "the grid ends with the calibrated range: beyond it the correction keeps its end value, which is wrong kinematics"
                .to_owned(),
        );
    }
    notes.extend(super::without_direction(machine, errors));
    Ok(SchemeResult {
        draft: Draft {
            grids: vec![grid(machine, &mesh, &zero, options)],
            ..blank(&kinematics)
        },
        structure_error: None,
        meets: None,
        is_full: false,
        notes,
    })
}

/// Remaining error (mm) of grids at the random commands by which their size is chosen: the norm of the root mean
/// squares along x, y and z, for each number of nodes along every axis (Fig. 4.5).
///
/// # Errors
/// [`SchemeError`]: the machine does not have three linear axes, or the kinematic correction fails.
pub fn left_by_size(
    machine: &Machine,
    errors: &ErrorModel,
    wanted: &Wanted,
    policy: Policy,
    sizes: RangeInclusive<usize>,
) -> Result<Vec<(usize, f64)>, SchemeError> {
    let axes = inputs(machine, wanted)?;
    let kinematics = Kinematics::new(machine, errors).with_policy(policy);
    let zone = axes.map(|i| zone(machine, errors, i, wanted.calibrated));
    let sizing = Sizing::new(&kinematics, axes, held_at(machine, wanted), zone, wanted)?;
    let of = |nodes: usize| Ok((nodes, sizing.left_by(nodes)?));
    sizes.map(of).collect()
}

/// The indices of the grid's axes.
fn inputs(machine: &Machine, wanted: &Wanted) -> Result<[usize; 3], SchemeError> {
    if let Some(inputs) = wanted.inputs {
        return Ok(inputs);
    }
    let axes = 0..machine.axes.len();
    let linear: Vec<usize> = axes
        .filter(|i| !machine.axes[*i].letter.is_rotary())
        .collect();
    let count = linear.len();
    <[usize; 3]>::try_from(linear).map_err(|_| SchemeError::Axes {
        scheme: "grid3d".to_owned(),
        needs: "three linear axes",
        linear: count,
        rotary: machine.axes.len() - count,
    })
}

/// Position of the other axes (mm, rad).
fn held_at(machine: &Machine, wanted: &Wanted) -> PerAxis {
    let mut at = PerAxis::default();
    for (axis, position) in wanted.held(machine) {
        at[axis] = machine.axes[axis].to_kinematic(position);
    }
    at
}

/// Range of the nodes of an axis (mm, deg): its travel, or the part where its motions do not hold their end values.
fn zone(machine: &Machine, errors: &ErrorModel, axis: usize, is_calibrated: bool) -> [f64; 2] {
    let [low, high] = machine.axes[axis].travel;
    let [from, to] = calibrated(machine, errors, axis);
    match is_calibrated && errors.motions[axis].iter().any(Motion::holds) {
        true => [low.max(from), high.min(to)],
        false => [low, high],
    }
}

fn place(machine: &Machine, held: &[(usize, f64)]) -> String {
    let places = held.iter();
    let places: Vec<String> = places
        .map(|(i, position)| format!("{} = {position}", machine.axes[*i].letter))
        .collect();
    match places.is_empty() {
        true => String::new(),
        false => format!(", for {} alone", places.join(", ")),
    }
}

/// The nodes as stored in the blob. Outputs that are 0 at all nodes are left out.
fn grid(machine: &Machine, mesh: &Mesh<'_>, zero: &PerAxis, options: &Options) -> DraftGrid {
    let values: Vec<PerAxis> = (mesh.corrections.iter())
        .map(|dq| machine.to_command(&std::array::from_fn(|i| dq[i] - zero[i])))
        .collect();
    let is_used = |i: &usize| values.iter().any(|v| v[*i] != 0.0);
    let mut outputs: Vec<usize> = (0..machine.axes.len()).filter(is_used).collect();
    if outputs.is_empty() {
        outputs.push(mesh.axes[0]);
    }
    let axes = mesh.axes.iter().zip(&mesh.along).map(|(index, nodes)| {
        let axis = &machine.axes[*index];
        let [first, second] = [nodes[0], nodes[1]].map(|q| axis.to_command(q));
        GridAxis {
            input: *index as u8,
            start: first as f32,
            step: (second - first) as f32,
            // The last node of a turn is the first of the next.
            points: (nodes.len() - usize::from(axis.modulo)) as u32,
            modulo: axis.modulo,
        }
    });
    let nodes = values.iter().zip(mesh.places()).filter(|(_, place)| {
        (0..3).all(|k| !machine.axes[mesh.axes[k]].modulo || place[k] + 1 < mesh.along[k].len())
    });
    let nodes = nodes.map(|(node, _)| node);
    DraftGrid {
        axes: axes.collect(),
        format: options.format,
        values: nodes
            .flat_map(|node| outputs.iter().map(|i| node[*i] as f32))
            .collect(),
        outputs: outputs.into_iter().map(|i| i as u8).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueaxis_model::errors::Parameter;
    use trueaxis_model::validate::{Command, Runtime};

    /// X, Y and C of a machine whose C is a table, with Z and A at a position.
    fn over_c(text: &str, rotary: Vec<f64>) {
        let machine = Machine::from_toml(text).unwrap();
        let mut errors = ErrorModel::perfect(&machine);
        for (name, value) in [
            ("EXCc1", 0.02),
            ("EA0C", 2e-4),
            ("EC0X", 1e-4),
            ("EZZ1", 5e-5),
        ] {
            assert!(errors.set(&machine, Parameter::parse(name).unwrap(), value));
        }
        let inputs = ['X', 'Y', 'C'].map(|letter| machine.index(letter).unwrap());
        let wanted = Wanted {
            inputs: Some(inputs),
            rotary: Some(rotary.clone()),
            threshold: 1e-5,
            most: 60,
            ..Wanted::default()
        };
        let options = Options {
            policy: Policy::Position,
            ..Options::default()
        };
        let found = compile(&machine, &errors, &wanted, &options).unwrap();
        let held: Vec<usize> = wanted.held(&machine).into_iter().map(|(i, _)| i).collect();
        assert_eq!(held.len(), 2);
        assert!(held.iter().all(|i| !inputs.contains(i)));
        let blob = found.draft.encode().unwrap();
        let runtime = Runtime::load(&blob).unwrap();
        let kinematics = Kinematics::new(&machine, &errors).with_policy(Policy::Position);
        let mut worst = 0.0_f64;
        for k in 0..100 {
            let mut position = rotary.clone();
            for (n, i) in inputs.into_iter().enumerate() {
                let [low, high] = machine.axes[i].travel;
                let part = (0.618_033_988_749_895 * (5 * k + n) as f64).fract();
                position[i] = low + (high - low) * part;
            }
            let command = Command::at(&machine, &position);
            let (q, _) = command.kinematic(&machine);
            let right = machine.to_command(&mesh::correction(&kinematics, &q).unwrap());
            let given = runtime.evaluate(&command);
            for i in 0..machine.axes.len() {
                worst = worst.max((f64::from(given[i]) - right[i]).abs());
            }
        }
        // A cosine of 0.02 mm between 16 or more nodes of a turn: 0.02·(2π/16)²/8.
        assert!(worst < 4e-4, "{worst}");
    }

    #[test]
    fn a_grid_over_a_rotary_axis_gives_the_corrections_there() {
        // Y, A, C, X, Z.
        over_c(
            include_str!("../../../../examples/kolibri/machine.toml"),
            vec![0.0, 20.0, 0.0, 0.0, 150.0],
        );
    }

    #[test]
    fn an_endless_axis_has_its_last_node_at_the_first_of_the_next_turn() {
        let text = include_str!("../../../../examples/linuxcnc-xyzac-trt/machine-endless.toml");
        let machine = Machine::from_toml(text).unwrap();
        let middle = |i: usize| match machine.axes[i].letter.is_rotary() {
            true => 0.0,
            false => 0.5 * (machine.axes[i].travel[0] + machine.axes[i].travel[1]),
        };
        over_c(text, (0..machine.axes.len()).map(middle).collect());
    }
}

//! The scheme `grid3d`: corrections at the nodes of a grid of the linear axes, for one position of the rotary axes.
//!
//! Source document, Chapter 4. A node holds the kinematic correction at its position; between nodes the controller
//! interpolates linearly along each axis (Eqs. 13, 14). The grid is the smallest one, starting at 2×2×2, to which
//! one more node adds less than a threshold (Eqs. 10–12). Under the policy `position` the corrections are those of
//! the linear axes alone, as in the document; otherwise the nodes also hold corrections of the rotary axes.

mod mesh;
mod size;

use super::blank::blank;
use super::{Options, SchemeError, SchemeResult};
use crate::validate::calibrated;
use mesh::Mesh;
use size::Sizing;
use std::ops::RangeInclusive;
use trueaxis::{Draft, DraftGrid, GridAxis};
use trueaxis_model::errors::{ErrorModel, Motion};
use trueaxis_model::kinematics::{Kinematics, Policy};
use trueaxis_model::machine::{Machine, PerAxis};

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
    /// Position of the rotary axes (mm, deg, one value per axis; those of linear axes are ignored). By default they
    /// are at 0, or at the nearest end of their travel.
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
            rotary: None,
        }
    }
}

impl Wanted {
    /// The index of each rotary axis, and its position (deg).
    #[must_use]
    pub fn held(&self, machine: &Machine) -> Vec<(usize, f64)> {
        let rotary = machine.axes.iter().enumerate();
        let rotary = rotary.filter(|(_, axis)| axis.letter.is_rotary());
        let position = |i: usize, [low, high]: [f64; 2]| match &self.rotary {
            Some(position) => position.get(i).copied().unwrap_or_default(),
            None => 0.0_f64.max(low).min(high),
        };
        rotary
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
    let linear = three_linear(machine)?;
    let kinematics = Kinematics::new(machine, errors).with_policy(options.policy);
    let zero = options.zero(machine, errors)?;
    let zone = linear.map(|i| zone(machine, errors, i, wanted.calibrated));
    let sizing = Sizing::new(&kinematics, linear, held_at(machine, wanted), zone, wanted)?;
    let mesh = sizing.smallest()?;
    let sizes = mesh.sizes();
    let [x, y, z] = sizes;
    let names = linear.map(|i| machine.axes[i].letter);
    let mut notes = vec![format!(
        "nodes: {x} of {}, {y} of {}, {z} of {}{}",
        names[0],
        names[1],
        names[2],
        place(machine, &wanted.held(machine))
    )];
    let is_short = |(i, zone): (usize, [f64; 2])| zone != machine.axes[i].travel;
    if linear.into_iter().zip(zone).any(is_short) {
        notes.push(
            "the grid ends with the calibrated range: beyond it the correction of its end holds, which is wrong kinematics"
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
    let linear = three_linear(machine)?;
    let kinematics = Kinematics::new(machine, errors).with_policy(policy);
    let zone = linear.map(|i| zone(machine, errors, i, wanted.calibrated));
    let sizing = Sizing::new(&kinematics, linear, held_at(machine, wanted), zone, wanted)?;
    let of = |nodes: usize| Ok((nodes, sizing.left_by(nodes)?));
    sizes.map(of).collect()
}

/// The indices of the three linear axes.
fn three_linear(machine: &Machine) -> Result<[usize; 3], SchemeError> {
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

/// Position of the rotary axes (rad).
fn held_at(machine: &Machine, wanted: &Wanted) -> PerAxis {
    let mut at = PerAxis::default();
    for (axis, position) in wanted.held(machine) {
        at[axis] = machine.axes[axis].to_kinematic(position);
    }
    at
}

/// Range of the nodes of an axis (mm): its travel, or the part where its motions do not hold their end values.
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
    let axes = mesh.axes.iter().zip(&mesh.along);
    let axes = axes.map(|(axis, nodes)| GridAxis {
        input: *axis as u8,
        start: nodes[0] as f32,
        step: (nodes[1] - nodes[0]) as f32,
        points: nodes.len() as u32,
        modulo: false,
    });
    let nodes = values.iter();
    DraftGrid {
        axes: axes.collect(),
        format: options.format,
        values: nodes
            .flat_map(|node| outputs.iter().map(|i| node[*i] as f32))
            .collect(),
        outputs: outputs.into_iter().map(|i| i as u8).collect(),
    }
}

//! A compensation without tables, the starting point of every scheme.

use trueaxis::{Auxiliary, AuxiliaryKind, Axis, Draft, Notes, Sensor, Zone};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::numbers::ascending;
use trueaxis_model::policy::stored;

/// A draft with the machine, its inputs and the policy that corrects nothing.
pub fn blank(kinematics: &Kinematics<'_>) -> Draft {
    let (machine, errors) = (kinematics.machine, kinematics.errors);
    let length = machine.length_range.map(|_| {
        auxiliary(
            AuxiliaryKind::ToolLength,
            "tool length",
            machine.tool_length(),
            Sensor::USUAL,
        )
    });
    let sensors = errors.sensors.iter().map(|thermal| {
        auxiliary(
            AuxiliaryKind::Temperature,
            &thermal.sensor,
            thermal.reference_celsius,
            thermal.following(),
        )
    });
    Draft {
        machine: machine.name.clone(),
        policy: stored(kinematics.policy),
        axes: machine
            .axes
            .iter()
            .map(|axis| Axis {
                name: axis.letter.char() as u8,
                travel: if axis.modulo {
                    [-f32::MAX, f32::MAX]
                } else {
                    axis.travel.map(|t| t as f32)
                },
                period: if axis.modulo { 360.0 } else { 0.0 },
                // Bounds are set later, from the output of the tables.
                value_bound: 1.0,
                rate_bound: 1.0,
                reversal_threshold: axis.reversal_threshold as f32,
                ramp_rate: 1.0,
                reversal_rate: 1.0,
                reversal_acceleration: 20.0,
            })
            .collect(),
        auxiliaries: length.into_iter().chain(sensors).collect(),
        banks: Vec::new(),
        terms: Vec::new(),
        grids: Vec::new(),
        notes: notes(kinematics),
    }
}

/// Where and how well the errors are known.
fn notes(kinematics: &Kinematics<'_>) -> Notes {
    let (machine, errors) = (kinematics.machine, kinematics.errors);
    let axes = machine.axes.iter().zip(&errors.calibrated);
    let zone = (0..).zip(axes).filter_map(|(number, (axis, range))| {
        let mut range = range.map(|q| axis.to_command(q));
        ascending(&mut range);
        // Degrees come back from radians with rounding.
        let ends = range.iter().zip(axis.travel);
        let is_part = ends.map(|(a, b)| (a - b).abs()).any(|off| off > 1e-6);
        is_part.then(|| Zone {
            axis: number,
            range: range.map(|q| q as f32),
        })
    });
    Notes {
        zone: zone.collect(),
        misfit_um: errors.misfit.map(|mm| (mm * 1e3) as f32),
        unseen: errors.unseen.keys().map(ToString::to_string).collect(),
    }
}

fn auxiliary(kind: AuxiliaryKind, name: &str, reference: f64, sensor: Sensor) -> Auxiliary {
    let mut short = trueaxis::Name::new();
    for c in name.chars() {
        // Sensor names are validated when the file is read; 16 bytes always fit.
        if short.push(c).is_err() {
            break;
        }
    }
    Auxiliary {
        kind,
        name: short,
        reference: reference as f32,
        sensor,
    }
}

//! A compensation without tables, the starting point of every scheme.

use crate::policy::stored;
use trueaxis::{Auxiliary, AuxiliaryKind, Axis, Draft};
use trueaxis_model::kinematics::Kinematics;

/// A draft with the machine, its inputs and the policy that corrects nothing.
pub fn blank(kinematics: &Kinematics<'_>) -> Draft {
    let (machine, errors) = (kinematics.machine, kinematics.errors);
    let length = machine.length_range.map(|_| {
        auxiliary(
            AuxiliaryKind::ToolLength,
            "tool length",
            machine.tool_length(),
            0.0,
        )
    });
    let sensors = errors.sensors.iter().map(|thermal| {
        auxiliary(
            AuxiliaryKind::Temperature,
            &thermal.sensor,
            thermal.reference_celsius,
            thermal.lag_rate(),
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
                hysteresis: axis.hysteresis as f32,
                ramp_rate: 1.0,
            })
            .collect(),
        auxiliaries: length.into_iter().chain(sensors).collect(),
        banks: Vec::new(),
        terms: Vec::new(),
        grids: Vec::new(),
    }
}

fn auxiliary(kind: AuxiliaryKind, name: &str, reference: f64, lag_rate: f32) -> Auxiliary {
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
        lag_rate,
    }
}

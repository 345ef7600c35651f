//! Compensations small enough to be sent repeatedly.

use trueaxis::{
    AlignedBlob, Auxiliary, AuxiliaryKind, Axis, Direction, Draft, DraftBank, Interpolation,
    SampleFormat, Term,
};

/// The rate bound of every axis (mm/s).
pub const RATE: f32 = 10.0;

/// ΔY = weight · tool length, with a weight from -1 to 1.
pub fn adjustable() -> AlignedBlob {
    let axis = |name| Axis {
        name,
        travel: [-1000.0, 1000.0],
        period: 0.0,
        value_bound: 0.5,
        rate_bound: RATE,
        reversal_threshold: 0.01,
        ramp_rate: 2.0,
        reversal_rate: RATE,
        reversal_acceleration: 40.0,
    };
    let bank = |input| DraftBank {
        input,
        start: 0.0,
        step: 200.0,
        modulo: false,
        direction: Direction::Both,
        interpolation: Interpolation::Linear,
        format: SampleFormat::F32,
        columns: vec![vec![0.0, 0.1]],
    };
    let term = |output, limits, factor| Term {
        output,
        weight: 0.5,
        limits,
        factors: [factor].into_iter().collect(),
    };
    let draft = Draft {
        machine: "m".into(),
        axes: vec![axis(b'X'), axis(b'Y')],
        auxiliaries: vec![Auxiliary {
            kind: AuxiliaryKind::ToolLength,
            name: "tool".try_into().unwrap(),
            reference: 100.0,
            sensor: trueaxis::Sensor::USUAL,
        }],
        banks: vec![bank(0), bank(2)],
        terms: vec![term(0, None, 0), term(1, Some([-1.0, 1.0]), 1)],
        ..Draft::default()
    };
    draft.encode().unwrap()
}

/// Axes X and Y; ΔX = scale · f(Y), with `points` samples of pseudo-random f.
pub fn blob(machine: &str, axes: &[u8], scale: f32, points: u16) -> AlignedBlob {
    let axis = |&name: &u8| Axis {
        name,
        travel: [-1000.0, 1000.0],
        period: 0.0,
        value_bound: 0.5,
        rate_bound: RATE,
        reversal_threshold: 0.01,
        ramp_rate: 2.0,
        reversal_rate: RATE,
        reversal_acceleration: 40.0,
    };
    let wave = |k: u16| (f32::from(k.wrapping_mul(31) % 97) - 48.0) / 48.0;
    let bank = |direction, column| DraftBank {
        input: 1,
        start: -100.0,
        step: 200.0 / (f32::from(points) - 1.0),
        modulo: false,
        direction,
        interpolation: Interpolation::Linear,
        format: SampleFormat::F32,
        columns: vec![column],
    };
    let term = |output, weight, factors: &[u8]| Term {
        output,
        weight,
        limits: None,
        factors: factors.try_into().unwrap(),
    };
    let draft = Draft {
        machine: machine.into(),
        axes: axes.iter().map(axis).collect(),
        banks: vec![
            bank(Direction::Both, (0..points).map(wave).collect()),
            bank(Direction::Signed, vec![0.01; points.into()]),
        ],
        terms: vec![term(0, scale, &[0]), term(1, 0.5, &[1])],
        ..Draft::default()
    };
    draft.encode().unwrap()
}

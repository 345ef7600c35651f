//! Small compensations used as a starting point by the tests of several files.

use alloc::string::ToString;
use alloc::vec;
use alloc::vec::Vec;

use crate::*;

/// An axis with bounds that no test reaches by accident.
pub fn axis(name: u8) -> Axis {
    Axis {
        name,
        travel: [-1000.0, 1000.0],
        period: 0.0,
        value_bound: 1.0,
        rate_bound: 10.0,
        reversal_threshold: 0.01,
        ramp_rate: 0.5,
        reversal_rate: 10.0,
        reversal_acceleration: 10.0,
    }
}

/// Sets the bounds of an axis; a reversal is made up with the acceleration of a ramp, and at the rate bound.
pub fn limit(axis: &mut Axis, value: f32, rate: f32, ramp: f32) {
    axis.value_bound = value;
    (axis.rate_bound, axis.ramp_rate) = (rate, ramp);
    (axis.reversal_rate, axis.reversal_acceleration) = (rate, ramp / RISE);
}

/// A linear bank over both directions, f32.
pub fn bank(input: u8, start: f32, step: f32, columns: Vec<Vec<f32>>) -> DraftBank {
    DraftBank {
        input,
        start,
        step,
        modulo: false,
        direction: Direction::Both,
        interpolation: Interpolation::Linear,
        format: SampleFormat::F32,
        columns,
    }
}

pub fn term(output: u8, weight: f32, factors: &[u8]) -> Term {
    Term {
        output,
        weight,
        limits: None,
        factors: heapless::Vec::from_slice(factors).unwrap(),
    }
}

pub fn adjustable(output: u8, weight: f32, limits: [f32; 2], factors: &[u8]) -> Term {
    Term {
        limits: Some(limits),
        ..term(output, weight, factors)
    }
}

/// Only axes X, Y, C.
pub fn bare() -> Draft {
    Draft {
        machine: "specimen".to_string(),
        axes: vec![axis(b'X'), axis(b'Y'), axis(b'C')],
        ..Draft::default()
    }
}

/// One of everything: both formats, both interpolations, all directions, modulo, an auxiliary, an
/// adjustable term, a constant, and grids of three and of one input.
pub fn everything() -> Draft {
    let mut draft = bare();
    draft.axes[2].travel = [-f32::MAX, f32::MAX];
    draft.axes[2].period = 360.0;
    draft.auxiliaries.push(Auxiliary {
        kind: AuxiliaryKind::ToolLength,
        name: "tool".try_into().unwrap(),
        reference: 130.0,
        sensor: Sensor::USUAL,
    });
    draft.banks = vec![
        bank(0, -100.0, 200.0, vec![vec![-100.0, 100.0]]),
        bank(
            1,
            -50.0,
            25.0,
            vec![vec![0.0, 0.5, 0.25, 0.0, -0.5], vec![0.1; 5]],
        ),
        DraftBank {
            modulo: true,
            interpolation: Interpolation::Cubic,
            ..bank(2, 0.0, 90.0, vec![vec![0.0, 0.01, 0.0, -0.01]])
        },
        DraftBank {
            direction: Direction::Positive,
            format: SampleFormat::I16,
            ..bank(0, -100.0, 100.0, vec![vec![0.001, 0.002, 0.003]])
        },
        DraftBank {
            direction: Direction::Negative,
            format: SampleFormat::I16,
            interpolation: Interpolation::Cubic,
            ..bank(0, -100.0, 200.0, vec![vec![-0.001, -0.002, -0.004, -0.003]])
        },
        bank(3, 50.0, 200.0, vec![vec![-80.0, 120.0]]),
    ];
    draft.terms = vec![
        term(0, 1.0, &[1]),
        term(0, 1.0, &[0, 3]),
        term(0, 2.0, &[4]),
        term(0, 2.0, &[5]),
        term(1, 0.25, &[]),
        term(1, 1e-5, &[0, 1, 2]),
        term(1, 1e-3, &[2, 3, 3, 6]),
        adjustable(2, 0.5, [-1.0, 1.0], &[3]),
        adjustable(2, 0.25, [0.0, 0.5], &[3, 3]),
        term(2, 0.125, &[3]),
    ];
    let line = |input, start, step, points| GridAxis {
        input,
        start,
        step,
        points,
        modulo: false,
    };
    draft.grids = vec![
        DraftGrid {
            axes: vec![
                line(0, -100.0, 200.0, 2),
                line(1, -50.0, 50.0, 3),
                GridAxis {
                    modulo: true,
                    ..line(2, 0.0, 180.0, 2)
                },
            ],
            outputs: vec![0, 1, 2],
            format: SampleFormat::F32,
            values: (0_u8..36).map(|i| f32::from(i) * 0.001).collect(),
        },
        DraftGrid {
            axes: vec![line(3, 50.0, 100.0, 3)],
            outputs: vec![1],
            format: SampleFormat::I16,
            values: vec![0.0, 0.01, 0.03],
        },
    ];
    draft
}

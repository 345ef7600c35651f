//! Contents of the golden blobs of format version 1, and hashes of their corrections.

use crate::{Fixed, moves};
use trueaxis::{
    Auxiliary, AuxiliaryKind, Axis, Direction, Draft, DraftBank, DraftGrid, GridAxis,
    Interpolation, Largest, Notes, Policy, SampleFormat, Term, Zone,
};

/// An axis whose limits hardly act.
#[must_use]
pub fn plain_axis(name: u8, travel: [f32; 2]) -> Axis {
    Axis {
        name,
        travel,
        period: 0.0,
        value_bound: 1.0,
        rate_bound: 100.0,
        reversal_threshold: 0.001,
        ramp_rate: 1.0,
        reversal_rate: 100.0,
        reversal_acceleration: 20.0,
    }
}

/// A bank of linear tables over `range`.
#[must_use]
pub fn plain_bank(input: u8, [start, end]: [f32; 2], columns: Vec<Vec<f32>>) -> DraftBank {
    let points = columns.first().map_or(2, Vec::len);
    let step = (end - start) / (points - 1) as f32;
    DraftBank {
        columns,
        ..bank(input, start, step, &[])
    }
}

/// The product of some tables.
#[must_use]
pub fn product(output: u8, factors: &[u8]) -> Term {
    term(output, 1.0, None, factors)
}

/// `count` random numbers within ± `size`.
pub fn random_values(random: &mut Fixed, count: usize, size: f64) -> Vec<f32> {
    let one = |_| random.within(-size, size) as f32;
    (0..count).map(one).collect()
}

/// 25 × 25 × 25 nodes over X Y Z, three outputs.
#[must_use]
pub fn cube() -> Draft {
    const NODES: u32 = 25;
    const STEP: f32 = 20.0;
    let travel = [0.0, (NODES - 1) as f32 * STEP];
    Draft {
        machine: "cube".to_owned(),
        axes: b"XYZ".map(|name| plain_axis(name, travel)).into(),
        grids: vec![DraftGrid {
            axes: (0..3)
                .map(|input| grid_axis(input, travel[0], STEP, NODES, false))
                .collect(),
            outputs: vec![0, 1, 2],
            format: SampleFormat::F32,
            values: random_values(&mut Fixed::new(2), 3 * NODES.pow(3) as usize, 0.05),
        }],
        ..Draft::default()
    }
}

fn axis(name: u8, travel: f32) -> Axis {
    Axis {
        value_bound: 0.75,
        rate_bound: 20.0,
        reversal_threshold: 0.0078125,
        ramp_rate: 2.5,
        reversal_rate: 20.0,
        reversal_acceleration: 50.0,
        ..plain_axis(name, [-travel, travel])
    }
}

fn bank(input: u8, start: f32, step: f32, columns: &[&[f32]]) -> DraftBank {
    DraftBank {
        input,
        start,
        step,
        modulo: false,
        direction: Direction::Both,
        interpolation: Interpolation::Linear,
        format: SampleFormat::F32,
        columns: columns.iter().map(|c| c.to_vec()).collect(),
    }
}

fn term(output: u8, weight: f32, limits: Option<[f32; 2]>, factors: &[u8]) -> Term {
    Term {
        output,
        weight,
        limits,
        factors: factors.iter().copied().collect(),
    }
}

fn grid_axis(input: u8, start: f32, step: f32, points: u32, modulo: bool) -> GridAxis {
    GridAxis {
        input,
        start,
        step,
        points,
        modulo,
    }
}

/// Every feature of format version 1: the golden blob `everything.trax`.
#[must_use]
pub fn everything() -> Draft {
    let directional = |direction, format, columns: &[&[f32]]| DraftBank {
        direction,
        format,
        ..bank(0, -400.0, 400.0, columns)
    };
    Draft {
        machine: "Everything".to_owned(),
        policy: Policy::Orientation,
        axes: vec![
            axis(b'X', 400.0),
            axis(b'Y', 250.0),
            axis(b'Z', 300.0),
            Axis {
                period: 360.0,
                ..axis(b'C', f32::MAX)
            },
        ],
        auxiliaries: vec![
            Auxiliary {
                kind: AuxiliaryKind::ToolLength,
                name: "tool length".try_into().unwrap_or_default(),
                reference: 130.0,
                sensor: trueaxis::Sensor::USUAL,
            },
            Auxiliary {
                kind: AuxiliaryKind::Temperature,
                name: "bed".try_into().unwrap_or_default(),
                reference: 20.0,
                sensor: trueaxis::Sensor::USUAL,
            },
        ],
        banks: vec![
            bank(0, -400.0, 800.0, &[&[-400.0, 400.0]]),
            bank(
                1,
                -250.0,
                100.0,
                &[
                    &[0.01, -0.02, 0.005, 0.0, 0.03, -0.01],
                    &[1.0, 0.9, 0.7, 0.4, 0.1, -0.3],
                ],
            ),
            DraftBank {
                modulo: true,
                interpolation: Interpolation::Cubic,
                ..bank(
                    3,
                    -180.0,
                    45.0,
                    &[&[0.0, 0.02, 0.03, 0.02, 0.0, -0.02, -0.03, -0.02]],
                )
            },
            DraftBank {
                interpolation: Interpolation::Cubic,
                format: SampleFormat::I16,
                ..bank(
                    2,
                    -300.0,
                    300.0,
                    &[
                        &[0.02, 0.01, 0.0, -0.015, -0.04],
                        &[1.0, 0.5, 0.0, -0.5, -1.0],
                    ],
                )
            },
            directional(
                Direction::Positive,
                SampleFormat::F32,
                &[&[0.004, 0.005, 0.006]],
            ),
            directional(
                Direction::Negative,
                SampleFormat::I16,
                &[&[-0.004, -0.005, -0.006]],
            ),
            bank(4, 50.0, 200.0, &[&[-80.0, 120.0]]),
            bank(5, -20.0, 40.0, &[&[-20.0, 20.0]]),
            DraftBank {
                direction: Direction::Signed,
                ..bank(1, -250.0, 250.0, &[&[0.003, 0.002, 0.0025]])
            },
        ],
        terms: vec![
            term(0, 1.0, None, &[1]),
            term(0, 2.5e-4, None, &[0, 2]),
            term(0, 1.0, None, &[6]),
            term(0, 1.0, None, &[7]),
            term(1, 0.0125, None, &[]),
            term(1, 1.0, Some([-2.0, 2.0]), &[3]),
            term(1, 1e-3, None, &[3, 8]),
            term(2, 1.0, None, &[4]),
            term(2, 0.02, None, &[2, 5, 5, 5, 2, 2]),
            term(2, 3e-6, Some([0.0, 1e-4]), &[0, 9]),
            term(3, 0.5, None, &[3]),
            term(1, 1.0, None, &[10]),
        ],
        grids: vec![
            DraftGrid {
                axes: vec![
                    grid_axis(0, -400.0, 400.0, 3, false),
                    grid_axis(1, -250.0, 500.0, 2, false),
                    grid_axis(3, 0.0, 90.0, 4, true),
                ],
                outputs: vec![0, 1, 2],
                format: SampleFormat::F32,
                values: (0..72_i16)
                    .map(|i| f32::from((i * 29) % 41 - 20) * 0.0005)
                    .collect(),
            },
            DraftGrid {
                axes: vec![
                    grid_axis(2, -300.0, 200.0, 4, false),
                    grid_axis(5, -20.0, 40.0, 2, false),
                ],
                outputs: vec![3, 1],
                format: SampleFormat::I16,
                values: (0..16_i16)
                    .map(|i| f32::from((i * 7) % 9 - 4) * 0.001)
                    .collect(),
            },
        ],
        notes: Notes {
            zone: vec![Zone {
                axis: 3,
                range: [-55.0, 55.0],
            }],
            misfit_um: Some(1.5),
            unseen: vec!["EX0C".to_owned()],
        },
    }
}

/// A draft with a lag of the temperature, which later programs of version 1 write: the golden blob `lag.trax`.
#[must_use]
pub fn lag() -> Draft {
    let mut draft = everything();
    draft.auxiliaries[1].sensor.lag_rate = 0.015_625;
    draft
}

/// FNV-1a over the bits of every number.
struct Hash(u64);

impl Hash {
    fn new() -> Self {
        Self(0xCBF2_9CE4_8422_2325)
    }

    fn take(&mut self, numbers: &[f32]) {
        for byte in numbers.iter().flat_map(|n| n.to_bits().to_le_bytes()) {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01B3);
        }
    }
}

/// The bits of the corrections at 100 000 fixed positions with fixed directions of travel.
#[must_use]
pub fn hash_of_evaluation(c: &Largest<'_>) -> u64 {
    let mut hash = Hash::new();
    moves::evaluations(c, 100_000, |dq| hash.take(dq));
    hash.0
}

/// The bits of the corrections of a servo through 20 000 periods of fixed moves and events.
///
/// # Panics
/// If an adjustable term does not permit the weight 0.
#[must_use]
pub fn hash_of_servo(c: &Largest<'_>) -> u64 {
    let mut hash = Hash::new();
    let axes = c.axes().len();
    let other = Box::new(c.clone());
    moves::periods([c, &other], 200, |correction| {
        hash.take(&correction.dq[..axes]);
        hash.take(&correction.computed[..axes]);
    })
    .expect("the same axes, and weights within their limits");
    hash.0
}

/// A golden blob of version 1, with any alignment.
///
/// # Panics
/// If there is no such blob.
#[must_use]
pub fn blob(name: &str) -> trueaxis::AlignedBlob {
    let path = format!("{}/golden/v1/{name}.trax", env!("CARGO_MANIFEST_DIR"));
    let bytes = std::fs::read(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    trueaxis::AlignedBlob::from_bytes(&bytes)
}

/// Loads a blob on the heap.
///
/// # Panics
/// If it is refused.
#[must_use]
pub fn load(blob: &[u8]) -> Box<Largest<'_>> {
    let mut c = Box::new(Largest::empty());
    c.load(blob).unwrap_or_else(|e| panic!("{e}"));
    c
}

//! What the golden blobs of format version 1 are made of and how their corrections are hashed.

use crate::Fixed;
use trueaxis::{
    Auxiliary, AuxiliaryKind, Axis, Direction, Draft, DraftBank, DraftGrid, GridAxis, Inputs,
    Interpolation, Largest, Policy, SampleFormat, Servo, Term, Travel, Travelling,
};

fn axis(name: u8, travel: f32) -> Axis {
    Axis {
        name,
        travel: [-travel, travel],
        period: 0.0,
        value_bound: 0.75,
        rate_bound: 20.0,
        hysteresis: 0.0078125,
        ramp_rate: 2.5,
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

/// One of everything that format version 1 has: the golden blob `everything.trax`.
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
            },
            Auxiliary {
                kind: AuxiliaryKind::Temperature,
                name: "bed".try_into().unwrap_or_default(),
                reference: 20.0,
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
    }
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

/// A little more than ± the travel (endless: 3 turns), with few enough bits to be exact.
fn beyond(random: &mut Fixed, travel: [f32; 2]) -> f32 {
    let half = if travel[1] > 1e6 {
        1080.0
    } else {
        travel[1] * 1.125
    };
    ((random.bits() >> 8) as f32 - 8_388_608.0) * (half / 8_388_608.0)
}

fn inputs(random: &mut Fixed, c: &Largest<'_>) -> Inputs<[f32; 16]> {
    let mut inputs = Inputs::at([0.0; 16]);
    for (q, axis) in inputs.axes.iter_mut().zip(c.axes()) {
        *q = beyond(random, axis.travel);
    }
    for auxiliary in &mut inputs.auxiliaries[..c.auxiliaries().len()] {
        *auxiliary = beyond(random, [-100.0, 100.0]);
    }
    inputs
}

/// The bits of the corrections at 100 000 fixed positions with fixed directions of travel.
#[must_use]
pub fn hash_of_evaluation(c: &Largest<'_>) -> u64 {
    let mut random = Fixed::new(1);
    let mut hash = Hash::new();
    for _ in 0..100_000 {
        let q = inputs(&mut random, c);
        let directions = random.bits();
        let travel = std::array::from_fn(|i| match directions >> (2 * i) & 3 {
            0 => Travel::Unknown,
            1 => Travel::Positive,
            _ => Travel::Negative,
        });
        hash.take(&c.evaluate(&q, &Travelling(travel), &c.weights())[..c.axes().len()]);
    }
    hash.0
}

/// The bits of the corrections of a servo through 20 000 periods of fixed moves and events.
///
/// # Panics
/// An adjustable term may not have the weight 0.
#[must_use]
pub fn hash_of_servo(c: &Largest<'_>) -> u64 {
    let mut random = Fixed::new(2);
    let mut hash = Hash::new();
    let other = Box::new(c.clone());
    let mut servo: Servo<&Largest<'_>> = Servo::new(c);
    let adjustable: Vec<usize> = c.weights().iter().map(|(term, _)| term).collect();
    servo.enable();
    let mut from = inputs(&mut random, c);
    let mut referenced = u16::MAX;
    for _ in 0..200 {
        let to = inputs(&mut random, c);
        match random.bits() % 8 {
            0 => servo.disable(),
            1 => referenced ^= 1,
            2 if !servo.is_swapping() => {
                let to = if std::ptr::eq(servo.compensation(), c) {
                    &other
                } else {
                    c
                };
                servo.swap(to).expect("the same axes");
            }
            3 => {
                for &term in &adjustable {
                    servo.set_weight(term, 0.0).expect("within its limits");
                }
            }
            4 => servo.dry_run(random.bits() & 1 == 0),
            _ => {
                servo.enable();
                referenced = u16::MAX;
            }
        }
        for step in 1..=100_u8 {
            let mut q = to;
            for ((q, to), from) in q.axes.iter_mut().zip(to.axes).zip(from.axes) {
                *q = from + (to - from) * (f32::from(step) * 0.0078125);
            }
            let correction = servo.update(&q, referenced, 0.001);
            hash.take(&correction.dq[..c.axes().len()]);
            hash.take(&correction.computed[..c.axes().len()]);
        }
        from = to;
    }
    hash.0
}

/// A golden blob of version 1, wherever it is in memory.
///
/// # Panics
/// There is no such blob.
#[must_use]
pub fn blob(name: &str) -> trueaxis::AlignedBlob {
    let path = format!("{}/golden/v1/{name}.trax", env!("CARGO_MANIFEST_DIR"));
    let bytes = std::fs::read(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    trueaxis::AlignedBlob::from_bytes(&bytes)
}

/// Loads a blob on the heap.
///
/// # Panics
/// It is refused.
#[must_use]
pub fn load(blob: &[u8]) -> Box<Largest<'_>> {
    let mut c = Box::new(Largest::empty());
    c.load(blob).unwrap_or_else(|e| panic!("{e}"));
    c
}

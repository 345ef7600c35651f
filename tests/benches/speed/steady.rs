//! Servo updates while only positions change, compared with cases that must not take longer: a tool length, an axis
//! without a reference, an endless axis, an axis at the end of its travel.

use crate::timing::POINTS;
use std::hint::black_box;
use trueaxis::{AlignedBlob, Auxiliary, AuxiliaryKind, Axis, Compensation, Draft, Inputs, Servo};
use trueaxis_tests::Fixed;
use trueaxis_tests::golden::{plain_axis, plain_bank, product, random_values};

/// The situation during an update.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Case {
    /// All axes move on.
    Plain,
    /// The tool length is an input.
    ToolLength,
    /// C, which feeds no table, is not referenced.
    Unreferenced,
    /// C is endless and turns.
    Endless,
    /// Y stands at the end of its travel.
    Parked,
}

impl Case {
    pub const ALL: [Self; 5] = [
        Self::Plain,
        Self::ToolLength,
        Self::Unreferenced,
        Self::Endless,
        Self::Parked,
    ];

    /// Name of the workload.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Plain => "steady",
            Self::ToolLength => "steady-tool-length",
            Self::Unreferenced => "steady-unreferenced",
            Self::Endless => "steady-endless",
            Self::Parked => "steady-parked",
        }
    }
}

/// Servo period, s.
const PERIOD: f32 = 0.001;
/// Travel of Y A C X Z.
const TRAVEL: [f32; 5] = [350.0, 120.0, 360.0, 350.0, 350.0];
/// Number of periods until the corrections are fully in.
const BEFORE: usize = 2 * POINTS;

/// Tables and terms in the layout of the thirteen errors of the Huron; values are random.
fn draft(case: Case) -> Draft {
    let mut random = Fixed::new(3);
    let mut bank = |input: u8, half: f32, points: usize, tables: usize| {
        let columns = (0..tables).map(|_| random_values(&mut random, points, 0.02));
        plain_bank(input, [-half, half], columns.collect())
    };
    let mut banks = vec![
        bank(0, TRAVEL[0], 2, 1),
        bank(1, TRAVEL[1], 93, 13),
        bank(3, TRAVEL[3], 2, 1),
        bank(4, TRAVEL[4], 2, 1),
    ];
    let axes = *b"YACXZ";
    let mut products: Vec<(u8, Vec<u8>)> = vec![
        (0, vec![13]),
        (0, vec![0, 9]),
        (0, vec![2, 15]),
        (0, vec![5, 14]),
        (1, vec![1]),
        (2, vec![8]),
        (3, vec![11]),
        (3, vec![14]),
        (3, vec![0, 3]),
        (3, vec![7, 15]),
        (4, vec![12]),
        (4, vec![15]),
        (4, vec![0, 4]),
        (4, vec![6, 14]),
        (4, vec![10, 14]),
    ];
    let mut auxiliaries = Vec::new();
    if case == Case::ToolLength {
        banks.push(bank(5, 250.0, 2, 1));
        products.push((4, vec![2, 16]));
        auxiliaries.push(Auxiliary {
            kind: AuxiliaryKind::ToolLength,
            name: "tool length".try_into().unwrap_or_default(),
            reference: 130.0,
            sensor: trueaxis::Sensor::USUAL,
        });
    }
    let axis = |(k, name): (usize, u8)| plain_axis(name, [-TRAVEL[k], TRAVEL[k]]);
    let mut axes: Vec<Axis> = axes.into_iter().enumerate().map(axis).collect();
    if case == Case::Endless {
        axes[2].period = 360.0;
        axes[2].travel = [-f32::MAX, f32::MAX];
    }
    Draft {
        machine: case.name().to_owned(),
        axes,
        auxiliaries,
        banks,
        terms: products
            .into_iter()
            .map(|(output, factors)| product(output, &factors))
            .collect(),
        ..Draft::default()
    }
}

/// Positions of successive periods, to and fro, so that they can be repeated without a jump.
fn path(case: Case) -> Vec<Inputs<[f32; 8]>> {
    let at = |period: usize| {
        let there = period.min(POINTS - period) as f32 / (POINTS / 2) as f32;
        let mut inputs = Inputs::at([0.0; 8]);
        for (k, (q, travel)) in inputs.axes.iter_mut().zip(TRAVEL).enumerate() {
            *q = travel * (there * 0.2 * (k + 1) as f32 - 0.5);
        }
        if case == Case::Parked {
            inputs.axes[0] = TRAVEL[0];
        }
        if case == Case::Endless {
            // Whole turns in total, each reduced.
            inputs.axes[2] = (period % 256) as f32 * (360.0 / 256.0);
        }
        if case == Case::ToolLength {
            inputs.auxiliaries[0] = 130.0;
        }
        inputs
    };
    (0..POINTS).map(at).collect()
}

/// A servo with its corrections fully in, and the positions that follow.
pub struct Steady<'a> {
    servo: Servo<&'a Compensation<'a>>,
    path: Vec<Inputs<[f32; 8]>>,
    referenced: u16,
}

/// The blob of a case.
pub fn blob(case: Case) -> AlignedBlob {
    draft(case).encode().expect("a sound draft")
}

impl<'a> Steady<'a> {
    pub fn new(case: Case, compensation: &'a Compensation<'a>) -> Self {
        let mut servo = Servo::new(compensation);
        servo.enable();
        let referenced = if case == Case::Unreferenced {
            0b1_1011
        } else {
            0b1_1111
        };
        let mut steady = Self {
            servo,
            path: path(case),
            referenced,
        };
        for _ in 0..BEFORE / POINTS {
            steady.updates(POINTS);
        }
        assert!(steady.servo.factor() == 1.0, "the corrections are not in");
        steady
    }

    /// Runs `count` updates, one per period, from the start of the path.
    pub fn updates(&mut self, count: usize) {
        for q in &self.path[..count] {
            let correction = self.servo.update(black_box(q), self.referenced, PERIOD);
            black_box(correction);
        }
    }
}

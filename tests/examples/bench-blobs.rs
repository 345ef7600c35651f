//! Writes the blobs, other than the Huron's, that `cargo xtask bench-target` measures, into the folder given as
//! argument.

use std::path::Path;
use std::process::ExitCode;
use trueaxis::{
    Auxiliary, AuxiliaryKind, Axis, Direction, Draft, DraftBank, DraftGrid, GridAxis,
    Interpolation, SampleFormat, Sensor, Term,
};
use trueaxis_tests::Fixed;

fn axis(name: u8, travel: [f32; 2]) -> Axis {
    Axis {
        name,
        travel,
        period: 0.0,
        value_bound: 1.0,
        rate_bound: 1.0,
        reversal_threshold: 0.001,
        ramp_rate: 1.0,
        reversal_rate: 1.0,
        reversal_acceleration: 20.0,
    }
}

/// 25 × 25 × 25 nodes over X Y Z, three outputs.
fn grid() -> Draft {
    const NODES: u32 = 25;
    const STEP: f32 = 20.0;
    let travel = [0.0, (NODES - 1) as f32 * STEP];
    let mut random = Fixed::new(2);
    let lines = (0..3).map(|input| GridAxis {
        input,
        start: travel[0],
        step: STEP,
        points: NODES,
        modulo: false,
    });
    Draft {
        machine: "cube".to_owned(),
        axes: b"XYZ".map(|name| axis(name, travel)).into(),
        grids: vec![DraftGrid {
            axes: lines.collect(),
            outputs: vec![0, 1, 2],
            format: SampleFormat::F32,
            values: (0..3 * NODES.pow(3))
                .map(|_| random.within(-0.05, 0.05) as f32)
                .collect(),
        }],
        ..Draft::default()
    }
}

/// The layout of the source document for thirteen errors: 13, 11, 14, 1 and 1 tables correct X, Y, Z, A and C. All
/// tables of a linear axis except one are products of a pair of a linear axis and A, as in its Eq. 59; tables have 15
/// points, as in its Figure 7.3. Values are random.
fn document() -> Draft {
    const POINTS: usize = 15;
    const X: usize = 0;
    const Y: usize = 1;
    const Z: usize = 2;
    const A: usize = 3;
    const C: usize = 4;
    let travel: [[f32; 2]; 5] = [
        [-350.0, 350.0],
        [-350.0, 350.0],
        [-350.0, 350.0],
        [-120.0, 120.0],
        [-360.0, 360.0],
    ];
    // Inputs of the tables of each term, output by output.
    let terms: Vec<(usize, Vec<usize>)> = [
        (X, [Y, Z, Y, Z, Y, Z].as_slice(), Some(X)),
        (Y, &[X, Z, X, Z, X], Some(Y)),
        (Z, &[X, Y, X, Y, X, Y, X], None),
        (A, &[], Some(A)),
        (C, &[], Some(A)),
    ]
    .into_iter()
    .flat_map(|(output, pairs, single)| {
        // Short products first, as `compile` orders them.
        let pairs = pairs.iter().map(|&linear| vec![linear, A]);
        let terms = single.map(|input| vec![input]).into_iter().chain(pairs);
        terms.map(|inputs| (output, inputs)).collect::<Vec<_>>()
    })
    .collect();

    let mut random = Fixed::new(40);
    let mut banks: Vec<DraftBank> = (0..5)
        .map(|input| DraftBank {
            input: input as u8,
            start: travel[input][0],
            step: (travel[input][1] - travel[input][0]) / (POINTS - 1) as f32,
            modulo: false,
            direction: Direction::Both,
            interpolation: Interpolation::Linear,
            format: SampleFormat::F32,
            columns: Vec::new(),
        })
        .collect();
    // Tables are numbered through the banks, so the banks must be complete first.
    let mut places = Vec::new();
    for (_, inputs) in &terms {
        for &input in inputs {
            let columns = &mut banks[input].columns;
            places.push((input, columns.len()));
            columns.push(
                (0..POINTS)
                    .map(|_| random.within(-0.3, 0.3) as f32)
                    .collect(),
            );
        }
    }
    assert_eq!(places.len(), 40);
    let first: Vec<usize> = (0..5)
        .map(|bank| banks[..bank].iter().map(|b| b.columns.len()).sum())
        .collect();
    let mut places = places
        .into_iter()
        .map(|(bank, column)| first[bank] + column);
    let terms = terms.iter().map(|(output, inputs)| Term {
        output: *output as u8,
        weight: 1.0,
        limits: None,
        factors: places
            .by_ref()
            .take(inputs.len())
            .map(|p| p as u8)
            .collect(),
    });
    banks.retain(|bank| !bank.columns.is_empty());
    Draft {
        machine: "document".to_owned(),
        axes: (0..5).map(|k| axis(b"XYZAC"[k], travel[k])).collect(),
        terms: terms.collect(),
        banks,
        ..Draft::default()
    }
}

/// One bank of `tables` tables, each a term: the cost of a bank and of a table.
fn one_bank(tables: usize, interpolation: Interpolation) -> Draft {
    const SAMPLES: usize = 24;
    let mut random = Fixed::new(tables as u64);
    let mut sample = || random.within(-0.05, 0.05) as f32;
    Draft {
        machine: "bank".to_owned(),
        axes: vec![axis(b'X', [-400.0, 400.0])],
        banks: vec![DraftBank {
            input: 0,
            start: -400.0,
            step: 800.0 / (SAMPLES - 3) as f32,
            modulo: false,
            direction: Direction::Both,
            interpolation,
            format: SampleFormat::F32,
            columns: (0..tables)
                .map(|_| (0..SAMPLES).map(|_| sample()).collect())
                .collect(),
        }],
        terms: (0..tables as u8)
            .map(|table| Term {
                output: 0,
                weight: 1.0,
                limits: None,
                factors: [table].into_iter().collect(),
            })
            .collect(),
        ..Draft::default()
    }
}

/// Three banks of one linear table, of which the last two read the axis, or two temperatures, with or without a lag:
/// their evaluations are alike.
fn thermal(lag_rate: Option<f32>) -> Draft {
    let one = one_bank(1, Interpolation::Linear);
    let mut draft = one.clone();
    for number in 1..3 {
        let mut bank = one.banks[0].clone();
        if let Some(lag_rate) = lag_rate {
            bank.input = number;
            draft.auxiliaries.push(Auxiliary {
                kind: AuxiliaryKind::Temperature,
                name: ["bed", "column"][usize::from(number) - 1]
                    .try_into()
                    .unwrap_or_default(),
                reference: 20.0,
                sensor: Sensor {
                    lag_rate,
                    ..Sensor::USUAL
                },
            });
        }
        draft.banks.push(bank);
        let mut term = one.terms[0].clone();
        term.factors = [number].into_iter().collect();
        draft.terms.push(term);
    }
    draft
}

fn main() -> ExitCode {
    let Some(folder) = std::env::args().nth(1) else {
        eprintln!("usage: bench-blobs FOLDER");
        return ExitCode::from(2);
    };
    let (linear, cubic) = (Interpolation::Linear, Interpolation::Cubic);
    for (name, draft) in [
        ("grid25.trax", grid()),
        ("document40.trax", document()),
        ("linear1.trax", one_bank(1, linear)),
        ("linear9.trax", one_bank(9, linear)),
        ("cubic1.trax", one_bank(1, cubic)),
        ("cubic9.trax", one_bank(9, cubic)),
        ("thermal0.trax", thermal(None)),
        ("thermal2.trax", thermal(Some(0.0))),
        ("thermal2-lag.trax", thermal(Some(1.0 / 3600.0))),
    ] {
        let written = draft
            .encode()
            .map_err(|error| error.to_string())
            .and_then(|blob| {
                std::fs::write(Path::new(&folder).join(name), &*blob).map_err(|e| e.to_string())
            });
        if let Err(message) = written {
            eprintln!("{name}: {message}");
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}

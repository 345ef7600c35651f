//! Writes the blobs, other than the Huron's, that `cargo xtask bench-target` measures, into the folder given as
//! argument.

use std::path::Path;
use std::process::ExitCode;
use trueaxis::{Auxiliary, AuxiliaryKind, Draft, DraftBank, Interpolation, Sensor};
use trueaxis_tests::Fixed;
use trueaxis_tests::golden::{cube, plain_axis, plain_bank, product, random_values};

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
    let mut columns: [Vec<Vec<f32>>; 5] = Default::default();
    // Tables are numbered through the banks, so all of them must be there first.
    let mut places = Vec::new();
    for (_, inputs) in &terms {
        for &input in inputs {
            places.push((input, columns[input].len()));
            columns[input].push(random_values(&mut random, POINTS, 0.3));
        }
    }
    assert_eq!(places.len(), 40);
    let first: Vec<usize> = (0..5)
        .map(|bank| columns[..bank].iter().map(Vec::len).sum())
        .collect();
    let mut places = places.into_iter();
    let mut place = || {
        places
            .next()
            .map(|(bank, column)| (first[bank] + column) as u8)
    };
    let terms = terms.iter().map(|(output, inputs)| {
        let factors: Vec<u8> = inputs.iter().filter_map(|_| place()).collect();
        product(*output as u8, &factors)
    });
    let banks = (0_u8..).zip(travel).zip(columns);
    let banks = banks.filter(|(_, columns)| !columns.is_empty());
    Draft {
        machine: "document".to_owned(),
        axes: (0..5).map(|k| plain_axis(b"XYZAC"[k], travel[k])).collect(),
        terms: terms.collect(),
        banks: banks
            .map(|((input, range), columns)| plain_bank(input, range, columns))
            .collect(),
        ..Draft::default()
    }
}

/// One bank of `tables` tables, each a term: the cost of a bank and of a table.
fn one_bank(tables: usize, interpolation: Interpolation) -> Draft {
    const SAMPLES: usize = 24;
    let mut random = Fixed::new(tables as u64);
    let columns = (0..tables).map(|_| random_values(&mut random, SAMPLES, 0.05));
    let range = [-400.0, 400.0];
    Draft {
        machine: "bank".to_owned(),
        axes: vec![plain_axis(b'X', range)],
        banks: vec![DraftBank {
            step: 800.0 / (SAMPLES - 3) as f32,
            interpolation,
            ..plain_bank(0, range, columns.collect())
        }],
        terms: (0..tables as u8)
            .map(|table| product(0, &[table]))
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
        draft.terms.push(product(0, &[number]));
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
        ("grid25.trax", cube()),
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

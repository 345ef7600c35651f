//! A compensation with banks of every width and outputs with every number of products: the Cortex-M kernel processes
//! rows in groups of seven values and products in pairs, with separate code for the remainder.

use crate::Failure;
use crate::board::Setup;
use crate::cases::Case;
use trueaxis::{Axis, Direction, Draft, DraftBank, Interpolation, SampleFormat, Term};
use trueaxis_tests::Fixed;

/// Number of tables in each bank: all remainders of seven, with and without groups of seven before them.
const WIDTHS: [usize; 11] = [1, 2, 3, 4, 5, 6, 7, 8, 13, 14, 20];
const TRAVEL: f32 = 300.0;

/// Writes its blob.
pub fn case(setup: &Setup<'_>) -> Result<Case, Failure> {
    let mut random = Fixed::new(7);
    let mut bank = |(k, tables): (usize, usize), points: usize| DraftBank {
        input: (k % 5) as u8,
        start: -TRAVEL,
        step: 2.0 * TRAVEL / (points - 1) as f32,
        modulo: false,
        direction: Direction::Both,
        interpolation: Interpolation::Linear,
        format: SampleFormat::F32,
        columns: (0..tables)
            .map(|_| {
                (0..points)
                    .map(|_| random.within(-0.1, 0.1) as f32)
                    .collect()
            })
            .collect(),
    };
    let mut banks: Vec<DraftBank> = WIDTHS.into_iter().enumerate().map(|w| bank(w, 9)).collect();
    // Includes straight ones.
    banks.extend((0..5).map(|k| bank((k, 1), 2)));
    let tables: usize = banks.iter().map(|bank| bank.columns.len()).sum();
    // One product for the first output, two for the second, and so on; then the remaining terms.
    let outputs = (0..5).flat_map(|output| std::iter::repeat_n(output, usize::from(output) + 1));
    let outputs = outputs.chain(std::iter::repeat(4));
    let term = |(k, output)| Term {
        output,
        weight: 1.0,
        limits: None,
        factors: [k as u8, (tables - 1 - k) as u8].into_iter().collect(),
    };
    let draft = Draft {
        machine: "Widths".to_owned(),
        axes: b"XYZAC"
            .map(|name| Axis {
                name,
                travel: [-TRAVEL, TRAVEL],
                period: 0.0,
                value_bound: 5.0,
                rate_bound: 50.0,
                reversal_threshold: 0.001,
                ramp_rate: 20.0,
                reversal_rate: 50.0,
                reversal_acceleration: 400.0,
            })
            .into(),
        banks,
        terms: (0..tables).zip(outputs).map(term).collect(),
        ..Draft::default()
    };
    let blob = draft.encode()?;
    let path = setup.folder.join("widths.trax");
    std::fs::write(&path, &*blob)?;
    Ok(Case {
        name: "widths",
        path,
        blob,
    })
}

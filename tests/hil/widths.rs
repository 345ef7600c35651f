//! A compensation with banks of every width and outputs with every number of products: the Cortex-M kernel processes
//! rows in groups of seven values and products in pairs, with separate code for the remainder.

use crate::Failure;
use crate::board::Setup;
use crate::cases::Case;
use trueaxis::{Axis, Draft, DraftBank};
use trueaxis_tests::Fixed;
use trueaxis_tests::golden::{plain_axis, plain_bank, product, random_values};

/// Number of tables in each bank: all remainders of seven, with and without groups of seven before them.
const WIDTHS: [usize; 11] = [1, 2, 3, 4, 5, 6, 7, 8, 13, 14, 20];
const TRAVEL: f32 = 300.0;

/// Writes its blob.
pub fn case(setup: &Setup<'_>) -> Result<Case, Failure> {
    let mut random = Fixed::new(7);
    let mut bank = |(k, tables): (usize, usize), points: usize| {
        let columns = (0..tables).map(|_| random_values(&mut random, points, 0.1));
        plain_bank((k % 5) as u8, [-TRAVEL, TRAVEL], columns.collect())
    };
    let mut banks: Vec<DraftBank> = WIDTHS.into_iter().enumerate().map(|w| bank(w, 9)).collect();
    // Includes straight ones.
    banks.extend((0..5).map(|k| bank((k, 1), 2)));
    let tables: usize = banks.iter().map(|bank| bank.columns.len()).sum();
    // One product for the first output, two for the second, and so on; then the remaining terms.
    let outputs = (0..5).flat_map(|output| std::iter::repeat_n(output, usize::from(output) + 1));
    let outputs = outputs.chain(std::iter::repeat(4));
    let term = |(k, output)| product(output, &[k as u8, (tables - 1 - k) as u8]);
    let axis = |name| Axis {
        value_bound: 5.0,
        ramp_rate: 20.0,
        reversal_acceleration: 400.0,
        ..plain_axis(name, [-TRAVEL, TRAVEL])
    };
    let draft = Draft {
        machine: "Widths".to_owned(),
        axes: b"XYZAC".map(axis).into(),
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

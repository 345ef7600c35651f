//! What a servo has to know of a compensation beside its corrections, as a small compensation without samples.

use trueaxis::{
    AlignedBlob, Draft, DraftBank, DraftGrid, EncodeError, GridAxis, Interpolation, Largest,
    SampleFormat, Term,
};

/// A compensation with the same axes, auxiliaries, adjustable terms, directions and periods, whose corrections are 0.
pub fn facts(compensation: &Largest<'_>) -> Result<AlignedBlob, EncodeError> {
    let banks = compensation.banks();
    let of_table: Vec<u8> = (0_u8..)
        .zip(banks)
        .flat_map(|(number, bank)| std::iter::repeat_n(number, usize::from(bank.tables)))
        .collect();
    // Two points over the same period or range.
    let step = |points: u32, step: f32, modulo: bool| match modulo {
        true => points as f32 * step / 2.0,
        false => (points - 1) as f32 * step,
    };
    let draft = Draft {
        machine: compensation.machine().to_owned(),
        policy: compensation.policy(),
        axes: compensation.axes().to_vec(),
        auxiliaries: compensation.auxiliaries().to_vec(),
        banks: banks
            .iter()
            .map(|bank| DraftBank {
                input: bank.input,
                start: bank.start,
                step: match bank.modulo {
                    true => step(bank.points, bank.step, true),
                    false => bank.end() - bank.start,
                },
                modulo: bank.modulo,
                direction: bank.direction,
                interpolation: Interpolation::Linear,
                format: SampleFormat::F32,
                columns: vec![vec![0.0; 2]],
            })
            .collect(),
        terms: compensation
            .terms()
            .map(|term| Term {
                output: term.output,
                weight: term.weight,
                limits: term.limits,
                factors: term
                    .factors
                    .iter()
                    .map(|t| of_table[usize::from(*t)])
                    .collect(),
            })
            .collect(),
        grids: compensation
            .grids()
            .iter()
            .map(|grid| {
                let axes = grid.axes.iter().map(|axis| GridAxis {
                    points: 2,
                    step: step(axis.points, axis.step, axis.modulo),
                    ..*axis
                });
                let axes: Vec<GridAxis> = axes.collect();
                DraftGrid {
                    values: vec![0.0; grid.outputs.len() << axes.len()],
                    axes,
                    outputs: grid.outputs.to_vec(),
                    format: SampleFormat::F32,
                }
            })
            .collect(),
        notes: trueaxis::Notes::default(),
    };
    draft.encode()
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueaxis::Direction;
    use trueaxis_tables::validate::Runtime;
    use trueaxis_tests::golden;

    #[test]
    fn the_servo_knows_the_same_of_both() {
        let drafted = golden::everything().encode().unwrap();
        let golden = ["huron-13", "router-10", "table-head-13"].map(golden::blob);
        for blob in [drafted].into_iter().chain(golden) {
            let whole = Runtime::load(&blob).unwrap();
            let whole = whole.compensation();
            let facts = facts(whole).unwrap();
            let small = Runtime::load(&facts).unwrap();
            let small = small.compensation();
            assert_eq!(small.axes(), whole.axes());
            assert_eq!(small.auxiliaries(), whole.auxiliaries());
            assert_eq!(small.inputs_used(), whole.inputs_used());
            assert!(small.weights().iter().eq(whole.weights().iter()));
            for axis in 0..whole.axes().len() {
                assert_eq!(small.farthest(axis), whole.farthest(axis));
            }
            for number in 0..whole.auxiliaries().len() {
                assert_eq!(small.range(number), whole.range(number));
            }
            let directions = |c: &Largest<'_>| {
                let banks = c.banks().iter();
                let directional = banks.filter(|bank| bank.direction != Direction::Both);
                directional.map(|bank| bank.input).collect::<Vec<_>>()
            };
            assert_eq!(directions(small), directions(whole));
        }
    }
}

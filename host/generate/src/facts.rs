//! What a servo has to know of a compensation beside its corrections, as a small compensation without samples.

use trueaxis::{
    AlignedBlob, Bank, Draft, DraftBank, DraftGrid, EncodeError, Grid, GridAxis, Interpolation,
    Largest, SampleFormat, Term,
};

/// A compensation with the same axes, auxiliaries, adjustable terms, directions and periods, whose corrections are 0.
pub fn facts(compensation: &Largest<'_>) -> Result<AlignedBlob, EncodeError> {
    let banks = compensation.banks();
    let of_table: Vec<u8> = (0_u8..)
        .zip(banks)
        .flat_map(|(number, bank)| std::iter::repeat_n(number, usize::from(bank.tables)))
        .collect();
    let terms = compensation.terms().map(|term| {
        let factors = term.factors.iter();
        Term {
            output: term.output,
            weight: term.weight,
            limits: term.limits,
            factors: factors.map(|t| of_table[usize::from(*t)]).collect(),
        }
    });
    let draft = Draft {
        machine: compensation.machine().to_owned(),
        policy: compensation.policy(),
        axes: compensation.axes().to_vec(),
        auxiliaries: compensation.auxiliaries().to_vec(),
        banks: banks.iter().map(bank).collect(),
        terms: terms.collect(),
        grids: compensation.grids().iter().map(grid).collect(),
        notes: trueaxis::Notes::default(),
    };
    draft.encode()
}

/// A table of two zeros over the period or range of a bank.
fn bank(bank: &Bank) -> DraftBank {
    DraftBank {
        input: bank.input,
        start: bank.start,
        step: match bank.modulo {
            true => half_period(bank.points, bank.step),
            false => bank.end() - bank.start,
        },
        modulo: bank.modulo,
        direction: bank.direction,
        interpolation: Interpolation::Linear,
        format: SampleFormat::F32,
        columns: vec![vec![0.0; 2]],
    }
}

/// Zeros at two nodes over the period or range of each input of a grid.
fn grid(grid: &Grid) -> DraftGrid {
    let axes = grid.axes.iter().map(|axis| GridAxis {
        points: 2,
        step: match axis.modulo {
            true => half_period(axis.points, axis.step),
            false => (axis.points - 1) as f32 * axis.step,
        },
        ..*axis
    });
    DraftGrid {
        values: vec![0.0; grid.outputs.len() << grid.axes.len()],
        axes: axes.collect(),
        outputs: grid.outputs.to_vec(),
        format: SampleFormat::F32,
    }
}

fn half_period(points: u32, step: f32) -> f32 {
    points as f32 * step / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueaxis::Direction;
    use trueaxis_model::validate::Runtime;
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

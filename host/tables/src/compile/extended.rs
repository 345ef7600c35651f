//! Compensations that get one more grid: a map of a surface beside the errors of the machine.

use super::bounds::AxisBounds;
use super::{CompileError, Progress, bounds_of, limits};
use crate::schemes::blank::blank;
use trueaxis::{AlignedBlob, Draft, DraftBank, DraftGrid, Notes, Term};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::Machine;
use trueaxis_model::validate::Runtime;

/// A compensation that corrects nothing.
#[must_use]
pub fn nothing(machine: &Machine) -> Draft {
    blank(&Kinematics::new(machine, &ErrorModel::perfect(machine)))
}

/// What a compensation with these notes has been written from. Values stored as integers come back as they are evaluated.
#[must_use]
pub fn draft(runtime: &Runtime<'_>, notes: Notes) -> Draft {
    let compensation = runtime.compensation();
    let mut table = 0;
    let banks = compensation.banks().iter().map(|bank| {
        let first = table;
        table += usize::from(bank.tables);
        let column = |table: usize| {
            let points = 0..bank.points as usize;
            let values = points.map(|point| compensation.sample(table, point));
            values.map(Option::unwrap_or_default).collect()
        };
        DraftBank {
            input: bank.input,
            start: bank.start,
            step: bank.step,
            modulo: bank.modulo,
            direction: bank.direction,
            interpolation: bank.interpolation,
            format: bank.format,
            columns: (first..table).map(column).collect(),
        }
    });
    let banks: Vec<DraftBank> = banks.collect();
    let terms = compensation.terms().map(|term| Term {
        output: term.output,
        weight: term.weight,
        limits: term.limits,
        factors: term.factors.iter().copied().collect(),
    });
    let grids = (0..).zip(compensation.grids()).map(|(number, grid)| {
        let nodes = 0..grid.nodes() as usize;
        let values = nodes.flat_map(|node| {
            let outputs = 0..grid.outputs.len();
            outputs.map(move |output| compensation.grid_sample(number, node, output))
        });
        DraftGrid {
            axes: grid.axes.to_vec(),
            outputs: grid.outputs.to_vec(),
            format: grid.format,
            values: values.map(Option::unwrap_or_default).collect(),
        }
    });
    Draft {
        machine: compensation.machine().to_owned(),
        policy: compensation.policy(),
        axes: compensation.axes().to_vec(),
        auxiliaries: compensation.auxiliaries().to_vec(),
        terms: terms.collect(),
        grids: grids.collect(),
        banks,
        notes,
    }
}

/// Seed of the positions at which bounds are computed.
const SEED: u64 = 1;

/// A compensation with a grid: that alone, or `base` with it, and then its bounds are added to those of the axes that it
/// corrects. Also returns the bounds of the grid alone.
///
/// # Errors
/// [`CompileError`]: the grid cannot be written, or corrections can move faster than the machine file allows.
pub fn with_grid(
    machine: &Machine,
    base: Option<Draft>,
    grid: DraftGrid,
    progress: &dyn Progress,
) -> Result<(AlignedBlob, Vec<AxisBounds>), CompileError> {
    let mut alone = Draft {
        grids: vec![grid.clone()],
        ..nothing(machine)
    };
    let blob = alone.encode()?;
    let bounds = bounds_of(machine, &Runtime::load(&blob)?, SEED, progress)?;
    let both = match base {
        None => {
            for (axis, bound) in alone.axes.iter_mut().zip(&bounds) {
                bound.set(axis);
            }
            alone
        }
        Some(mut base) => {
            for output in grid.outputs.iter().map(|output| usize::from(*output)) {
                let (axis, bound) = (&mut base.axes[output], &bounds[output]);
                axis.value_bound += bound.value_bound;
                axis.rate_bound += bound.rate_bound;
                axis.ramp_rate += bound.ramp_rate;
                axis.reversal_rate = axis.reversal_rate.max(axis.rate_bound);
            }
            base.grids.push(grid);
            base
        }
    };
    let blob = both.encode()?;
    limits::check(machine, &Runtime::load(&blob)?)?;
    Ok((blob, bounds))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::{Options, build};
    use trueaxis::SampleFormat;

    #[test]
    fn a_draft_comes_back_from_its_blob() {
        let machine = include_str!("../../../../examples/mill-21/machine.toml");
        let errors = include_str!("../../../../examples/mill-21/errors-21.toml");
        let machine = Machine::from_toml(machine).unwrap();
        let errors = ErrorModel::from_toml(errors, &machine).unwrap();
        for format in [SampleFormat::F32, SampleFormat::I16] {
            let mut options = Options::default();
            options.tables.format = format;
            let blob = build(&machine, &errors, &options, &()).unwrap().blob;
            let runtime = Runtime::load(&blob).unwrap();
            let notes = Notes::of(&blob).unwrap_or_default();
            let again = draft(&runtime, notes).encode().unwrap();
            match format {
                SampleFormat::F32 => assert_eq!(&again[..], &blob[..]),
                // The scale may round the other way.
                SampleFormat::I16 => assert_eq!(again.len(), blob.len()),
            }
        }
    }
}

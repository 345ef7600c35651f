//! Compares the program with the general evaluation: every bit, except for the sign of a zero.

use crate::interpret::{Given, Machine};
use crate::program::Program;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use trueaxis::{Inputs, Largest, Travel, Travelling};
use trueaxis_model::parallel;

/// A difference: the code is not written.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "the code would differ from the file: at {inputs:?} the correction of axis {axis} is {code:e}, not {file:e}"
)]
pub struct Differs {
    /// Axes, then auxiliaries (mm, degrees, K).
    pub inputs: Vec<f32>,
    /// The number of the axis.
    pub axis: usize,
    /// What the code computes.
    pub code: f32,
    /// What the file says.
    pub file: f32,
}

/// Inputs that are worked on together.
const BLOCK: usize = 4096;
const TRAVELS: [Travel; 3] = [Travel::Unknown, Travel::Positive, Travel::Negative];

/// Compares both at random inputs: within the ranges of tables, at their points and ends, and beyond.
pub fn compare(program: &Program, compensation: &Largest<'_>, count: usize) -> Result<(), Differs> {
    let blocks: Vec<u64> = (0..count.div_ceil(BLOCK) as u64).collect();
    let places = places(compensation);
    parallel::try_map(&blocks, |block| {
        compare_block(program, compensation, &places, *block)
    })?;
    Ok(())
}

fn compare_block(
    program: &Program,
    compensation: &Largest<'_>,
    places: &[Vec<[f32; 3]>],
    seed: u64,
) -> Result<(), Differs> {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut machine = Machine::new(program);
    let mut weights = compensation.weights();
    let adjustable = compensation.terms().enumerate();
    let adjustable: Vec<(usize, [f32; 2])> = adjustable
        .filter_map(|(term, view)| Some((term, view.limits?)))
        .collect();
    let mut corrections = vec![0.0; program.axes];
    let mut inputs = Inputs::at([0.0; 16]);
    let mut travelling = Travelling([Travel::Unknown; 16]);
    for _ in 0..BLOCK {
        let places = places.iter().take(program.inputs);
        let given: Vec<f32> = places.map(|places| input(&mut random, places)).collect();
        (travelling.0).fill_with(|| TRAVELS[random.random_range(0..3)]);
        for (term, [low, high]) in &adjustable {
            // Within the limits, so it is accepted.
            let _ = weights.set(*term, low + (high - low) * random.random::<f32>());
        }
        let values: Vec<f32> = weights.iter().map(|(_, value)| value).collect();
        let (axes, auxiliaries) = given.split_at(program.axes);
        inputs.axes[..axes.len()].copy_from_slice(axes);
        inputs.auxiliaries[..auxiliaries.len()].copy_from_slice(auxiliaries);
        let file = compensation.evaluate(&inputs, &travelling, &weights);
        let asked = Given {
            inputs: &given,
            travel: &travelling.0,
            weights: &values,
        };
        machine.run(&asked, &mut corrections);
        equal(corrections.iter().copied().zip(file), given)?;
    }
    Ok(())
}

/// Compares corrections of the code and of the file at the same inputs.
fn equal(both: impl Iterator<Item = (f32, f32)>, inputs: Vec<f32>) -> Result<(), Differs> {
    let is_other =
        |code: f32, file: f32| code.to_bits() != file.to_bits() && (code != 0.0 || file != 0.0);
    match (both.enumerate()).find(|(_, (code, file))| is_other(*code, *file)) {
        None => Ok(()),
        Some((axis, (code, file))) => Err(Differs {
            inputs,
            axis,
            code,
            file,
        }),
    }
}

/// Start, step and number of points of what reads each input.
pub fn places(compensation: &Largest<'_>) -> Vec<Vec<[f32; 3]>> {
    let count = compensation.axes().len() + compensation.auxiliaries().len();
    let mut places = vec![Vec::new(); count];
    for bank in compensation.banks() {
        places[usize::from(bank.input)].push([bank.start, bank.step, bank.points as f32]);
    }
    for axis in compensation.grids().iter().flat_map(|grid| &grid.axes) {
        places[usize::from(axis.input)].push([axis.start, axis.step, axis.points as f32]);
    }
    places
}

/// A random value of an input: mostly within its tables, sometimes at or next to a point, beyond an end, or far outside.
fn input(random: &mut Pcg64Mcg, places: &[[f32; 3]]) -> f32 {
    if places.is_empty() {
        return random.random_range(-1000.0..1000.0);
    }
    let [start, step, points] = places[random.random_range(0..places.len())];
    let point = start + random.random_range(0..points as u32 + 1) as f32 * step;
    match random.random_range(0..16) {
        0 | 1 => point,
        2 => point.next_up(),
        3 => point.next_down(),
        4 => start - random.random::<f32>() * step * points,
        5 => start + (1.0 + random.random::<f32>()) * step * points,
        6 => [
            1e9,
            -1e9,
            f32::MAX,
            f32::MIN,
            f32::INFINITY,
            f32::NEG_INFINITY,
        ][random.random_range(0..6)],
        _ => start + random.random::<f32>() * step * points,
    }
}

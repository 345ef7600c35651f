//! Random positions at which a file for a controller is compared with its compensation.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use trueaxis::{AUXILIARIES, AuxiliaryKind, Axis, Largest, Travel};
use trueaxis_model::machine::MAX_AXES;
use trueaxis_model::validate::Command;

/// X, Y and Z, by their index.
pub(crate) fn xyz(axes: &[Axis]) -> Option<[usize; 3]> {
    let index = |letter: u8| axes.iter().position(|axis| axis.name == letter);
    Some([index(b'X')?, index(b'Y')?, index(b'Z')?])
}

/// The letters of axes.
pub(crate) fn letters(axes: &[Axis]) -> String {
    axes.iter().map(|axis| char::from(axis.name)).collect()
}

/// Positions over the travel, each with the directions from which the axes have arrived; auxiliary inputs are 0.
pub fn random(axes: &[Axis], count: usize, seed: u64) -> Vec<Command> {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut commands = Vec::with_capacity(count);
    for _ in 0..count {
        let mut command = Command {
            axes: [0.0; MAX_AXES],
            travel: [Travel::Unknown; MAX_AXES],
            auxiliaries: [0.0; AUXILIARIES],
        };
        for (i, axis) in axes.iter().enumerate() {
            let [low, high] = travel(axis);
            command.axes[i] = (low + (high - low) * random.random::<f64>()) as f32;
            command.travel[i] = match random.random_range(0..3) {
                0 => Travel::Unknown,
                1 => Travel::Positive,
                _ => Travel::Negative,
            };
        }
        commands.push(command);
    }
    commands
}

/// Like `random`, over the travel of a compensation, with the tool length that it was compiled with.
pub fn random_of(compensation: &Largest<'_>, count: usize, seed: u64) -> Vec<Command> {
    let mut commands = random(compensation.axes(), count, seed);
    let inputs = compensation.auxiliaries().iter().enumerate();
    for (i, length) in inputs.filter(|(_, input)| input.kind == AuxiliaryKind::ToolLength) {
        for command in &mut commands {
            command.auxiliaries[i] = length.reference;
        }
    }
    commands
}

/// Travel of an axis (mm, deg); for an axis without limits, its turn.
pub fn travel(axis: &Axis) -> [f64; 2] {
    match axis.period > 0.0 {
        true => [0.0, axis.period.into()],
        false => axis.travel.map(f64::from),
    }
}

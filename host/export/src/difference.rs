//! What a file for a controller leaves of a compensation.

use serde::Serialize;
use trueaxis_model::machine::{Letter, MAX_AXES};
use trueaxis_model::parallel;
use trueaxis_model::validate::{Command, Runtime};

/// An axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Letter of the axis.
    pub axis: char,
    /// `µm` or `µrad`.
    pub unit: &'static str,
    /// Largest correction of the compensation.
    pub largest: f64,
    /// Largest difference between the compensation and the file.
    pub difference: f64,
}

/// Compares a compensation with what a controller makes of a file (mm, deg, in the order of the axes).
pub fn differences(
    runtime: &Runtime<'_>,
    commands: &[Command],
    controller: impl Fn(&Command) -> [f64; MAX_AXES] + Sync,
) -> Vec<Difference> {
    let each = parallel::map(commands, |command| {
        let (wanted, found) = (runtime.evaluate(command), controller(command));
        let wanted = wanted.map(f64::from);
        let apart = std::array::from_fn::<_, MAX_AXES, _>(|i| (found[i] - wanted[i]).abs());
        [wanted.map(f64::abs), apart]
    });
    let axes = runtime.compensation().axes().iter().enumerate();
    axes.map(|(i, axis)| {
        let letter = char::from(axis.name);
        let (unit, fine) = match Letter::new(letter).is_some_and(Letter::is_rotary) {
            true => ("µrad", 1_f64.to_radians() * 1e6),
            false => ("µm", 1e3),
        };
        let most = |k: usize| each.iter().map(|both| both[k][i]).fold(0.0, f64::max) * fine;
        Difference {
            axis: letter,
            unit,
            largest: most(0),
            difference: most(1),
        }
    })
    .collect()
}

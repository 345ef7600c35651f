//! Randomly generated machines with random errors, on which the scheme `exact` is tested.
//!
//! The range is wider than in practice: three rotary axes, quills, six axes, tilted frames, rotary travels down to ±3°
//! and endless ones, error motions of degree 3 in every direction on every axis, measured ones, different errors for
//! each direction of travel, temperatures, unmeasured ranges. A drawing consists of the files a user writes, a machine
//! file and an error file: if they are refused it is not tested.

mod counts;
mod errors;
mod judged;
mod kinds;
mod machine;
mod measured;

pub use counts::Counts;
pub use judged::{Effort, Judged, Outcome, TIMES};
pub use kinds::Kinds;
pub use measured::{Measured, Places};

use crate::Fixed;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;

/// Number of drawings to which the claims refer.
pub const ALL: usize = 300;

/// A machine that can be corrected, with its errors.
#[derive(Clone, Debug)]
pub struct Case {
    /// Number of the drawing.
    pub seed: u64,
    /// The files they were read from: machine, errors.
    pub files: [String; 2],
    /// The machine.
    pub machine: Machine,
    /// Errors of the machine.
    pub errors: ErrorModel,
}

/// `count` of the drawings with a correctable machine: up to [`ALL`], evenly selected, so that a few cover all kinds;
/// beyond that, the first ones.
#[must_use]
pub fn cases(count: usize) -> Vec<Case> {
    chosen(count, |_| true)
}

/// Like `cases`, for drawings without measured motions.
#[must_use]
pub fn unmeasured(count: usize) -> Vec<Case> {
    chosen(count, |case| !Kinds::of(case).has("tabulated"))
}

fn chosen(count: usize, wanted: fn(&Case) -> bool) -> Vec<Case> {
    let step = (ALL / count.max(1)).max(1);
    let all = (0..).filter_map(case).filter(wanted);
    all.step_by(step).take(count).collect()
}

/// One drawing; `None` if the machine or its errors are refused.
#[must_use]
pub fn case(seed: u64) -> Option<Case> {
    let mut random = Fixed::new(seed + 1);
    // Similar seeds begin with similar numbers.
    for _ in 0..16 {
        random.bits();
    }
    let text = machine::draw(&mut random);
    let machine = Machine::from_toml(&text).ok()?;
    let errors_text = errors::draw(&machine, &mut random);
    let errors = ErrorModel::from_toml(&errors_text, &machine).ok()?;
    Some(Case {
        seed,
        files: [text, errors_text],
        machine,
        errors,
    })
}

impl Fixed {
    /// One of `0..n`.
    pub fn below(&mut self, n: usize) -> usize {
        ((u64::from(self.bits()) * n as u64) >> 32) as usize
    }

    /// True with probability `p`.
    fn chance(&mut self, p: f64) -> bool {
        self.within(0.0, 1.0) < p
    }

    /// One value for each direction.
    fn three(&mut self, size: f64) -> [f64; 3] {
        std::array::from_fn(|_| self.within(-size, size))
    }
}

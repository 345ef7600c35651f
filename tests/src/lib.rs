//! End-to-end tests of trueaxis: the tests are the files in `tests/`, the benchmarks those in
//! `benches/`. Here is what they share.

pub mod golden;

use trueaxis_host::errors::ErrorModel;
use trueaxis_host::machine::{Machine, PerAxis};

/// Pseudo-random numbers that are the same for ever: xorshift64*, in integers only.
#[derive(Clone, Debug)]
pub struct Fixed(u64);

impl Fixed {
    /// A sequence of its own for every seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    /// The next 32 bits.
    pub fn bits(&mut self) -> u32 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 32) as u32
    }

    /// Uniform in `low`…`high`; exact in f64.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * f64::from(self.bits()) / f64::from(u32::MAX)
    }

    /// A position (mm, rad) within the travel of every axis.
    pub fn position(&mut self, machine: &Machine) -> PerAxis {
        let mut q = PerAxis::default();
        for (q, axis) in q.iter_mut().zip(&machine.axes) {
            *q = axis.to_kinematic(self.within(axis.travel[0], axis.travel[1]));
        }
        q
    }
}

/// The text of a file of this workspace.
///
/// # Panics
/// There is no such file.
#[must_use]
pub fn read(path: &str) -> String {
    let path = format!("{}/../{path}", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// The machine of a file of this workspace.
///
/// # Panics
/// It cannot be read.
#[must_use]
pub fn machine(path: &str) -> Machine {
    Machine::from_toml(&read(path)).unwrap_or_else(|e| panic!("{path}: {e:?}"))
}

/// The errors of a file of this workspace.
///
/// # Panics
/// They cannot be read.
#[must_use]
pub fn errors(path: &str, machine: &Machine) -> ErrorModel {
    ErrorModel::from_toml(&read(path), machine).unwrap_or_else(|e| panic!("{path}: {e:?}"))
}

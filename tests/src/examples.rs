//! Machines and errors from the files of this workspace.

use crate::Fixed;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::{Machine, PerAxis};

impl Fixed {
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
/// If there is no such file.
#[must_use]
pub fn read(path: &str) -> String {
    let path = format!("{}/../{path}", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// The machine of a file of this workspace.
///
/// # Panics
/// If it cannot be read.
#[must_use]
pub fn machine(path: &str) -> Machine {
    Machine::from_toml(&read(path)).unwrap_or_else(|e| panic!("{path}: {e:?}"))
}

/// The errors of a file of this workspace.
///
/// # Panics
/// If they cannot be read.
#[must_use]
pub fn errors(path: &str, machine: &Machine) -> ErrorModel {
    ErrorModel::from_toml(&read(path), machine).unwrap_or_else(|e| panic!("{path}: {e:?}"))
}

//! Files of runs, of readings of ball-bars and of readings of displacement sensors.

pub mod displacements;
pub mod radii;
pub mod revolutions;
pub mod runs;

use std::ops::Range;
use trueaxis_model::machine::Machine;
use trueaxis_model::source::FileError;

/// Refuses a file that names another machine, at the place of the name.
///
/// # Errors
/// [`FileError`].
pub fn of_this_machine(span: Range<usize>, name: &str, machine: &Machine) -> Result<(), FileError> {
    match name == machine.name {
        true => Ok(()),
        false => Err(FileError::here(
            span,
            format!(
                "this was measured on `{name}`, the machine is `{}`",
                machine.name
            ),
            "give the machine file of this name, or correct the name if it is the same machine",
        )),
    }
}

//! Libraries with non-default capacities.

use lab_capi::{BuildCapacities, CProgram, blob, libraries};
use programs::process::{root, said};
use std::path::Path;
use std::process::Command;

/// Exactly the requirements of the blob `huron-13`.
pub const LEAST: BuildCapacities = BuildCapacities::of([5, 4, 16, 14, 0]);

/// A program built for the capacities of its library runs. A program for others is refused, and so is a blob that needs
/// more, each with the name of the capacity.
///
/// # Errors
/// If something does not build, or is not refused as expected.
pub fn check() -> Result<(), String> {
    let libraries = libraries(&LEAST)?;
    says(&libraries, &LEAST, "huron-13", "corrected")?;
    says(
        &libraries,
        &LEAST,
        "everything",
        "9 banks, of which it holds 4; 2 grids, of which it holds 0",
    )?;
    for (place, (name, _)) in LEAST.0.iter().enumerate() {
        for change in [1, -1] {
            let mut other = LEAST;
            let (_, number) = &mut other.0[place];
            let Some(changed) = number.checked_add_signed(change) else {
                continue;
            };
            *number = changed;
            let expected = format!("{name} of the header is not that of the library");
            says(&libraries, &other, "huron-13", &expected)?;
        }
    }
    println!("programs and blobs of other capacities are refused by name");
    Ok(())
}

/// Compiles the test for given capacities, and looks for a text in its output for a blob.
fn says(
    libraries: &Path,
    capacities: &BuildCapacities,
    name: &str,
    expected: &str,
) -> Result<(), String> {
    let mut program = CProgram::sanitized("gcc", "-std=c99");
    for (name, number) in capacities.0 {
        program.define(&format!("{name}={number}"));
    }
    program.sources([root().join("firmware/capi/tests/capacities.c")]);
    let program = program.link(libraries, "capacities")?;
    let said = said(Command::new(&program).arg(blob(name)))?;
    if said.status.success() && said.output.contains(expected) {
        return Ok(());
    }
    Err(format!(
        "{:?} with {name} should say `{expected}`, not `{}{}`",
        capacities.0, said.output, said.errors
    ))
}

//! Proves that trueaxis links, computes the desktop's bits and stays within its budgets on processors of controllers:
//! instructions, code and stack on a Cortex-M4F, the firmware of the boards in QEMU, and one program for every kind.

mod bench_target;
mod boards;
mod portable;

use lab_processors::cross::{CORTEX_M, Cross};
use lab_processors::hil;
use programs::Failure;
use programs::process::{root, run};
use std::process::ExitCode;

fn main() -> ExitCode {
    programs::main(|words| {
        match words {
            ["bare"] => kinematics()?,
            ["bench-target"] => bench_target::check(false)?,
            ["bench-target", "--accept"] => bench_target::check(true)?,
            ["boards"] => boards::build()?,
            ["hil", parts @ ..] => {
                programs::known(parts, &hil::parts())?;
                hil::check(parts)?;
            }
            ["portable"] => portable::check()?,
            _ => {
                return Err(Failure::arguments(
                    "bench-target takes --accept or nothing; hil names of parts; bare, boards, portable nothing",
                ));
            }
        }
        Ok(())
    })
}

/// Builds the kinematics for a target without `std` and heap: the board programs contain the whole runtime, but only
/// the parts of the kinematics that they measure.
///
/// # Errors
/// If they do not build.
fn kinematics() -> Result<(), String> {
    let manifest = root().join("shared/kinematics/Cargo.toml");
    let cross = Cross::provide(CORTEX_M)?;
    let (mut build, _) = cross.cargo("stm32f405", "build -q --no-default-features");
    run(build.arg("--manifest-path").arg(manifest))
}

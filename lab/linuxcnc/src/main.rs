//! Proves that the component corrects in the real LinuxCNC, without a screen: in `halrun`, under its motion controller,
//! with simulated machines, with a probing program, and as a package.

use lab_linuxcnc::{check, package, parts};
use programs::Failure;
use std::process::ExitCode;

fn main() -> ExitCode {
    programs::main(|words| {
        match words {
            ["check", chosen @ ..] => {
                programs::known(chosen, &parts())?;
                check(chosen)?;
            }
            ["deb"] => drop(package()?),
            _ => {
                return Err(Failure::arguments(
                    "check takes names of parts or nothing; deb takes nothing",
                ));
            }
        }
        Ok(())
    })
}

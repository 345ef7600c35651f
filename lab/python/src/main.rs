//! Proves that the wheel for Python gives what the command gives.

use std::process::ExitCode;

fn main() -> ExitCode {
    programs::main(|words| {
        programs::none(words)?;
        lab_python::check().map(drop)?;
        Ok(())
    })
}

//! Measures run times and instructions beside those of rivals, in one run; with valgrind, proves that no case of the
//! steady servo update takes much longer.

mod c_interface;
mod callgrind;
mod compile;
mod identify;
mod speed;

use programs::Failure;
use std::process::ExitCode;

fn main() -> ExitCode {
    programs::main(|words| {
        match words {
            [] => speed::run()?,
            ["compile"] => compile::run(None)?,
            ["compile", other] => compile::run(Some(other))?,
            ["identify"] => identify::run()?,
            _ => {
                return Err(Failure::arguments(
                    "bench takes compile [PROGRAM], identify or nothing",
                ));
            }
        }
        Ok(())
    })
}

//! Proves that the plugin for grblHAL corrects, with a stand-in for its interface, under sanitizers.

use lab_capi::{BLOBS, BuildCapacities, CProgram, compilers, leaves_out, libraries};
use programs::files;
use programs::process::{root, run};
use std::process::{Command, ExitCode};

/// Numbers of axes of the controllers: all but the first lack axes of some of the blobs.
const AXES: [u32; 4] = [6, 5, 4, 3];

fn main() -> ExitCode {
    programs::main(|words| {
        programs::none(words)?;
        Ok(check()?)
    })
}

/// # Errors
/// If something does not compile without warnings, or fails.
fn check() -> Result<(), String> {
    compilers("the plugin for grblHAL")?;
    let libraries = libraries(&BuildCapacities::USUAL)?;
    let folder = root().join("firmware/grblhal");
    let tests = folder.join("tests");
    let standin = tests.join("standin");
    for axes in AXES {
        let mut program = CProgram::sanitized("gcc", "-std=c99");
        program.frames();
        program.define(&format!("N_AXIS={axes}"));
        program.include(&folder);
        program.include(&standin);
        for sources in [&folder, &tests, &standin] {
            program.sources(files::list(sources, "c")?);
        }
        let program = program.link(&libraries, format!("grblhal_{axes}"))?;
        run(Command::new(program).arg(root().join(BLOBS)))?;
    }
    leaves_out("grblhal")
}

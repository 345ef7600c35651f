//! `cargo xtask grblhal`: the plugin for grblHAL with a stand-in for its interface, under sanitizers.

use crate::capi::{BLOBS, BuildCapacities, CProgram, compilers, libraries};
use crate::process::{root, run};
use crate::{files, firmware_crate};
use std::process::Command;

/// Numbers of axes of the controllers: all but the first lack axes of some of the blobs.
const AXES: [u32; 4] = [6, 5, 4, 3];

/// # Errors
/// If something does not compile without warnings, or fails.
pub fn execute() -> Result<(), String> {
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
    firmware_crate::leaves_out("grblhal")
}

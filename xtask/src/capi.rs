//! `cargo xtask capi`: the C interface as C and C++ see it, under sanitizers, and what it comes to on a
//! Cortex-M4F: no panic in reach of what a servo loop calls, no frame that is large.
//!
//! `cargo xtask install --prefix DIR`: libraries, header and pkg-config file.

mod bare;
mod build;
mod cost;
mod install;
mod sanitized;

pub use build::libraries;
pub use cost::print as cost;
pub use install::execute as install;
pub use sanitized::{Sanitized, compilers};

use crate::process::{root, run, target};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Most bytes of a stack frame.
const FRAME: u64 = 2048;
/// Blobs that are there.
pub const BLOBS: &str = "tests/golden/v1";

/// # Errors
/// What does not build, does not run, can panic, or takes too much stack.
pub fn execute() -> Result<(), String> {
    compilers("the C interface")?;
    let libraries = build::libraries()?;
    let blob = |name: &str| root().join(BLOBS).join(name).with_extension("trax");
    let first = compile("gcc", "-std=c99", "examples/first.c", &libraries)?;
    run(Command::new(&first).arg(blob("huron-13")))?;
    for standard in ["-std=c99", "-std=c11"] {
        let program = compile("gcc", standard, "examples/soft_motion.c", &libraries)?;
        for name in ["huron-13", "router-10", "everything"] {
            run(Command::new(&program).arg(blob(name)))?;
        }
    }
    let program = compile("g++", "-std=c++14", "tests/interface.cpp", &libraries)?;
    for (name, other) in [
        ("huron-13", "router-10"),
        ("everything", "huron-13"),
        ("table-head-13", "everything"),
    ] {
        run(Command::new(&program).arg(blob(name)).arg(blob(other)))?;
    }
    installed(&blob("huron-13"))?;
    bare::check()
}

/// The first example against what `install` writes: the shared library, by its name.
fn installed(blob: &Path) -> Result<(), String> {
    let prefix = target("capi").join("prefix");
    install::execute(&["--prefix", &prefix.to_string_lossy()])?;
    let program = target("capi").join("first_shared");
    run(Command::new("gcc")
        .args(["-std=c99", "-o"])
        .arg(&program)
        .arg(root().join("firmware/capi/examples/first.c"))
        .arg(format!("-I{}", prefix.join("include").display()))
        .arg(format!("-L{}", prefix.join("lib").display()))
        .arg("-ltrueaxis"))?;
    run(Command::new(program)
        .arg(blob)
        .env("LD_LIBRARY_PATH", prefix.join("lib")))
}

/// Compiles a file of `firmware/capi` under the sanitizers; the program.
fn compile(
    compiler: &'static str,
    standard: &str,
    file: &str,
    libraries: &Path,
) -> Result<PathBuf, String> {
    let source = root().join("firmware/capi").join(file);
    let name = source.file_stem().unwrap_or_default().to_owned();
    let mut program = Sanitized::new(compiler, standard);
    // What a controller is to copy; the test in C++ has all its objects in a few frames.
    if compiler == "gcc" {
        program.frames();
    }
    program.sources([source]);
    program.link(libraries, &target("capi").join(name))
}

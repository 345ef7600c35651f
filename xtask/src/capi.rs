//! `cargo xtask capi`: the C interface as used from C and C++, under sanitizers and valgrind, and its costs on a
//! Cortex-M4F: no panic reachable from calls of a servo loop, no large stack frame; flash, memory and instructions.
//!
//! `cargo xtask install --prefix DIR`: libraries, header and pkg-config file.

mod bare;
mod build;
mod c_program;
mod capacities;
mod cost;
mod install;
mod target;

pub use bare::linker;
pub use build::{BuildCapacities, arm_library, bare_library, libraries};
pub use c_program::{CProgram, compilers};
pub use cost::print as cost;
pub use install::execute as install;

use crate::packages;
use crate::process::{self, root, run};
use capacities::LEAST;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Maximum size of a stack frame, bytes.
const FRAME: u64 = 2048;
/// Existing blobs.
pub const BLOBS: &str = "tests/golden/v1";
/// Blobs for the test in C++: one, and one with other axes.
const BOTH: [(&str, &str); 3] = [
    ("huron-13", "router-10"),
    ("everything", "huron-13"),
    ("table-head-13", "everything"),
];

/// # Errors
/// If something does not build or run, can panic, or uses too much stack, constants or instructions.
pub fn execute(parts: &[&str]) -> Result<(), String> {
    match parts {
        [] => {}
        ["target"] => return target::print(),
        other => return Err(format!("capi takes `target`, not `{}`", other.join(" "))),
    }
    compilers("the C interface")?;
    capacities::check()?;
    installed()?;
    let libraries = build::libraries(&BuildCapacities::USUAL)?;
    let first = compile("gcc", "-std=c99", "examples/first.c", &libraries)?;
    run(Command::new(&first).arg(blob("huron-13")))?;
    for standard in ["-std=c99", "-std=c11"] {
        let program = compile("gcc", standard, "examples/soft_motion.c", &libraries)?;
        for name in ["huron-13", "router-10", "everything"] {
            run(Command::new(&program).arg(blob(name)))?;
        }
    }
    let program = compile("g++", "-std=c++14", "tests/interface.cpp", &libraries)?;
    for (name, other) in BOTH {
        run(Command::new(&program).arg(blob(name)).arg(blob(other)))?;
    }
    memcheck(&libraries)?;
    bare::check()?;
    target::print()
}

/// Path of an existing blob.
fn blob(name: &str) -> PathBuf {
    root().join(BLOBS).join(name).with_extension("trax")
}

/// Runs the test in C++ under valgrind as well: nothing depends on uninitialised bytes. The memory of its objects comes
/// from the heap uninitialised.
fn memcheck(libraries: &Path) -> Result<(), String> {
    packages::provide("valgrind", &["valgrind", "libc6-dbg"], "the C interface")?;
    let mut program = CProgram::plain("g++", &["-std=c++14", "-g", "-O1"]);
    program.sources([root().join("firmware/capi/tests/interface.cpp")]);
    let program = program.link(libraries, "interface_plain")?;
    for (name, other) in BOTH {
        run(Command::new("valgrind")
            .args(["-q", "--error-exitcode=1"])
            .arg(&program)
            .args([blob(name), blob(other)]))?;
    }
    Ok(())
}

/// The first example with the result of `install`: the shared library, by its name; with other capacities, which are
/// also in the header.
fn installed() -> Result<(), String> {
    let prefix = process::target("capi").join("prefix");
    let shown = prefix.to_string_lossy();
    let mut options = vec!["--prefix".to_owned(), shown.into_owned()];
    for (name, number) in LEAST.0 {
        options.extend([build::option(name), number.to_string()]);
    }
    let options: Vec<&str> = options.iter().map(String::as_str).collect();
    install::execute(&options)?;
    let program = process::target("capi").join("first_shared");
    run(Command::new("gcc")
        .args(["-std=c99", "-o"])
        .arg(&program)
        .arg(root().join("firmware/capi/examples/first.c"))
        .arg(format!("-I{}", prefix.join("include").display()))
        .arg(format!("-L{}", prefix.join("lib").display()))
        .arg("-ltrueaxis"))?;
    run(Command::new(program)
        .arg(blob("huron-13"))
        .env("LD_LIBRARY_PATH", prefix.join("lib")))
}

/// Compiles a file of `firmware/capi` with the sanitizers; returns the program.
fn compile(
    compiler: &'static str,
    standard: &str,
    file: &str,
    libraries: &Path,
) -> Result<PathBuf, String> {
    let source = root().join("firmware/capi").join(file);
    let name = source.file_stem().unwrap_or_default().to_owned();
    let mut program = CProgram::sanitized(compiler, standard);
    // Only code that a controller copies; the test in C++ has all its objects in a few frames.
    if compiler == "gcc" {
        program.frames();
    }
    program.sources([source]);
    program.link(libraries, name)
}

//! Proves that the C interface works from C and C++, under sanitizers and valgrind, and what it costs on a Cortex-M4F:
//! no panic reachable from calls of a servo loop, no large stack frame; flash, memory and instructions.

mod capacities;
mod cortex;
mod servo_loop;

use capacities::LEAST;
use lab_capi::{BuildCapacities, CProgram, blob, compilers, install, libraries};
use programs::process::{root, run, target};
use programs::{Failure, packages};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

/// Blobs for the test in C++: one, and one with other axes.
const BOTH: [(&str, &str); 3] = [
    ("huron-13", "router-10"),
    ("everything", "huron-13"),
    ("table-head-13", "everything"),
];

fn main() -> ExitCode {
    programs::main(|words| {
        match words {
            ["capi"] => check()?,
            ["capi", "target"] => cortex::print()?,
            ["install", options @ ..] => {
                let (prefix, capacities) = destination(options).map_err(Failure::Arguments)?;
                install::below(prefix, &capacities)?;
            }
            _ => {
                return Err(Failure::arguments(
                    "capi takes `target` or nothing; install takes --prefix DIR",
                ));
            }
        }
        Ok(())
    })
}

/// Where to install, and the capacities.
fn destination<'o>(options: &[&'o str]) -> Result<(&'o Path, BuildCapacities), String> {
    let (mut prefix, mut capacities) = (None, BuildCapacities::USUAL);
    for pair in options.chunks(2) {
        match pair {
            ["--prefix", folder] => prefix = Some(Path::new(*folder)),
            [option, number] => capacities.set(option, number)?,
            _ => return Err(format!("{} takes a value", pair.concat())),
        }
    }
    let prefix = prefix.ok_or(
        "install takes --prefix DIR: libraries go to DIR/lib, the header to DIR/include; and \
         how much the library is to hold: --axes, --banks, --tables, --terms, --grids",
    )?;
    Ok((prefix, capacities))
}

fn check() -> Result<(), String> {
    compilers("the C interface")?;
    capacities::check()?;
    installed()?;
    let libraries = libraries(&BuildCapacities::USUAL)?;
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
    servo_loop::check()?;
    cortex::print()
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
    let prefix = target("capi").join("prefix");
    install::below(&prefix, &LEAST)?;
    let program = target("capi").join("first_shared");
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

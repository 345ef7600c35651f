//! The wheel, built and tested beside the command in an environment of its own.

use lab_systems::TestedSystem;
use programs::process::{NOT_RUN, output, root, run, target};
use programs::{python, trueaxis};
use std::path::{Path, PathBuf};
use std::process::Command;

/// What the environment needs: the builder, and what tests and example use.
const PACKAGES: [&str; 4] = ["maturin[zig]>=1.8,<2", "numpy", "matplotlib", "pytest"];

/// Libraries that Windows and every CPython have.
const USUAL: [&str; 5] = [
    "KERNEL32.dll",
    "msvcrt.dll",
    "ntdll.dll",
    "python3.dll",
    "bcryptprimitives.dll",
];

/// Builds and tests it; returns its path, unless its environment cannot be made here.
///
/// # Errors
/// If the wheel cannot be built, or a test fails.
pub fn check() -> Result<Option<PathBuf>, String> {
    let folder = target("python");
    let Some(python) = environment(&folder) else {
        return Ok(None);
    };
    // Zig links against a glibc as old as Rust's own library allows.
    let wheel = wheel(
        &folder,
        &python,
        &["--zig", "--compatibility", "manylinux2014"],
    )?;
    run(python::install(&python)
        .args(["--force-reinstall", "--no-deps"])
        .arg(&wheel))?;
    run(Command::new(&python)
        .args(["-m", "pytest", "-q", "-p", "no:cacheprovider"])
        .arg(root().join("python/tests"))
        .env("TRUEAXIS", trueaxis::build()?)
        .env("ARENA", trueaxis::arena().get_program())
        .current_dir(&folder))?;
    println!("{}", wheel.display());
    Ok(Some(wheel))
}

/// The wheel for Windows, which only needs what Windows and every CPython have; it is not run. `None` if its
/// environment cannot be made here.
///
/// # Errors
/// If it cannot be built, or needs another library.
pub fn for_windows() -> Result<Option<PathBuf>, String> {
    let folder = target("python");
    let Some(python) = environment(&folder) else {
        return Ok(None);
    };
    let system = TestedSystem::Windows;
    system.provide()?;
    let wheel = wheel(&folder, &python, &["--target", system.target()])?;
    let module = folder
        .join(system.target())
        .join("release/trueaxis_native.dll");
    let mut objdump = Command::new("x86_64-w64-mingw32-objdump");
    let parts = output(objdump.arg("-p").arg(module))?;
    let libraries = parts
        .lines()
        .filter_map(|l| l.trim().strip_prefix("DLL Name: "));
    let is_usual = |name: &&str| USUAL.contains(name) || name.starts_with("api-ms-win-core-");
    let others: Vec<&str> = libraries.filter(|name| !is_usual(name)).collect();
    match others.is_empty() {
        true => Ok(Some(wheel)),
        false => Err(format!("the wheel for Windows needs {}", others.join(", "))),
    }
}

/// The Python with what the wheel is built and tested with; `None`, with a reason printed, if it cannot be made here.
fn environment(folder: &Path) -> Option<PathBuf> {
    let modules = "maturin, ziglang, numpy, matplotlib, pytest";
    let found = python::environment(&folder.join("environment"), modules, &PACKAGES);
    if found.is_none() {
        eprintln!(
            "{NOT_RUN}the wheel for Python: python3 with venv, or {} could not be installed",
            PACKAGES.join(", ")
        );
    }
    found
}

/// The wheel with nothing but what it declares, in an environment of its own: it compiles `example`, a machine and its
/// errors, and evaluates the tables.
///
/// # Errors
/// If it cannot be installed, or does not.
pub fn alone(wheel: &Path, example: &[&str]) -> Result<(), String> {
    let environment = target("python").join("alone");
    run(Command::new("python3")
        .args(["-m", "venv", "--clear"])
        .arg(&environment))?;
    let python = environment.join("bin/python");
    run(python::install(&python).arg(wheel))?;
    let files = example.iter().map(|name| root().join(name));
    run(Command::new(&python)
        .arg(root().join("python/examples/speed.py"))
        .args(files)
        .current_dir(&environment))
}

/// Builds the wheel for a system; returns its path.
fn wheel(folder: &Path, python: &Path, system: &[&str]) -> Result<PathBuf, String> {
    let wheels = folder.join("wheels");
    let _ = std::fs::remove_dir_all(&wheels);
    // maturin asks the first Python on the path for zig.
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let own = python.parent().map(Path::to_owned).into_iter();
    let paths = std::env::join_paths(own.chain(std::env::split_paths(&paths)))
        .map_err(|e| format!("PATH: {e}"))?;
    run(Command::new(python)
        .args(["-m", "maturin", "build", "--release", "-q", "--locked"])
        .args(system)
        .arg("-o")
        .arg(&wheels)
        .current_dir(root().join("python"))
        .env("PATH", paths)
        .env("CARGO_TARGET_DIR", folder))?;
    let entries = std::fs::read_dir(&wheels).map_err(|e| format!("{}: {e}", wheels.display()))?;
    let mut paths = entries.filter_map(|entry| entry.ok().map(|entry| entry.path()));
    let wheel = paths.find(|path| path.extension().is_some_and(|e| e == "whl"));
    wheel.ok_or_else(|| format!("{}: there is no wheel", wheels.display()))
}

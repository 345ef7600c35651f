//! `cargo xtask python`: the wheel, built and tested beside the command in an environment of its own.

use crate::process::{NOT_RUN, arena, root, run, target, trueaxis, works};
use std::path::{Path, PathBuf};
use std::process::Command;

/// What the environment needs: the builder, and what tests and example use.
const PACKAGES: [&str; 4] = ["maturin[zig]>=1.8,<2", "numpy", "matplotlib", "pytest"];

/// Returns the path of the wheel, unless its environment cannot be made here.
///
/// # Errors
/// If the wheel cannot be built, or a test fails.
pub fn execute() -> Result<Option<PathBuf>, String> {
    let folder = target("python");
    let environment = folder.join("environment");
    let python = environment.join("bin/python");
    if !works(
        Command::new(&python).args(["-c", "import maturin, ziglang, numpy, matplotlib, pytest"]),
    ) {
        let made = works(
            Command::new("python3")
                .args(["-m", "venv"])
                .arg(&environment),
        ) && works(pip(&python).args(PACKAGES));
        if !made {
            eprintln!(
                "{NOT_RUN}the wheel for Python: python3 with venv, or {} could not be installed",
                PACKAGES.join(", ")
            );
            return Ok(None);
        }
    }
    let wheel = wheel(&folder, &python)?;
    run(pip(&python)
        .args(["--force-reinstall", "--no-deps"])
        .arg(&wheel))?;
    run(Command::new(&python)
        .args(["-m", "pytest", "-q", "-p", "no:cacheprovider"])
        .arg(root().join("python/tests"))
        .env("TRUEAXIS", trueaxis()?)
        .env("ARENA", arena().get_program())
        .current_dir(&folder))?;
    println!("{}", wheel.display());
    Ok(Some(wheel))
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
    run(pip(&python).arg(wheel))?;
    let files = example.iter().map(|name| root().join(name));
    run(Command::new(&python)
        .arg(root().join("python/examples/speed.py"))
        .args(files)
        .current_dir(&environment))
}

fn pip(python: &PathBuf) -> Command {
    let mut command = Command::new(python);
    command.args(["-m", "pip", "install", "-q"]);
    command
}

/// Builds the wheel for Linux with glibc 2.17 or later, as old as Rust's own library allows; returns its path. Zig links
/// against such an old one.
fn wheel(folder: &PathBuf, python: &PathBuf) -> Result<PathBuf, String> {
    let wheels = folder.join("wheels");
    let _ = std::fs::remove_dir_all(&wheels);
    // maturin asks the first Python on the path for zig.
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let own = python.parent().map(Path::to_owned).into_iter();
    let paths = std::env::join_paths(own.chain(std::env::split_paths(&paths)))
        .map_err(|e| format!("PATH: {e}"))?;
    run(Command::new(python)
        .args([
            "-m",
            "maturin",
            "build",
            "--release",
            "-q",
            "--locked",
            "--zig",
            "--compatibility",
            "manylinux2014",
            "-o",
        ])
        .arg(&wheels)
        .current_dir(root().join("python"))
        .env("PATH", paths)
        .env("CARGO_TARGET_DIR", folder))?;
    let entries = std::fs::read_dir(&wheels).map_err(|e| format!("{}: {e}", wheels.display()))?;
    let mut paths = entries.filter_map(|entry| entry.ok().map(|entry| entry.path()));
    let wheel = paths.find(|path| path.extension().is_some_and(|e| e == "whl"));
    wheel.ok_or_else(|| format!("{}: there is no wheel", wheels.display()))
}

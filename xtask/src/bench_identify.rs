//! `cargo xtask bench identify`: how long an identification takes, beside SciPy on the same problems in one run.

use crate::process::{self, cargo, root, target, works};
use std::process::Command;

/// One thread each.
const ONE_THREAD: [&str; 4] = [
    "RAYON_NUM_THREADS",
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
];

/// # Errors
/// What does not build or run; a rival that finds another minimum.
pub fn run() -> Result<(), String> {
    let folder = target("identify-speed");
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let python = python(&folder)?;
    let program = ["run", "-q", "--release", "-p", "trueaxis-tests"];
    let mut ours = cargo();
    ours.args(program)
        .args(["--example", "identify-speed", "--"])
        .arg(&folder);
    let mut rival = Command::new(python);
    rival
        .arg(root().join("tests/benches/identify/rival.py"))
        .args([folder.join("100.json"), folder.join("300.json")]);
    for command in [&mut ours, &mut rival] {
        process::run(command.envs(ONE_THREAD.map(|name| (name, "1"))))?;
    }
    Ok(())
}

/// A Python with NumPy and SciPy, in an environment of its own.
fn python(folder: &std::path::Path) -> Result<std::path::PathBuf, String> {
    let environment = folder.join("python");
    let python = environment.join("bin/python");
    if works(Command::new(&python).args(["-c", "import numpy, scipy"])) {
        return Ok(python);
    }
    process::run(
        Command::new("python3")
            .args(["-m", "venv"])
            .arg(&environment),
    )?;
    process::run(Command::new(&python).args(["-m", "pip", "install", "-q", "numpy", "scipy"]))?;
    Ok(python)
}

//! Duration of an identification, compared with SciPy on the same problems in one run.

use programs::process::{self, cargo, root, target, works};
use programs::{files, packages, python};
use std::path::{Path, PathBuf};
use std::process::Command;

const WHAT_FOR: &str = "the rival of `bench identify`";

/// Restricts each to one thread.
const ONE_THREAD: [&str; 4] = [
    "RAYON_NUM_THREADS",
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
];

/// # Errors
/// If something does not build or run, or a rival finds another minimum.
pub fn run() -> Result<(), String> {
    let folder = files::folder(target("identify-speed"))?;
    let python = with_scipy(&folder)?;
    let program = ["run", "-q", "--profile", "dist", "-p", "trueaxis-tests"];
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

/// A Python with NumPy and SciPy: from its own environment, or else that of the distribution.
fn with_scipy(folder: &Path) -> Result<PathBuf, String> {
    let has = |python: &Path, modules: &str| {
        works(Command::new(python).args(["-c", &format!("import {modules}")]))
    };
    let environment = folder.join("python");
    let usual = PathBuf::from("python3");
    let known = [environment.join("bin/python"), usual.clone()];
    let is_there = |python: &PathBuf| has(python, "numpy, scipy");
    if let Some(python) = known.into_iter().find(is_there) {
        return Ok(python);
    }
    if !has(&usual, "ensurepip, venv") {
        packages::install(&["python3", "python3-venv"], WHAT_FOR)?;
    }
    if let Some(own) = python::environment(&environment, "numpy, scipy", &["numpy", "scipy"]) {
        return Ok(own);
    }
    // That of the distribution, even if another python3 is installed.
    packages::install(&["python3-scipy"], WHAT_FOR)?;
    Ok(PathBuf::from("/usr/bin/python3"))
}

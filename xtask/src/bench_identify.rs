//! `cargo xtask bench identify`: duration of an identification, compared with SciPy on the same problems in one run.

use crate::process::{self, cargo, root, target, works};
use crate::{files, packages};
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
    let python = python(&folder)?;
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
fn python(folder: &Path) -> Result<PathBuf, String> {
    let environment = folder.join("python");
    let own = environment.join("bin/python");
    let usual = PathBuf::from("python3");
    let has = |python: &Path, modules: &str| {
        works(Command::new(python).args(["-c", &format!("import {modules}")]))
    };
    let is_there = |python: &&PathBuf| has(python, "numpy, scipy");
    if let Some(python) = [&own, &usual].into_iter().find(is_there) {
        return Ok(python.clone());
    }
    if !has(&usual, "ensurepip, venv") {
        packages::install(&["python3", "python3-venv"], WHAT_FOR)?;
    }
    // An incomplete environment is recreated.
    let mut venv = Command::new(&usual);
    venv.args(["-m", "venv", "--clear"]).arg(&environment);
    let mut pip = Command::new(&own);
    pip.args(["-m", "pip", "install", "-q", "--disable-pip-version-check"])
        .args(["numpy", "scipy"]);
    match process::run(&mut venv).and_then(|()| process::run(&mut pip)) {
        Ok(()) => Ok(own),
        Err(error) => {
            eprintln!("{error}");
            // That of the distribution, even if another python3 is installed.
            packages::install(&["python3-scipy"], WHAT_FOR)?;
            Ok(PathBuf::from("/usr/bin/python3"))
        }
    }
}

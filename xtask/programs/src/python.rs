//! Environments of Python.

use crate::process::works;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The Python of an environment in this folder that has `modules`, for which `packages` are installed; `None` if it
/// cannot be made here.
pub fn environment(folder: &Path, modules: &str, packages: &[&str]) -> Option<PathBuf> {
    let python = folder.join("bin/python");
    if works(Command::new(&python).args(["-c", &format!("import {modules}")])) {
        return Some(python);
    }
    // An incomplete environment is made again.
    let mut venv = Command::new("python3");
    venv.args(["-m", "venv", "--clear"]).arg(folder);
    let is_made =
        works(&mut venv) && (packages.is_empty() || works(install(&python).args(packages)));
    is_made.then_some(python)
}

/// The command that installs packages in the environment of this Python.
pub fn install(python: &Path) -> Command {
    let mut command = Command::new(python);
    command.args(["-m", "pip", "install", "-q", "--disable-pip-version-check"]);
    command
}

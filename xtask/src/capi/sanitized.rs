//! Programs in C and C++ that are compiled without a warning and run under sanitizers.

use super::FRAME;
use crate::packages;
use crate::process::{root, run, works};
use std::path::{Path, PathBuf};
use std::process::Command;

/// What they are compiled with.
const WARNINGS: [&str; 4] = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"];

/// Installs the compilers if they are missing.
///
/// # Errors
/// They cannot be installed.
pub fn compilers(what_for: &str) -> Result<(), String> {
    for program in ["gcc", "g++"] {
        if !works(Command::new(program).arg("--version")) {
            packages::install(&["gcc", "g++", "libc6-dev"], what_for)?;
        }
    }
    Ok(())
}

/// A program over the C interface, under the address and undefined-behaviour sanitizers.
pub struct Sanitized {
    command: Command,
}

impl Sanitized {
    pub fn new(compiler: &str, standard: &str) -> Self {
        let mut command = Command::new(compiler);
        command
            .arg(standard)
            .args(WARNINGS)
            .args([
                "-g",
                "-O1",
                "-fsanitize=address,undefined",
                "-fno-sanitize-recover=all",
            ])
            .arg(format!("-I{}", root().join("firmware/capi").display()));
        Self { command }
    }

    /// No stack frame is larger than one of the library.
    pub fn frames(&mut self) {
        self.command.arg(format!("-Wframe-larger-than={FRAME}"));
    }

    pub fn define(&mut self, definition: &str) {
        self.command.arg(format!("-D{definition}"));
    }

    pub fn include(&mut self, folder: &Path) {
        self.command.arg(format!("-I{}", folder.display()));
    }

    pub fn sources(&mut self, files: impl IntoIterator<Item = PathBuf>) {
        self.command.args(files);
    }

    /// Links it with the library that is in a folder; the program.
    ///
    /// # Errors
    /// It does not compile, or not without a warning.
    pub fn link(mut self, libraries: &Path, program: &Path) -> Result<PathBuf, String> {
        self.command
            .arg(libraries.join("libtrueaxis_capi.a"))
            .args(["-lpthread", "-ldl", "-lm", "-o"])
            .arg(program);
        run(&mut self.command).map(|()| program.to_path_buf())
    }
}

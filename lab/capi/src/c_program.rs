//! Programs in C and C++ that use the C interface.

use programs::packages;
use programs::process::{root, run, target};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Maximum size of a stack frame, bytes.
pub const FRAME: u64 = 2048;

/// Flags for compiling without warnings and running with the address and undefined-behaviour sanitizers.
const SANITIZED: [&str; 8] = [
    "-Wall",
    "-Wextra",
    "-Wpedantic",
    "-Werror",
    "-g",
    "-O1",
    "-fsanitize=address,undefined",
    "-fno-sanitize-recover=all",
];

/// Installs the compilers if they are missing.
///
/// # Errors
/// If they cannot be installed.
pub fn compilers(what_for: &str) -> Result<(), String> {
    for program in ["gcc", "g++"] {
        packages::provide(program, &["gcc", "g++", "libc6-dev"], what_for)?;
    }
    Ok(())
}

/// A program that uses the C interface.
pub struct CProgram {
    command: Command,
}

impl CProgram {
    /// Without sanitizers.
    pub fn plain(compiler: &str, flags: &[&str]) -> Self {
        let mut command = Command::new(compiler);
        command.args(flags);
        let mut program = Self { command };
        program.include(&root().join("firmware/capi"));
        program
    }

    /// With the address and undefined-behaviour sanitizers.
    pub fn sanitized(compiler: &str, standard: &str) -> Self {
        let mut program = Self::plain(compiler, &[standard]);
        program.command.args(SANITIZED);
        program
    }

    /// Limits stack frames to the size permitted for the library.
    pub fn frames(&mut self) {
        self.command.arg(format!("-Wframe-larger-than={FRAME}"));
    }

    /// Defines a macro: `NAME=VALUE`.
    pub fn define(&mut self, definition: &str) {
        self.command.arg(format!("-D{definition}"));
    }

    /// Adds a folder of headers.
    pub fn include(&mut self, folder: &Path) {
        self.command.arg(format!("-I{}", folder.display()));
    }

    /// Adds files to compile.
    pub fn sources(&mut self, files: impl IntoIterator<Item = PathBuf>) {
        self.command.args(files);
    }

    /// Links it with the library in a folder; returns the program with this name.
    ///
    /// # Errors
    /// If it does not compile.
    pub fn link(mut self, libraries: &Path, name: impl AsRef<Path>) -> Result<PathBuf, String> {
        let program = target("capi").join(name);
        self.command
            .arg(libraries.join("libtrueaxis_capi.a"))
            .args(["-lpthread", "-ldl", "-lm", "-o"])
            .arg(&program);
        run(&mut self.command).map(|()| program)
    }
}

//! Processes, and where they run.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::thread::ScopedJoinHandle;

/// The root of the workspace.
pub fn root() -> PathBuf {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    manifest.ancestors().nth(2).unwrap_or(manifest).into()
}

/// Target folder of builds that must not mix with the default one.
pub fn target(name: &str) -> PathBuf {
    let usual =
        std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from);
    usual.join(name)
}

/// The cargo that started this, in the root of the workspace.
pub fn cargo() -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root());
    command
}

/// The cargo of a toolchain, in the root of the workspace; it does not start if there is none.
pub fn cargo_of(toolchain: &str) -> Command {
    let mut command = Command::new("cargo");
    // These variables would prevent the proxy from selecting the toolchain.
    command.env_remove("CARGO").env_remove("RUSTUP_TOOLCHAIN");
    command.current_dir(root()).arg(format!("+{toolchain}"));
    command
}

/// True if a program starts and succeeds, silently.
pub fn works(command: &mut Command) -> bool {
    let status = command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    status.is_ok_and(|s| s.success())
}

/// True if there is a program with this name that reports its version.
pub fn has(program: &str) -> bool {
    works(Command::new(program).arg("--version"))
}

/// True if there is a program with this name, which may not report its version.
pub fn is_there(program: &str) -> bool {
    works(Command::new("sh").args(["-c", "command -v \"$0\"", program]))
}

/// True if this runs as root.
pub fn is_root() -> bool {
    works(Command::new("sh").args(["-c", "test $(id -u) = 0"]))
}

/// Output of a program, and its exit status.
pub struct Said {
    /// How it ended.
    pub status: ExitStatus,
    /// Standard output.
    pub output: String,
    /// Standard error.
    pub errors: String,
}

/// Runs a program without input to its end, whether it succeeds or not.
///
/// # Errors
/// If it does not start.
pub fn said(command: &mut Command) -> Result<Said, String> {
    let done = command.stdin(Stdio::null()).output();
    let done = done.map_err(|error| format!("`{}` does not start: {error}", shown(command)))?;
    Ok(Said {
        status: done.status,
        output: String::from_utf8_lossy(&done.stdout).into_owned(),
        errors: String::from_utf8_lossy(&done.stderr).into_owned(),
    })
}

/// Runs a program without input: its standard output.
///
/// # Errors
/// If it does not start, or does not succeed; the message contains its standard error.
pub fn output(command: &mut Command) -> Result<String, String> {
    let said = said(command)?;
    if said.status.success() {
        return Ok(said.output);
    }
    let (shown, errors) = (shown(command), said.errors.trim_end());
    Err(format!("`{shown}`: {}\n{errors}", said.status))
}

/// The result of a thread; a panic is an error.
pub fn joined<T>(thread: ScopedJoinHandle<'_, Result<T, String>>) -> Result<T, String> {
    let done = thread.join();
    done.unwrap_or_else(|_| Err("a thread has panicked".to_owned()))
}

/// Fails if there are any problems.
pub fn judged(wrong: &[String]) -> Result<(), String> {
    match wrong {
        [] => Ok(()),
        wrong => Err(wrong.join("\n  ")),
    }
}

/// Runs a program with its output shown.
///
/// # Errors
/// If it does not start, or does not succeed; the message shows the command.
pub fn run(command: &mut Command) -> Result<(), String> {
    let shown = shown(command);
    eprintln!("$ {shown}");
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("`{shown}`: {status}")),
        Err(error) => Err(format!("`{shown}` does not start: {error}")),
    }
}

/// Prefix of a line on standard error that names a check that could not be run.
pub const NOT_RUN: &str = "NOT RUN: ";

/// The words of a command, with the variables that it sets.
pub fn shown(command: &Command) -> String {
    let program = Path::new(command.get_program());
    let name = program.file_name().unwrap_or(program.as_os_str());
    let variables = command.get_envs().filter_map(|(key, value)| {
        Some(format!(
            "{}={:?}",
            key.to_string_lossy(),
            value?.to_string_lossy()
        ))
    });
    let words = std::iter::once(name)
        .chain(command.get_args())
        .map(|w| w.to_string_lossy().into_owned());
    variables.chain(words).collect::<Vec<_>>().join(" ")
}

//! Programs that the commands start.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The root of the workspace.
pub fn root() -> PathBuf {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    manifest.parent().unwrap_or(manifest).to_path_buf()
}

/// Where builds go that must not mix with the usual one.
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

/// Builds the command `trueaxis`, of the usual profile: its place.
///
/// # Errors
/// It does not build.
pub fn trueaxis() -> Result<PathBuf, String> {
    // All that the commands need from the workspace, in one: cargo chooses the features of dependencies by what
    // is built, and with an example among it they are those of `cargo test --workspace`. Otherwise half of them
    // would be built once more.
    let programs = ["--bin", "trueaxis", "--bin", "hil", "--example", BLOBS];
    run(cargo().args(["build", "-q", "--workspace"]).args(programs))?;
    Ok(target("debug").join("trueaxis"))
}

/// The example that makes blobs for `bench-target`.
const BLOBS: &str = "bench-blobs";

/// True if a program starts and succeeds, silently.
pub fn works(command: &mut Command) -> bool {
    let status = command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    status.is_ok_and(|s| s.success())
}

/// Runs a program with its output shown.
///
/// # Errors
/// It does not start, or does not succeed; the message shows the command.
pub fn run(command: &mut Command) -> Result<(), String> {
    let shown = shown(command);
    eprintln!("$ {shown}");
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("`{shown}`: {status}")),
        Err(error) => Err(format!("`{shown}` does not start: {error}")),
    }
}

/// A subcommand of cargo that comes as a package: installs it if it is missing.
///
/// # Errors
/// The installation fails.
pub fn provide(package: &str) -> Result<(), String> {
    let subcommand = package.trim_start_matches("cargo-");
    if works(cargo().args([subcommand, "--version"])) {
        return Ok(());
    }
    eprintln!("{package} is not installed: building it, once (a few minutes)");
    // Beside the other builds, so that an interrupted one is continued.
    run(cargo()
        .args(["install", package, "--locked"])
        .env("CARGO_TARGET_DIR", target("tools")))
}

fn shown(command: &Command) -> String {
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

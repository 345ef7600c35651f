//! Programs that the commands start.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::{self, ScopedJoinHandle};
use std::time::{Duration, Instant};

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
    let programs = ["trueaxis", "hil"].map(|name| ["--bin", name]);
    let examples = EXAMPLES.map(|name| ["--example", name]);
    run(cargo()
        .args(["build", "-q", "--workspace"])
        .args(programs.as_flattened())
        .args(examples.as_flattened()))?;
    Ok(target("debug").join("trueaxis"))
}

/// Examples that are built with it: what makes blobs for `bench-target`, moves through programs for `gcode`, and
/// compiles for machines nobody drew.
const EXAMPLES: [&str; 3] = ["bench-blobs", "gcode_moves", "random-machines"];

/// An example, which [`trueaxis`] has built.
pub fn example(name: &str) -> Command {
    Command::new(target("debug").join("examples").join(name))
}

/// Builds the command `trueaxis` as it is shipped: its place.
///
/// # Errors
/// It does not build.
pub fn shipped_trueaxis() -> Result<PathBuf, String> {
    let words = "build -q --profile dist -p trueaxis-cli --bin trueaxis";
    run(cargo().args(words.split(' ')))?;
    Ok(target("dist").join("trueaxis"))
}

/// The cargo of the nightly toolchain, in the root of the workspace; it does not start where there is none.
pub fn nightly() -> Command {
    let mut command = Command::new("cargo");
    // The variables would keep the proxy from choosing the toolchain.
    command.env_remove("CARGO").env_remove("RUSTUP_TOOLCHAIN");
    command.current_dir(root()).arg("+nightly");
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

/// True if there is a program of this name that says its version.
pub fn has(program: &str) -> bool {
    works(Command::new(program).arg("--version"))
}

/// True if this runs as root.
pub fn is_root() -> bool {
    works(Command::new("sh").args(["-c", "test $(id -u) = 0"]))
}

/// What a program wrote, and how it ended.
pub struct Said {
    pub status: ExitStatus,
    pub output: String,
    pub errors: String,
}

/// Runs a program without input to its end, whether it succeeds or not.
///
/// # Errors
/// It does not start.
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
/// It does not start, or does not succeed; the message has its standard error.
pub fn output(command: &mut Command) -> Result<String, String> {
    let said = said(command)?;
    if said.status.success() {
        return Ok(said.output);
    }
    let (shown, errors) = (shown(command), said.errors.trim_end());
    Err(format!("`{shown}`: {}\n{errors}", said.status))
}

/// What a thread returns; that it has panicked is an error.
pub fn joined<T>(thread: ScopedJoinHandle<'_, Result<T, String>>) -> Result<T, String> {
    let done = thread.join();
    done.unwrap_or_else(|_| Err("a thread has panicked".to_owned()))
}

/// An error if anything is wrong.
pub fn judged(wrong: &[String]) -> Result<(), String> {
    match wrong {
        [] => Ok(()),
        wrong => Err(wrong.join("\n  ")),
    }
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

/// How a line of standard error begins that names what could not be checked here.
pub const NOT_RUN: &str = "NOT RUN: ";

/// The same, with the last lines of its standard error in the message, too. Returns those of its lines that
/// begin with [`NOT_RUN`].
///
/// # Errors
/// See [`run`].
pub fn run_keeping(command: &mut Command, lines: usize) -> Result<Vec<String>, String> {
    let shown = shown(command);
    eprintln!("$ {shown}");
    let failed = |cause: String| format!("`{shown}`: {cause}");
    let mut child = command
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|e| failed(format!("does not start: {e}")))?;
    let last = Arc::new(Mutex::new(VecDeque::new()));
    let not_run = Arc::new(Mutex::new(Vec::new()));
    let reader = child.stderr.take().map(|stderr| {
        let (last, not_run) = (Arc::clone(&last), Arc::clone(&not_run));
        thread::spawn(move || {
            for line in BufReader::new(stderr).split(b'\n').map_while(Result::ok) {
                let line = String::from_utf8_lossy(&line).into_owned();
                eprintln!("{line}");
                if let (true, Ok(mut not_run)) = (line.starts_with(NOT_RUN), not_run.lock()) {
                    not_run.push(line.clone());
                }
                if let Ok(mut last) = last.lock() {
                    last.push_back(line);
                    if last.len() > lines {
                        last.pop_front();
                    }
                }
            }
        })
    });
    let status = child.wait().map_err(|e| failed(e.to_string()))?;
    // What it has started, and not ended, may hold the pipe open: not waited for.
    let end = Instant::now() + Duration::from_secs(1);
    while reader.as_ref().is_some_and(|r| !r.is_finished()) && Instant::now() < end {
        thread::sleep(Duration::from_millis(5));
    }
    if status.success() {
        return Ok(not_run
            .lock()
            .map_or_else(|_| Vec::new(), |lines| lines.clone()));
    }
    let mut message = failed(status.to_string());
    if let Ok(last) = last.lock() {
        message.extend(last.iter().flat_map(|line| ["\n", line]));
    }
    Err(message)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_keeps_the_last_lines() {
        let mut command = Command::new("sh");
        // What is left running in the background holds the pipe.
        command.args(["-c", "echo one >&2; echo two >&2; sleep 5 & exit 3"]);
        let began = Instant::now();
        let message = run_keeping(&mut command, 1).unwrap_err();
        assert!(message.contains("exit status: 3"), "{message}");
        assert!(message.ends_with("\ntwo") && !message.contains("\none"));
        assert!(began.elapsed() < Duration::from_secs(4));
    }

    #[test]
    fn what_a_step_could_not_check_is_kept() {
        let mut command = Command::new("sh");
        command.args(["-c", "echo >&2 NOT RUN: this; echo >&2 that"]);
        let not_run = run_keeping(&mut command, 1);
        assert_eq!(not_run, Ok(vec!["NOT RUN: this".to_owned()]));
    }
}

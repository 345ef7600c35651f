//! Programs started by the commands.

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

/// Builds the command `trueaxis` with the default profile; returns its path.
///
/// # Errors
/// If it does not build.
pub fn trueaxis() -> Result<PathBuf, String> {
    // Builds everything that the commands need from the workspace together: cargo selects the features of dependencies
    // by what is built, and with an example included they match `cargo test --workspace`. Otherwise half of them would
    // be built again.
    let programs = ["trueaxis", "hil", ARENA].map(|name| ["--bin", name]);
    let examples = EXAMPLES.map(|name| ["--example", name]);
    run(cargo()
        .args(["build", "-q", "--workspace"])
        .args(programs.as_flattened())
        .args(examples.as_flattened()))?;
    Ok(target("debug").join("trueaxis"))
}

/// Examples built with it: they generate blobs for `bench-target`, move through programs for `gcode`, and compile for
/// random machines.
const EXAMPLES: [&str; 4] = [
    "bench-blobs",
    "calibration-machine",
    "gcode_moves",
    "random-machines",
];

/// The machines with hidden errors.
const ARENA: &str = "trueaxis-arena";

/// The arena, built by [`trueaxis`].
pub fn arena() -> Command {
    Command::new(target("debug").join(ARENA))
}

/// An example, built by [`trueaxis`].
pub fn example(name: &str) -> Command {
    Command::new(target("debug").join("examples").join(name))
}

/// Builds the command `trueaxis` as shipped; returns its path.
///
/// # Errors
/// If it does not build.
pub fn shipped_trueaxis() -> Result<PathBuf, String> {
    let words = "build -q --profile dist -p trueaxis-cli --bin trueaxis";
    run(cargo().args(words.split(' ')))?;
    Ok(target("dist").join("trueaxis"))
}

/// The cargo of the nightly toolchain, in the root of the workspace; it does not start if there is none.
pub fn nightly() -> Command {
    let mut command = Command::new("cargo");
    // These variables would prevent the proxy from selecting the toolchain.
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

/// True if there is a program with this name that reports its version.
pub fn has(program: &str) -> bool {
    works(Command::new(program).arg("--version"))
}

/// True if this runs as root.
pub fn is_root() -> bool {
    works(Command::new("sh").args(["-c", "test $(id -u) = 0"]))
}

/// Output of a program, and its exit status.
pub struct Said {
    pub status: ExitStatus,
    pub output: String,
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

/// Runs a command, with the last lines of its standard error in the message as well. Returns the lines that begin with
/// [`NOT_RUN`].
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
    // Processes that it started and left running may hold the pipe open, so do not wait for them.
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

/// Installs a cargo subcommand that comes as a package, if it is missing.
///
/// # Errors
/// If the installation fails.
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
        // A background process holds the pipe open.
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

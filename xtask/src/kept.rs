//! A process whose last messages are kept for a summary.

use programs::process::{NOT_RUN, shown};
use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

/// What a process says on its standard error.
#[derive(Default)]
struct Messages {
    last: VecDeque<String>,
    said: Said,
}

/// What is kept of a process that succeeds.
#[derive(Clone, Debug, Default)]
pub struct Said {
    /// Lines that begin with [`NOT_RUN`].
    pub not_run: Vec<String>,
    /// The line that was followed by the longest silence, usually the command that took longest, and its seconds.
    pub longest: (u64, String),
}

impl Messages {
    /// Shows each line; keeps the last `lines` of them.
    fn read(kept: &Mutex<Self>, from: impl Read, lines: usize) {
        let mut since = Instant::now();
        for line in BufReader::new(from).split(b'\n').map_while(Result::ok) {
            let line = String::from_utf8_lossy(&line).into_owned();
            eprintln!("{line}");
            let Ok(mut kept) = kept.lock() else { return };
            if line.starts_with(NOT_RUN) {
                kept.said.not_run.push(line.clone());
            }
            kept.was_silent(since);
            since = Instant::now();
            kept.last.push_back(line);
            if kept.last.len() > lines {
                kept.last.pop_front();
            }
        }
        if let Ok(mut kept) = kept.lock() {
            kept.was_silent(since);
        }
    }

    /// Nothing was said from then on until now.
    fn was_silent(&mut self, since: Instant) {
        let silence = since.elapsed().as_secs();
        if let Some(before) = self.last.back().filter(|_| silence > self.said.longest.0) {
            self.said.longest = (silence, before.clone());
        }
    }
}

/// Runs a command, with the last lines of its standard error in the message as well. Returns what is
/// kept of what it said.
///
/// # Errors
/// If it does not start, or does not succeed; the message shows the command.
pub fn run(command: &mut Command, lines: usize) -> Result<Said, String> {
    let shown = shown(command);
    eprintln!("$ {shown}");
    let failed = |cause: String| format!("`{shown}`: {cause}");
    let mut child = command
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|e| failed(format!("does not start: {e}")))?;
    let kept = Arc::new(Mutex::new(Messages::default()));
    let reader = child.stderr.take().map(|stderr| {
        let kept = Arc::clone(&kept);
        thread::spawn(move || Messages::read(&kept, stderr, lines))
    });
    let status = child.wait().map_err(|e| failed(e.to_string()))?;
    // Processes that it started and left running may hold the pipe open, so do not wait for them.
    let end = Instant::now() + Duration::from_secs(1);
    while reader.as_ref().is_some_and(|r| !r.is_finished()) && Instant::now() < end {
        thread::sleep(Duration::from_millis(5));
    }
    let kept = kept.lock().map_err(|e| failed(e.to_string()))?;
    if status.success() {
        return Ok(kept.said.clone());
    }
    let mut message = failed(status.to_string());
    message.extend(kept.last.iter().flat_map(|line| ["\n", line]));
    Err(message)
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
        let message = run(&mut command, 1).unwrap_err();
        assert!(message.contains("exit status: 3"), "{message}");
        assert!(message.ends_with("\ntwo") && !message.contains("\none"));
        assert!(began.elapsed() < Duration::from_secs(4));
    }

    #[test]
    fn what_a_step_could_not_check_is_kept() {
        let mut command = Command::new("sh");
        command.args(["-c", "echo >&2 NOT RUN: this; echo >&2 that"]);
        let said = run(&mut command, 1).unwrap();
        assert_eq!(said.not_run, ["NOT RUN: this"]);
    }

    #[test]
    fn the_longest_silence_has_a_name() {
        let mut command = Command::new("sh");
        command.args([
            "-c",
            "echo >&2 one; echo >&2 two; sleep 1.1; echo >&2 three",
        ]);
        let said = run(&mut command, 1).unwrap();
        assert!(said.longest.0 >= 1 && said.longest.1 == "two", "{said:?}");
    }
}

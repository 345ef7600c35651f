//! `cargo xtask test`: all checks required before a change is accepted.

use crate::kept::{self, Said};
use crate::steps::{BESIDE, DENY, FURTHER, PROVE, Step, USUAL};
use programs::Failure;
use programs::packages::{install_all, provide_subcommand};
use programs::process::{NOT_RUN, cargo_of, target, works};
use std::process::Command;
use std::thread;
use std::time::Instant;

/// A step with its command.
struct TestStep {
    name: &'static str,
    command: Command,
}

impl From<&Step> for TestStep {
    fn from(step: &Step) -> Self {
        Self {
            name: step.name,
            command: step.command(),
        }
    }
}

/// The steps of a table.
fn of(steps: &[Step]) -> Vec<TestStep> {
    steps.iter().map(TestStep::from).collect()
}

/// Number of error lines of a failed step repeated in the summary: the last ones name the cause, after what it printed.
const LINES_OF_FAILED: usize = 25;

/// Seconds of silence in a step that the summary explains.
const LONG: u64 = 60;

/// A step that has run: its name, its seconds, and what is kept of what it said.
struct Ran {
    name: String,
    seconds: u64,
    result: Result<Said, String>,
}

impl Ran {
    fn of(mut step: TestStep) -> Self {
        println!("\n== {}", step.name);
        let start = Instant::now();
        let result = kept::run(&mut step.command, LINES_OF_FAILED);
        let seconds = start.elapsed().as_secs();
        println!("== {}: {seconds} s", step.name);
        Self {
            name: step.name.to_owned(),
            seconds,
            result,
        }
    }

    /// Its lines of the summary.
    fn lines(&self) -> Vec<String> {
        let verdict = if self.result.is_ok() {
            "ok    "
        } else {
            "FAILED"
        };
        let mut lines = vec![format!("{verdict} {:>5} s  {}", self.seconds, self.name)];
        let more = match &self.result {
            Err(message) => message.clone(),
            Ok(Said { longest, .. }) if longest.0 >= LONG => {
                format!("{} s of that after: {}", longest.0, longest.1)
            }
            Ok(_) => String::new(),
        };
        lines.extend(more.lines().map(|line| format!("          {line}")));
        lines
    }
}

fn run_all(steps: Vec<TestStep>) -> Vec<Ran> {
    steps.into_iter().map(Ran::of).collect()
}

/// Runs all steps, continuing after failures, and prints a summary. Those of [`BESIDE`] run one after the other beside
/// the others of the `rest`. The summary ends with what could not be checked here: `not_run` and the steps' own
/// reports.
///
/// # Errors
/// The names of the failed steps.
fn run_steps(
    steps: Vec<TestStep>,
    rest: Vec<TestStep>,
    not_run: Vec<String>,
) -> Result<(), Failure> {
    let is_beside = |step: &TestStep| BESIDE.contains(&step.name);
    let (beside, rest): (Vec<TestStep>, Vec<TestStep>) = rest.into_iter().partition(is_beside);
    let mut all = run_all(steps);
    thread::scope(|scope| {
        let beside = scope.spawn(|| run_all(beside));
        all.extend(run_all(rest));
        all.extend(beside.join().unwrap_or_else(|_| {
            vec![Ran {
                name: BESIDE.join(", "),
                seconds: 0,
                result: Err("a thread has panicked".to_owned()),
            }]
        }));
    });
    summary(&all, not_run)
}

/// Prints what has run.
fn summary(all: &[Ran], mut not_run: Vec<String>) -> Result<(), Failure> {
    let mut failed = Vec::new();
    for ran in all {
        match &ran.result {
            Ok(said) => not_run.extend_from_slice(&said.not_run),
            Err(message) => {
                eprintln!("{message}");
                failed.push(ran.name.as_str());
            }
        }
    }
    println!("\n== summary");
    for line in all.iter().flat_map(Ran::lines).chain(not_run) {
        println!("{line}");
    }
    let count = all.len();
    match failed.is_empty() {
        true => println!("all steps passed: {count}"),
        false => {
            let (number, names) = (failed.len(), failed.join(", "));
            return Err(format!("{number} of {count} steps failed: {names}").into());
        }
    }
    Ok(())
}

/// The `unsafe` code under Miri, which needs a nightly toolchain with that component; adds it if possible.
fn miri() -> Option<TestStep> {
    let has_miri = || works(cargo_of("nightly").args(["miri", "--version"]));
    if !has_miri() {
        eprintln!("no Miri: trying rustup");
        let add = "component add --toolchain nightly miri rust-src";
        works(Command::new("rustup").args(add.split(' ')));
    }
    has_miri().then(|| {
        let mut command = cargo_of("nightly");
        let words = "miri test -q -p trueaxis --features encode --lib -- kernel::tests::every_bit \
                     kernel::tests::before_the_first";
        command
            .args(words.split(' '))
            .env("CARGO_TARGET_DIR", target("miri"));
        TestStep {
            name: "the kernel under Miri",
            command,
        }
    })
}

/// `cargo xtask test`; with `--all`, also the checks that need emulators, LinuxCNC and a browser.
///
/// # Errors
/// The names of the failed steps.
pub fn run(arguments: &[&str]) -> Result<(), Failure> {
    match arguments {
        [] => {
            let names: Vec<&str> = FURTHER.iter().map(|step| step.name).collect();
            let not_run = format!("with --all: {}, the kernel under Miri", names.join(", "));
            run_steps(of(USUAL), Vec::new(), vec![not_run])
        }
        ["--all"] => all(),
        _ => Err(Failure::arguments("test takes --all, or nothing")),
    }
}

fn all() -> Result<(), Failure> {
    // Downloads take no time of their own beside builds. A step that installs something waits for the end.
    thread::spawn(install_all);
    let steps = of(USUAL);
    let mut further = of(FURTHER);
    let mut not_run = Vec::new();
    match miri() {
        Some(step) => further.push(step),
        None => not_run.push(format!(
            "{NOT_RUN}the kernel under Miri, for which `rustup` has no nightly toolchain here"
        )),
    }
    run_steps(steps, further, not_run)
}

/// `cargo xtask prove`: what a release needs beyond `test --all`.
///
/// # Errors
/// The names of what failed.
pub fn prove(_: &[&str]) -> Result<(), Failure> {
    run_steps(of(PROVE), Vec::new(), Vec::new())
}

/// `cargo xtask deny`: installs a tool and queries the advisory database, so it is not part of `test`.
///
/// # Errors
/// The names of the failed steps.
pub fn deny(_: &[&str]) -> Result<(), Failure> {
    provide_subcommand("cargo-deny")?;
    run_steps(of(DENY), Vec::new(), Vec::new())
}

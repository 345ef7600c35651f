//! `cargo xtask test`: everything that must hold before a change is taken.

use crate::process::{self, NOT_RUN, cargo, nightly, provide, target, works};
use std::process::Command;
use std::time::Instant;

/// One thing that must hold.
struct Step {
    name: String,
    command: Command,
}

fn step(name: impl Into<String>, arguments: &str) -> Step {
    let mut command = cargo();
    command.args(arguments.split_whitespace());
    let name = name.into();
    Step { name, command }
}

fn with(mut step: Step, key: &str, value: &str) -> Step {
    step.command.env(key, value);
    step
}

/// Boards and examples whose workspaces are their own: their folders, and what they are.
const APART: [(&str, &str); 5] = [
    ("stm32f405", "the STM32F405"),
    ("stm32h743", "the STM32H743"),
    ("portable", "the program for every processor"),
    ("rtic", "the example for RTIC"),
    ("embassy", "the example for embassy"),
];
/// Of the tests only what this one needs: minutes of building less.
const IDENTICAL: &str = "test -q -p trueaxis-tests --no-default-features --test bit_identical";

/// A step that a longer one contains.
const SIX: &str = "6 random machines";

/// What runs anywhere, with nothing to install: minutes.
fn usual() -> Vec<Step> {
    let mut steps = vec![step("formatting", "fmt --all --check")];
    steps.extend(APART.map(|(folder, what)| {
        let manifest = format!("firmware/boards/{folder}/Cargo.toml");
        step(
            format!("formatting of {what}"),
            &format!("fmt --manifest-path {manifest} --all --check"),
        )
    }));
    steps.extend([
        step(
            "lints",
            "clippy -q --workspace --all-targets -- -D warnings",
        ),
        step(
            "lints of the runtime with all its features",
            "clippy -q -p trueaxis --all-features --all-targets -- -D warnings",
        ),
        // Among them the device in the loop on the desktop, and the kinematics with the sine of the platform.
        step("all tests", "test -q --workspace --no-fail-fast"),
        step("runtime without features", "test -q -p trueaxis"),
        step(
            "runtime that checks every index",
            "test -q -p trueaxis --features encode,checked",
        ),
        step(
            "kinematics with the sine of libm",
            "test -q -p trueaxis-kinematics",
        ),
        step("bit identity, debug", IDENTICAL),
        step("bit identity, release", &format!("{IDENTICAL} --release")),
        // Of three hundred, evenly, so that several kinds are among them.
        step(SIX, "xtask random-machines 6 --quick"),
        with(
            step(
                "documentation",
                "doc -q --workspace --no-deps --document-private-items",
            ),
            "RUSTDOCFLAGS",
            "-D warnings",
        ),
    ]);
    steps
}

/// What else holds, with emulators, LinuxCNC, a browser and compilers for other targets, which the steps install.
fn rest() -> Vec<Step> {
    // A further build of the workspace: its own directory, so that the usual one stays warm.
    let native = with(
        step(
            "bit identity, release for this processor",
            &format!("{IDENTICAL} --release"),
        ),
        "CARGO_TARGET_DIR",
        &target("native").to_string_lossy(),
    );
    vec![
        step(
            "runtime that encodes",
            "test -q -p trueaxis --features encode",
        ),
        step("30 random machines", "xtask random-machines 30 --quick"),
        with(native, "RUSTFLAGS", "-C target-cpu=native"),
        step("kinematics on the target", "xtask bare"),
        step(
            "C interface that catches panics",
            "test -q -p trueaxis-capi --features std,model",
        ),
        step("C interface from C and C++", "xtask capi"),
        step("plugin for grblHAL", "xtask grblhal"),
        step("LinuxCNC", "xtask linuxcnc"),
        step("generated code", "xtask generated 300000"),
        step("programs beside another interpreter", "xtask gcode"),
        step("reports in a browser", "xtask report"),
        step("examples for RTIC and embassy", "xtask boards"),
        step(
            "instructions, cycles, code and stack on the target",
            "xtask bench-target",
        ),
        step("hardware in the loop", "xtask hil"),
        step("every kind of processor", "xtask portable"),
    ]
}

/// Of what a step that failed said of errors, how many lines the summary repeats: the last ones name the cause.
const LINES_OF_FAILED: usize = 5;

/// Runs all steps, also after one has failed, and sums up; at the end stands what could not be checked here:
/// `not_run` and what the steps say of it.
///
/// # Errors
/// The names of what failed.
fn run_steps(steps: Vec<Step>, mut not_run: Vec<String>) -> Result<(), String> {
    let count = steps.len();
    let mut summary = Vec::new();
    let mut failed = Vec::new();
    for mut step in steps {
        println!("\n== {}", step.name);
        let start = Instant::now();
        let result = process::run_keeping(&mut step.command, LINES_OF_FAILED);
        let verdict = if result.is_ok() { "ok    " } else { "FAILED" };
        summary.push(format!(
            "{verdict} {:>5} s  {}",
            start.elapsed().as_secs(),
            step.name
        ));
        match result {
            Ok(lines) => not_run.extend(lines),
            Err(message) => {
                eprintln!("{message}");
                summary.extend(message.lines().map(|line| format!("          {line}")));
                failed.push(step.name.clone());
            }
        }
    }
    println!("\n== summary");
    for line in &summary {
        println!("{line}");
    }
    for line in &not_run {
        println!("{line}");
    }
    if failed.is_empty() {
        println!("all steps passed: {count}");
        Ok(())
    } else {
        Err(format!(
            "{} of {count} steps failed: {}",
            failed.len(),
            failed.join(", ")
        ))
    }
}

/// The `unsafe` code under Miri, which needs a nightly toolchain with that component; adds it if it can.
fn miri() -> Option<Step> {
    if !works(nightly().args(["miri", "--version"])) {
        eprintln!("no Miri: trying rustup");
        let add = "component add --toolchain nightly miri rust-src";
        works(Command::new("rustup").args(add.split(' ')));
    }
    works(nightly().args(["miri", "--version"])).then(|| {
        let mut command = nightly();
        let words = "miri test -q -p trueaxis --features encode --lib -- kernel::tests::every_bit kernel::tests::before_the_first";
        command
            .args(words.split(' '))
            .env("CARGO_TARGET_DIR", target("miri"));
        Step {
            name: "the kernel under Miri".to_owned(),
            command,
        }
    })
}

/// `cargo xtask test`; with `all`, what needs emulators, LinuxCNC and a browser, too.
///
/// # Errors
/// The names of what failed.
pub fn run(all: bool) -> Result<(), String> {
    let mut steps = usual();
    let mut not_run = Vec::new();
    if all {
        // These are among the thirty.
        steps.retain(|step| step.name != SIX);
        steps.extend(rest());
        match miri() {
            Some(step) => steps.push(step),
            None => not_run.push(format!(
                "{NOT_RUN}the kernel under Miri, for which `rustup` has no nightly toolchain here"
            )),
        }
    } else {
        let names: Vec<String> = rest().into_iter().map(|step| step.name).collect();
        not_run.push(format!(
            "with --all: {}, the kernel under Miri",
            names.join(", ")
        ));
    }
    run_steps(steps, not_run)
}

/// `cargo xtask deny`: installs a tool and asks the advisory database, hence no part of `test`.
///
/// # Errors
/// The names of what failed.
pub fn deny() -> Result<(), String> {
    provide("cargo-deny")?;
    let mut steps = vec![step(
        "licences, bans, sources",
        "deny --all-features check licenses bans sources",
    )];
    steps.extend(APART.map(|(folder, what)| {
        let manifest = format!("firmware/boards/{folder}/Cargo.toml");
        let features = match folder {
            "stm32f405" | "stm32h743" => "--all-features",
            _ => "",
        };
        step(
            format!("licences, bans, sources of {what}"),
            &format!("deny --manifest-path {manifest} {features} --config deny.toml check licenses bans sources"),
        )
    }));
    steps.push(step("advisories", "deny --all-features check advisories"));
    run_steps(steps, Vec::new())
}

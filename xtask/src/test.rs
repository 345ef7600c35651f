//! `cargo xtask test`: all checks required before a change is accepted.

use crate::process::{self, NOT_RUN, cargo, nightly, provide, target, works};
use std::process::Command;
use std::thread;
use std::time::Instant;

/// One check.
struct TestStep {
    name: String,
    command: Command,
}

fn step(name: impl Into<String>, arguments: &str) -> TestStep {
    let mut command = cargo();
    command.args(arguments.split_whitespace());
    let name = name.into();
    TestStep { name, command }
}

fn with(mut step: TestStep, key: &str, value: &str) -> TestStep {
    step.command.env(key, value);
    step
}

/// Boards and examples with separate workspaces: their folders, and descriptions.
const APART: [(&str, &str); 6] = [
    ("stm32f405", "the STM32F405"),
    ("stm32h743", "the STM32H743"),
    ("portable", "the program for every processor"),
    ("generated", "the example of generated code"),
    ("rtic", "the example for RTIC"),
    ("embassy", "the example for embassy"),
];
/// Only the parts needed by this test, which saves minutes of building.
const IDENTICAL: &str = "test -q -p trueaxis-tests --no-default-features --test bit_identical";

/// Tests, of which `--all` tries more cases (`usual_or_all` in the crate `trueaxis-tests`).
const TESTS: &str = "all tests";

/// Steps that mostly wait, or use one processor.
const BESIDE: [&str; 3] = [
    "LinuxCNC",
    "hardware in the loop",
    "the command for Windows",
];

/// A step included in a longer one.
const SIX: &str = "6 random machines";

/// Checks that run anywhere, with nothing to install: minutes.
fn usual() -> Vec<TestStep> {
    let mut steps = vec![step("formatting", "fmt --all --check")];
    steps.push(step(
        "formatting of the module for Python",
        "fmt --manifest-path python/Cargo.toml --check",
    ));
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
        // Includes the device in the loop on the desktop, and the kinematics with the platform's sine.
        step(
            TESTS,
            "test -q --workspace --exclude trueaxis-reproduce --no-fail-fast",
        ),
        step("bit identity, debug", IDENTICAL),
        step("bit identity, release", &format!("{IDENTICAL} --release")),
        // Evenly selected from three hundred, so that several kinds are included.
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

/// Further checks, with emulators, LinuxCNC, a browser and compilers for other targets, which the steps install.
fn rest() -> Vec<TestStep> {
    // A separate build of the workspace in its own directory, so that the default one stays warm.
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
            "lints of the runtime with all its features",
            "clippy -q -p trueaxis --all-features --all-targets -- -D warnings",
        ),
        with(
            step(
                "lints of the fuzz targets",
                "clippy -q --manifest-path fuzz/Cargo.toml --locked -- -D warnings",
            ),
            "CARGO_TARGET_DIR",
            &target("fuzz").to_string_lossy(),
        ),
        step(
            "formatting of the fuzz targets",
            "fmt --manifest-path fuzz/Cargo.toml --check",
        ),
        step("runtime without features", "test -q -p trueaxis"),
        step(
            "kinematics without features",
            "test -q -p trueaxis-kinematics",
        ),
        step(
            "runtime that checks every index",
            "test -q -p trueaxis --features encode,checked",
        ),
        step(
            "runtime that encodes",
            "test -q -p trueaxis --features encode",
        ),
        step(
            "the figures of the source document",
            "test -q -p trueaxis-reproduce --no-fail-fast",
        ),
        step("30 random machines", "xtask random-machines 30 --quick"),
        step(
            "a machine of each class of the arena",
            "xtask arena 6 --check docs/evidence",
        ),
        with(native, "RUSTFLAGS", "-C target-cpu=native"),
        step("the oldest supported compiler", "xtask oldest"),
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
        step("exports beside the firmware of printers", "xtask printers"),
        step("reports in a browser", "xtask report"),
        step("the command in browsers", "xtask web --check"),
        step("the wheel for Python", "xtask python"),
        step("examples for RTIC and embassy", "xtask boards"),
        step(
            "instructions, cycles, code and stack on the target",
            "xtask bench-target",
        ),
        step("hardware in the loop", "xtask hil"),
        step("the command for Windows", "xtask systems windows"),
        step("every kind of processor", "xtask portable"),
    ]
}

/// Number of error lines of a failed step repeated in the summary: the last ones name the cause, after what it printed.
const LINES_OF_FAILED: usize = 25;

/// A step that has run: its name, its seconds, and what it says was not run.
struct Ran {
    name: String,
    seconds: u64,
    result: Result<Vec<String>, String>,
}

fn ran(mut step: TestStep) -> Ran {
    println!("\n== {}", step.name);
    let start = Instant::now();
    let result = process::run_keeping(&mut step.command, LINES_OF_FAILED);
    Ran {
        name: step.name,
        seconds: start.elapsed().as_secs(),
        result,
    }
}

/// Runs all steps, continuing after failures, and prints a summary. Those of [`BESIDE`] run one after the other beside the
/// others of the `rest`. The summary ends with what could not be checked here: `not_run` and the steps'
/// own reports.
///
/// # Errors
/// The names of the failed steps.
fn run_steps(
    steps: Vec<TestStep>,
    rest: Vec<TestStep>,
    mut not_run: Vec<String>,
) -> Result<(), String> {
    let count = steps.len() + rest.len();
    let (beside, rest): (Vec<TestStep>, Vec<TestStep>) = rest
        .into_iter()
        .partition(|step| BESIDE.contains(&step.name.as_str()));
    let run_all = |steps: Vec<TestStep>| steps.into_iter().map(ran).collect::<Vec<Ran>>();
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
    let mut summary = Vec::new();
    let mut failed = Vec::new();
    for Ran {
        name,
        seconds,
        result,
    } in all
    {
        let verdict = if result.is_ok() { "ok    " } else { "FAILED" };
        summary.push(format!("{verdict} {seconds:>5} s  {name}"));
        match result {
            Ok(lines) => not_run.extend(lines),
            Err(message) => {
                eprintln!("{message}");
                summary.extend(message.lines().map(|line| format!("          {line}")));
                failed.push(name);
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

/// The `unsafe` code under Miri, which needs a nightly toolchain with that component; adds it if possible.
fn miri() -> Option<TestStep> {
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
        TestStep {
            name: "the kernel under Miri".to_owned(),
            command,
        }
    })
}

/// `cargo xtask test`; with `all`, also the checks that need emulators, LinuxCNC and a browser.
///
/// # Errors
/// The names of the failed steps.
pub fn run(all: bool) -> Result<(), String> {
    let mut steps = usual();
    let mut further = Vec::new();
    let mut not_run = Vec::new();
    if all {
        // These are included in the thirty.
        steps.retain(|step| step.name != SIX);
        for step in steps.iter_mut().filter(|step| step.name == TESTS) {
            step.command.env("TRUEAXIS_CASES", "all");
        }
        further = rest();
        match miri() {
            Some(step) => further.push(step),
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
    run_steps(steps, further, not_run)
}

/// `cargo xtask prove`: checks with all values there are, which take minutes.
///
/// # Errors
/// The names of what failed.
pub fn prove() -> Result<(), String> {
    let exhaustive =
        "test -q --release -p trueaxis --features encode,link,exhaustive --lib exhaustive";
    let steps = vec![
        step("every f32 and every short stream", exhaustive),
        step("generated code", "xtask generated 10000000"),
    ];
    run_steps(steps, Vec::new(), Vec::new())
}

/// `cargo xtask deny`: installs a tool and queries the advisory database, so it is not part of `test`.
///
/// # Errors
/// The names of the failed steps.
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
    steps.push(step(
        "licences, bans, sources of the module for Python",
        "deny --manifest-path python/Cargo.toml --config deny.toml check licenses bans sources",
    ));
    steps.push(step("advisories", "deny --all-features check advisories"));
    run_steps(steps, Vec::new(), Vec::new())
}

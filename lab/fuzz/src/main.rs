//! Searches for inputs that break what reads files, programs and messages: every fuzz target, or the named ones,
//! starting from real inputs.

mod seeds;

use programs::packages::provide_subcommand;
use programs::process::{cargo_of, has, root, run, target, works};
use programs::{Failure, files};
use std::process::{Command, ExitCode};

const TARGETS: [&str; 7] = [
    "decode", "evaluate", "slots", "link", "gcode", "cec", "readers",
];
/// Maximum input length, bytes: short inputs are many times faster and reach every branch.
const MAX_LEN: u64 = 2048;
/// Maximum length of programs: about ten lines.
const MAX_PROGRAM: u64 = 192;
/// Maximum length of tables and measurements: three tables of a Sinumerik, some twenty rows.
const MAX_TABLES: u64 = 1536;

/// Maximum length for targets with text inputs. Their vocabulary is in `fuzz/NAME.dict`.
fn text(name: &str) -> Option<u64> {
    match name {
        "gcode" => Some(MAX_PROGRAM),
        "cec" | "readers" => Some(MAX_TABLES),
        _ => None,
    }
}

/// Duration of each target.
enum FuzzLength {
    Seconds(u64),
    Runs(u64),
}

impl FuzzLength {
    /// Reads the options.
    fn read(options: &[&str]) -> Result<Self, Failure> {
        let number = |text: &str| {
            let wrong = |_| Failure::arguments(format!("`{text}` is not a number"));
            text.parse().map_err(wrong)
        };
        match options {
            [] => Ok(Self::Seconds(60)),
            ["--seconds", n] => Ok(Self::Seconds(number(n)?)),
            ["--runs", n] => Ok(Self::Runs(number(n)?)),
            other => Err(Failure::arguments(format!(
                "fuzz takes names of targets and --seconds N or --runs N, not `{}`",
                other.join(" ")
            ))),
        }
    }

    /// The option of libFuzzer.
    fn limit(&self) -> String {
        match self {
            Self::Seconds(s) => format!("-max_total_time={s}"),
            Self::Runs(n) => format!("-runs={n}"),
        }
    }
}

fn main() -> ExitCode {
    programs::main(|words| {
        let named = words.iter().take_while(|o| !o.starts_with("--")).count();
        let (names, options) = words.split_at(named);
        programs::known(names, &TARGETS)?;
        let length = FuzzLength::read(options)?;
        let is_chosen = |name: &&str| names.is_empty() || names.contains(name);
        let chosen: Vec<&str> = TARGETS.into_iter().filter(is_chosen).collect();
        Ok(search(&chosen, &length)?)
    })
}

/// # Errors
/// If a tool is missing, or a target finds something.
fn search(chosen: &[&str], length: &FuzzLength) -> Result<(), String> {
    provide_subcommand("cargo-fuzz")?;
    if !has("c++") {
        return Err(
            "libFuzzer is built with a C++ compiler; install one, e.g. `apt install g++`"
                .to_owned(),
        );
    }
    let has_nightly = works(cargo_of("nightly").arg("--version"));
    if !has_nightly {
        println!("no nightly toolchain: using the unstable flags of the stable one");
    }
    for name in chosen {
        seed(name)?;
        run(&mut target_run(name, has_nightly, &length.limit()))?;
    }
    println!("{} fuzz targets without a finding", chosen.len());
    Ok(())
}

/// Fills the corpus of a target.
fn seed(name: &str) -> Result<(), String> {
    let corpus = files::folder(root().join("fuzz/corpus").join(name))?;
    match name {
        "gcode" => seeds::gcode(&corpus),
        "cec" => seeds::cec(&corpus),
        "readers" => seeds::readers(&corpus),
        "link" => seeds::golden(&corpus).and_then(|()| seeds::link(&corpus)),
        _ => seeds::golden(&corpus),
    }
}

/// The command that runs a target to a limit.
fn target_run(name: &str, has_nightly: bool, limit: &str) -> Command {
    let mut command = if has_nightly {
        cargo_of("nightly")
    } else {
        let mut stable = Command::new("cargo");
        stable.env_remove("CARGO").env_remove("RUSTUP_TOOLCHAIN");
        stable.env("RUSTC_BOOTSTRAP", "1");
        stable
    };
    command
        .current_dir(root().join("fuzz"))
        .env("CARGO_TARGET_DIR", target("fuzz"));
    command.args(["fuzz", "run", name]);
    let text = text(name);
    if text.is_some() {
        // Without the address sanitizer and checked indices, which detect errors of `unsafe`: it is forbidden
        // there, and the evaluation with its blob is always the same. Also without traced comparisons: numbers are
        // compared everywhere, and words come from the dictionary. Several times as many programs in the same time.
        command.args(["--sanitizer", "none", "--no-default-features"]);
        command.arg("--no-trace-compares");
    }
    command.args(["--", limit, "-timeout=20", "-print_final_stats=1"]);
    command.arg(format!("-max_len={}", text.unwrap_or(MAX_LEN)));
    if text.is_some() {
        let words = root().join("fuzz").join(name).with_extension("dict");
        command.arg(format!("-dict={}", words.display()));
    }
    command
}

//! Proves that a test detects every small change of the servo, the loader and the controller side.

use programs::files;
use programs::packages::provide_subcommand;
use programs::process::{cargo, run, target};
use std::process::ExitCode;

fn main() -> ExitCode {
    programs::main(|names| Ok(check(names)?))
}

/// Names of tests that run thousands of cases. They are applied only to mutants that no other test detects.
const LONG: [&str; 19] = [
    "whatever",
    "at_rest_no_transition",
    "a_step_that_is_worked_off",
    "a_ramp_lands",
    "rate_and_acceleration",
    "no_way_of_filling",
    "every_bit_is",
    "a_modulo_table_fits",
    "cobs_is",
    "two_clocks",
    "a_cut_at_any_byte",
    "a_cut_after_a_restart",
    "what_was_committed",
    "random_bytes",
    "sampled_flips",
    "no_servo_tick_falls",
    "the_newer_sequence_number",
    "erases_are_within",
    "what_is_within_a_step",
];

/// The mutants are defined in `.cargo/mutants.toml`, and for the controller side in `firmware/mutants.toml` and
/// `firmware/sensors/mutants.toml`. `names`: only those whose names match one of these expressions, such as
/// `shared/src/ramp` or `Servo<H>::swap`.
///
/// # Errors
/// A mutant that no test detects, and that is not explained there.
fn check(names: &[&str]) -> Result<(), String> {
    provide_subcommand("cargo-mutants")?;
    // The runtime's tests need the optimiser; those of the controller side are short without it, and build in a fifth
    // of the time.
    let runtime = part("trueaxis", ".cargo/mutants.toml", "1", names);
    let firmware = part("trueaxis-firmware", "firmware/mutants.toml", "0", names);
    let sensors = part(
        "trueaxis-sensors",
        "firmware/sensors/mutants.toml",
        "0",
        names,
    );
    runtime.and(firmware).and(sensors)
}

/// The mutants of one package, first with short tests built with an optimisation of `level`.
fn part(package: &str, list: &str, level: &str, names: &[&str]) -> Result<(), String> {
    let output = files::folder(target("mutants").join(package))?;
    let mutants = |names: &[&str]| {
        let mut command = cargo();
        command.args(["mutants", "--package", package, "--no-shuffle"]);
        command
            .args(["--config", list])
            .arg("--output")
            .arg(&output);
        for name in names {
            command.args(["--re", name]);
        }
        // Failures need not be minimised, nor debugged.
        command
            .env("PROPTEST_MAX_SHRINK_ITERS", "0")
            .env("CARGO_PROFILE_DEV_DEBUG", "0");
        command
    };
    let found = |list: &str| {
        let path = output.join("mutants.out").join(list);
        std::fs::read_to_string(path).unwrap_or_default()
    };
    // A test that does not finish counts as a detection too.
    let verdict = |result: Result<(), String>| {
        let noticed = found("missed.txt").is_empty() && !found("timeout.txt").is_empty();
        if noticed { Ok(()) } else { result }
    };
    println!("\n== {package}");
    let mut first = mutants(names);
    first.env("CARGO_PROFILE_DEV_OPT_LEVEL", level);
    first.args(["--timeout", "30", "--", "--"]);
    for name in LONG {
        first.args(["--skip", name]);
    }
    let result = run(&mut first);
    let missed = found("missed.txt");
    if missed.is_empty() {
        return verdict(result);
    }
    println!("\n== those that are left, under all tests");
    let left: Vec<String> = missed.lines().map(exactly).collect();
    let left: Vec<&str> = left.iter().map(String::as_str).collect();
    verdict(run(mutants(&left).args(["--timeout", "600"])))
}

/// The expression that matches only this name.
fn exactly(name: &str) -> String {
    let mut expression = String::from("^");
    for letter in name.chars() {
        if r"\.+*?()|[]{}^$".contains(letter) {
            expression.push('\\');
        }
        expression.push(letter);
    }
    expression + "$"
}

//! `cargo xtask mutants`: small changes of the servo, the loader and the controller's side, each of which a test
//! must notice.

use crate::process::{cargo, provide, run, target};

/// What tests are called that draw thousands of cases. They look at those changes that no other test
/// notices.
const LONG: [&str; 9] = [
    "whatever",
    "at_rest_no_transition",
    "a_step_that_is_worked_off",
    "a_ramp_lands",
    "rate_and_acceleration",
    "no_way_of_filling",
    "every_bit_is",
    "a_modulo_table_fits",
    "cobs_is",
];

/// Which they are says `.cargo/mutants.toml`, and for the controller's side `firmware/mutants.toml`. `names`: of
/// those alone whose names match one of these expressions, such as `shared/src/ramp` or `Servo<H>::swap`.
///
/// # Errors
/// A change that no test notices, and is not explained there.
pub fn execute(names: &[&str]) -> Result<(), String> {
    provide("cargo-mutants")?;
    let [runtime, firmware] = [
        ("trueaxis", ".cargo/mutants.toml"),
        ("trueaxis-firmware", "firmware/mutants.toml"),
    ]
    .map(|(package, list)| part(package, list, names));
    runtime.and(firmware)
}

/// The changes of one package.
fn part(package: &str, list: &str, names: &[&str]) -> Result<(), String> {
    let output = target("mutants").join(package);
    let mutants = || {
        let mut command = cargo();
        command.args(["mutants", "--package", package, "--no-shuffle"]);
        command
            .args(["--config", list])
            .arg("--output")
            .arg(&output);
        for name in names {
            command.args(["--re", name]);
        }
        // What fails need not be made small, nor looked at with a debugger.
        command
            .env("PROPTEST_MAX_SHRINK_ITERS", "0")
            .env("CARGO_PROFILE_DEV_DEBUG", "0");
        command
    };
    println!("\n== {package}");
    let mut first = mutants();
    first.args(["--timeout", "30", "--", "--"]);
    for name in LONG {
        first.args(["--skip", name]);
    }
    let result = run(&mut first);
    // It also fails where nothing could be tried.
    let left = |list: &str| {
        let path = output.join("mutants.out").join(list);
        std::fs::metadata(path).is_ok_and(|file| file.len() > 0)
    };
    if result.is_ok() || !(left("missed.txt") || left("timeout.txt")) {
        return result;
    }
    println!("\n== those that are left, under all tests");
    let result = run(mutants().args(["--iterate", "--timeout", "600"]));
    if result.is_err() && !left("missed.txt") && left("timeout.txt") {
        println!("what does not come to an end is noticed too");
        return Ok(());
    }
    result
}

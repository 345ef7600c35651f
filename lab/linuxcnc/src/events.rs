//! Anything an operator can do, at any moment: no correction steps, and there is no following error.

use super::bench::LinuxCncBench;
use super::motion::compile;
use super::oracle::rate_bound;
use super::run::{JOINTS, PERIOD, ScenarioRun};
use programs::files;

/// # Errors
/// The violated condition.
pub fn check(bench: &LinuxCncBench) -> Result<(), String> {
    compile(bench, "EXX1 = -45e-6", "first.trax")?;
    compile(bench, "EXX1 = 60e-6", "second.trax")?;
    bench.write("third.trax", "no compensation at all")?;
    bench.copy("tests/golden/v1/router-10.trax", "fourth.trax")?;
    files::copy(&bench.file("first.trax"), &bench.file("machine.trax"))?;
    let run = ScenarioRun::of(bench, "events")?;
    let largest = run.adds_up()?;
    let fastest = fastest(bench, &run)?;
    let happened: Vec<String> = run
        .told
        .iter()
        .filter(|words| words[0].starts_with("count "))
        .map(|words| words.join(" ").replace("count ", ""))
        .collect();
    let of = |name: &str| run.rows.of(name);
    let partly = of("factor")
        .iter()
        .filter(|f| **f > 0.0 && **f < 1.0)
        .count();
    let off = of("enabled").iter().filter(|f| **f == 0.0).count();
    let loads = of("loads").last().copied().unwrap_or_default();
    println!(
        "events: {} in {} periods ({}); {partly} periods in ramps, {off} with the machine off, {loads} files taken; \
         fastest correction {fastest:.2} of its rate bound, largest following error {largest:.1e}",
        run.told("events")?[0],
        run.rows.len(),
        happened.join(", ")
    );
    if partly < 1000 || off < 100 || loads < 20.0 {
        return Err("too little has happened".to_owned());
    }
    Ok(())
}

/// The fastest change of a correction, as a part of its rate bound.
fn fastest(bench: &LinuxCncBench, run: &ScenarioRun) -> Result<f64, String> {
    let mut fastest = 0.0_f64;
    for (j, letter) in JOINTS.iter().enumerate() {
        let mut most = 0.0_f64;
        for name in ["first.trax", "second.trax"] {
            most = most.max(rate_bound(bench, name, letter)?);
        }
        let correction = run.of_joint(j, "correction");
        for (row, pair) in correction.windows(2).enumerate() {
            let rate = (pair[1] - pair[0]).abs() / PERIOD;
            // Corrections are floats below 0.25: each is rounded by 2⁻²⁷ at most.
            if rate > most + 2.0_f64.powi(-26) / PERIOD {
                return Err(format!(
                    "row {row}: the correction of {letter} changes by {rate} per s, more than {most}"
                ));
            }
            fastest = fastest.max(rate / most);
        }
    }
    Ok(fastest)
}

//! Results of a probing move, and behaviour at the ends of the travel.

use super::bench::LinuxCncBench;
use super::run::{JOINTS, PERIOD, ScenarioRun};
use programs::csv;

/// The tolerance of `compile` at the tip, mm.
const TOLERANCE: f64 = 5e-5;

/// G38 reports the uncorrected commands: there, the tip without errors would be at the real surface, as known to the
/// component that simulates the real machine.
///
/// # Errors
/// If this does not hold.
pub fn probing(bench: &LinuxCncBench, machine: &str, run: &ScenarioRun) -> Result<(), String> {
    let probed = run.told("probed")?;
    let &[tripped, ref position @ ..] = &probed[..] else {
        return Err("nothing was probed".to_owned());
    };
    let surface = run.told("surface")?[0];
    let cells: Vec<String> = position.iter().map(|v| format!("{v:?}")).collect();
    let text = format!("{}\n{}\n", JOINTS.join(","), cells.join(","));
    bench.write("positions.csv", text)?;
    let words = [
        "pose",
        machine,
        "errors.toml",
        "--positions",
        "positions.csv",
    ];
    let poses = bench.trueaxis(&words)?;
    let pose = csv::numbers(&poses)?.swap_remove(0);
    let &[nominal, _, _, _, _, _, uncorrected, ..] = &pose[..] else {
        return Err(format!("`trueaxis pose` says\n{poses}"));
    };
    let beyond = nominal - surface;
    // 1 mm/s, sampled once per millisecond; the tolerance of the tables; and seven digits of the surface.
    if tripped != 1.0
        || !(-TOLERANCE..=PERIOD + TOLERANCE).contains(&beyond)
        || (uncorrected - nominal).abs() < 0.01
    {
        return Err(format!(
            "probed {probed:?}, tip without errors at {nominal}, {beyond} beyond the surface; with them at \
             {uncorrected}"
        ));
    }
    println!(
        "probing: the surface at x = {surface:.4} mm is reported at {nominal:.4}; without the compensation it would \
         be {:.1} µm off",
        (uncorrected - nominal) * 1e3
    );
    Ok(())
}

/// In the corners of the travel no correction leaves it, and no motion goes beyond them.
///
/// # Errors
/// If one does.
pub fn limits(run: &ScenarioRun) -> Result<(), String> {
    let corners: Vec<&Vec<String>> = run.told.iter().filter(|w| w[0] == "corner").collect();
    let mut pushed_back = 0;
    for words in &corners {
        let number = |k: usize| words[k].parse::<f64>().unwrap_or(f64::NAN);
        let (position, correction) = (number(3), number(4));
        // Both as printed by `halcmd`, with seven digits.
        let inside = if words[1].contains("upper") {
            correction <= 1e-7
        } else {
            correction >= -1e-7
        };
        if !inside {
            return Err(format!(
                "{correction} leads out of the travel at {position}"
            ));
        }
        pushed_back += usize::from(correction.abs() <= 1e-7);
    }
    if corners.len() != 2 * JOINTS.len() || pushed_back == 0 || run.told("beyond")? != [0.0] {
        return Err(format!("limits: {:?}", run.told));
    }
    println!(
        "limits: no correction leads out of the travel; {pushed_back} of 10 are held at its ends"
    );
    Ok(())
}

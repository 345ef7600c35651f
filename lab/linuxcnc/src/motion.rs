//! The component under LinuxCNC's motion controller, at 1 kHz, with the kinematics `xyzac-trt`.

use super::bench::LinuxCncBench;
use super::oracle::eval;
use super::probing::{limits, probing};
use super::run::{JOINTS, ScenarioRun};
use programs::files;
use programs::process::root;

/// Permitted difference between one step of the rival and the tables, mm or degrees: second order, errors of 1e-4 rad
/// at corrections of 0.1 mm, or 1e-4 of lever at 100 mm per step of the tables' own 1 µm.
const SECOND_ORDER: f64 = 2e-5;
/// Minimum number of periods that `drive.py` runs of the programs that come with LinuxCNC.
const LEAST_PERIODS: f64 = 1000.0;

/// Path of a file of the example.
pub fn example(name: &str) -> String {
    let folder = root().join("examples/linuxcnc-xyzac-trt");
    folder.join(name).display().to_string()
}

/// The blob of the example, without its two reversal errors: a correction that depends on the direction of travel
/// catches up with bounded rate, and differs from `eval` meanwhile.
pub fn compile(bench: &LinuxCncBench, scale: &str, name: &str) -> Result<(), String> {
    let machine = example("machine.toml");
    let errors = files::read_text(example("errors-11.toml").as_ref())?;
    let errors: String = errors
        .lines()
        .filter(|line| !line.starts_with("EXXb") && !line.starts_with("ECCb"))
        .map(|line| line.replace("EXX1 = -45e-6", scale) + "\n")
        .collect();
    bench.write("errors.toml", errors)?;
    // The policy that the rival computes as well: all six rows by least squares.
    let policy = ["--policy", "orientation", "-o", name];
    let words = [&["compile", &machine, "errors.toml"][..], &policy].concat();
    bench.trueaxis(&words).map(drop)
}

/// # Errors
/// The violated condition.
pub fn check(bench: &LinuxCncBench) -> Result<(), String> {
    compile(bench, "EXX1 = -45e-6", "machine.trax")?;
    let machine = example("machine.toml");
    bench.model(&machine, "errors.toml", "machine.model")?;
    let run = ScenarioRun::of(bench, "programs probe limits")?;
    let largest = run.adds_up()?;
    is_undisturbed(&run)?;
    let positions = run.positions();
    all_move(&positions)?;
    let rival = corrections(bench, &run, &positions)?;
    println!(
        "motion controller: {} periods of {}; {} corrections are those of `trueaxis eval` to the last bit, largest \
         following error {largest:.1e}; matrices within {rival:.1e} mm and degrees",
        positions.len(),
        programs(&run)?,
        positions.len() * JOINTS.len(),
    );
    probing(bench, &machine, &run)?;
    limits(&run)
}

/// Corrections are fully in, without a fault, and each joint has an offset.
fn is_undisturbed(run: &ScenarioRun) -> Result<(), String> {
    let offsets = run.told("offsets")?;
    if offsets.len() != JOINTS.len() || offsets.contains(&0.0) {
        return Err(format!("the offsets of the joints are {offsets:?}"));
    }
    for name in ["factor", "enabled"] {
        if run.rows.of(name).iter().any(|v| *v != 1.0) {
            return Err(format!("{name} is not always 1"));
        }
    }
    match run.rows.of("fault-code").iter().any(|v| *v != 0.0) {
        true => Err("there was a fault".to_owned()),
        false => Ok(()),
    }
}

fn all_move(positions: &[Vec<f64>]) -> Result<(), String> {
    for (j, letter) in JOINTS.iter().enumerate() {
        let range =
            |of: &dyn Fn(f64, f64) -> f64| positions.iter().map(|p| p[j]).fold(positions[0][j], of);
        let moved = range(&f64::max) - range(&f64::min);
        if moved < 10.0 {
            return Err(format!("{letter} moved only by {moved}"));
        }
    }
    Ok(())
}

/// Compares with `trueaxis eval`, bit by bit; returns the largest difference of the rival.
fn corrections(
    bench: &LinuxCncBench,
    run: &ScenarioRun,
    positions: &[Vec<f64>],
) -> Result<f64, String> {
    let expected = eval(bench, "machine.trax", &JOINTS, JOINTS.len(), positions)?;
    let mut rival = 0.0_f64;
    for j in 0..JOINTS.len() {
        let (found, direct) = (run.of_joint(j, "correction"), run.of_joint(j, "rival"));
        for (row, right) in expected.iter().enumerate() {
            if found[row] as f32 != right[j] || f64::from(found[row] as f32) != found[row] {
                return Err(format!(
                    "row {row}, joint {j}: correction {:?}, eval {:?} at {:?}",
                    found[row], right[j], positions[row]
                ));
            }
            rival = rival.max((direct[row] - found[row]).abs());
        }
    }
    match rival > SECOND_ORDER {
        true => Err(format!("the rival computes something else, by {rival}")),
        false => Ok(rival),
    }
}

/// The programs that were driven, and how far.
fn programs(run: &ScenarioRun) -> Result<String, String> {
    let mut all = Vec::new();
    for words in run.told.iter().filter(|w| w[0].starts_with("program ")) {
        let name = words[0].trim_start_matches("program ");
        let &[line, ended, periods] = &run.told(&words[0])?[..] else {
            return Err(format!("{name}: {words:?}"));
        };
        if periods < LEAST_PERIODS {
            return Err(format!("{name} was driven for {periods} periods"));
        }
        all.push(match ended == 1.0 {
            true => name.to_owned(),
            false => format!("{name} to line {line}"),
        });
    }
    if all.len() < 5 {
        return Err(format!("only these programs were driven: {all:?}"));
    }
    Ok(all.join(", "))
}

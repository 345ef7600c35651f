//! The component under LinuxCNC's motion controller, at 1 kHz, with the kinematics `xyzac-trt`.

use super::bench::Bench;
use super::oracle::{eval, rate_bound};
use super::rows::Rows;
use crate::process::root;
use std::fs;

/// Joints, in LinuxCNC's order.
const JOINTS: [&str; 5] = ["X", "Y", "Z", "A", "C"];
/// What `firmware/linuxcnc/tests/xyzac.hal` records of each joint, and besides.
const OF_JOINT: [&str; 8] = [
    "pos",
    "cmd",
    "drive",
    "fb",
    "correction",
    "error",
    "homed",
    "rival",
];
const BESIDES: [&str; 8] = [
    "factor",
    "fault-code",
    "loads",
    "enabled",
    "read",
    "write",
    "matrix",
    "kins",
];
/// Roundings in a following error: of the offset and the correction, added and taken away again.
const ROUNDINGS: f64 = 4.0;
/// How far one step of the rival may be from the tables, mm or degrees: second order, errors of 1e-4 rad at
/// corrections of 0.1 mm, or 1e-4 of lever at 100 mm per step of the tables' own 1 µm.
const SECOND_ORDER: f64 = 2e-5;
/// The most that our time may be of the rival's.
const SHARE: f64 = 0.15;
const PERIOD: f64 = 1e-3;

struct Run {
    rows: Rows,
    /// `name value…`, as `drive.py` tells.
    told: Vec<Vec<String>>,
    said: String,
}

impl Run {
    /// Drives a scenario of `drive.py`.
    fn of(bench: &Bench, scenario: &str) -> Result<Self, String> {
        let folder = "firmware/linuxcnc/tests";
        for name in ["xyzac.ini", "xyzac.hal", "drive.py", "tool.tbl"] {
            bench.copy(&format!("{folder}/{name}"), name)?;
        }
        for name in ["record", "result"] {
            let _ = fs::remove_file(bench.file(name));
        }
        bench.write("scenario", scenario)?;
        let mut said = bench.inside(&["linuxcnc", "/tmp/xyzac.ini"])?;
        // Without a terminal, what is said goes here.
        for name in ["linuxcnc_print.txt", "linuxcnc_debug.txt"] {
            said += &fs::read_to_string(bench.file(name)).unwrap_or_default();
        }
        let told = fs::read_to_string(bench.file("result")).map_err(|e| format!("{e}\n{said}"))?;
        let told: Vec<Vec<String>> = told
            .lines()
            .map(|l| l.split('\t').map(str::to_owned).collect())
            .collect();
        let names: Vec<String> = (0..JOINTS.len())
            .flat_map(|j| OF_JOINT.map(|what| format!("{j}.{what}")))
            .chain(BESIDES.map(str::to_owned))
            .collect();
        let rows = Rows::read(bench, "record", &names).map_err(|e| format!("{e}\n{said}"))?;
        let run = Self { rows, told, said };
        run.told("done")?;
        Ok(run)
    }

    fn told(&self, name: &str) -> Result<Vec<f64>, String> {
        let line = self.told.iter().find(|words| words[0] == name);
        let line = line
            .ok_or_else(|| format!("nothing is told of {name}: {:?}\n{}", self.told, self.said))?;
        Ok(line[1..].iter().filter_map(|w| w.parse().ok()).collect())
    }

    fn of_joint(&self, joint: usize, what: &str) -> Vec<f64> {
        self.rows.of(&format!("{joint}.{what}"))
    }

    /// The command is passed on with the correction added; the controller sees what it commanded.
    fn adds_up(&self) -> Result<f64, String> {
        let mut largest = 0.0_f64;
        for j in 0..JOINTS.len() {
            let of = |what| self.of_joint(j, what);
            let (cmd, drive, fb, correction) = (of("cmd"), of("drive"), of("fb"), of("correction"));
            for row in 0..self.rows.len() {
                if drive[row].to_bits() != (cmd[row] + correction[row]).to_bits() {
                    return Err(format!("row {row}, joint {j}: the command does not add up"));
                }
                if row > 0 && fb[row].to_bits() != (drive[row - 1] - correction[row - 1]).to_bits()
                {
                    return Err(format!(
                        "row {row}, joint {j}: the feedback does not add up"
                    ));
                }
            }
            // Each by half of a last digit of the largest number that is added.
            let magnitude =
                |values: &[f64]| values.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
            let error = magnitude(&of("error"));
            let most =
                ROUNDINGS * 0.5 * f64::EPSILON * magnitude(&drive).max(magnitude(&of("pos")));
            if error > most {
                return Err(format!(
                    "joint {j}: following error of {error:e}, more than {most:e} for rounding"
                ));
            }
            largest = largest.max(error);
        }
        Ok(largest)
    }

    /// Positions in the order of [`JOINTS`].
    fn positions(&self) -> Vec<Vec<f64>> {
        let columns: Vec<usize> = (0..JOINTS.len())
            .map(|j| self.rows.column(&format!("{j}.pos")))
            .collect();
        let rows = self.rows.rows();
        rows.map(|row| columns.iter().map(|&c| row[c]).collect())
            .collect()
    }
}

/// The blob of the example, without its two errors of reversal: a correction that depends on the direction of travel
/// catches up with bounded rate, and is not that of `eval` meanwhile.
pub fn compile(bench: &Bench, scale: &str, name: &str) -> Result<(), String> {
    let folder = root().join("examples/linuxcnc-xyzac-trt");
    let machine = folder.join("machine.toml");
    let errors = folder.join("errors-11.toml");
    let errors = fs::read_to_string(&errors).map_err(|e| format!("{}: {e}", errors.display()))?;
    let errors: String = errors
        .lines()
        .filter(|line| !line.starts_with("EXXb") && !line.starts_with("ECCb"))
        .map(|line| line.replace("EXX1 = -45e-6", scale) + "\n")
        .collect();
    bench.write("errors.toml", errors)?;
    // What the rival computes, too: all six rows by least squares.
    let policy = ["--policy", "orientation", "-o", name];
    let mut words = vec![
        "compile",
        machine.to_str().unwrap_or_default(),
        "errors.toml",
    ];
    words.extend(policy);
    bench.trueaxis(&words).map(drop)
}

/// # Errors
/// What did not hold.
pub fn check(bench: &Bench) -> Result<(), String> {
    compile(bench, "EXX1 = -45e-6", "machine.trax")?;
    let run = Run::of(bench, "program probe limits")?;
    let largest = run.adds_up()?;
    let offsets = run.told("offsets")?;
    if offsets.len() != JOINTS.len() || offsets.contains(&0.0) {
        return Err(format!("the offsets of the joints are {offsets:?}"));
    }
    for name in ["factor", "enabled"] {
        if run.rows.of(name).iter().any(|v| *v != 1.0) {
            return Err(format!("{name} is not always 1"));
        }
    }
    if run.rows.of("fault-code").iter().any(|v| *v != 0.0) {
        return Err("there was a fault".to_owned());
    }
    let positions = run.positions();
    for (j, letter) in JOINTS.iter().enumerate() {
        let range =
            |of: &dyn Fn(f64, f64) -> f64| positions.iter().map(|p| p[j]).fold(positions[0][j], of);
        let moved = range(&f64::max) - range(&f64::min);
        if moved < 10.0 {
            return Err(format!("{letter} moved only by {moved}"));
        }
    }
    let expected = eval(bench, "machine.trax", &JOINTS, JOINTS.len(), &positions)?;
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
    if rival > SECOND_ORDER {
        return Err(format!("the rival computes something else, by {rival}"));
    }
    println!(
        "motion controller: {} periods of a five-axis program (to line {}), {} corrections are those of `trueaxis eval` \
         to the last bit, largest following error {largest:.1e}",
        positions.len(),
        run.told("line")?[0],
        positions.len() * JOINTS.len(),
    );
    probing(bench, &run)?;
    limits(&run)?;
    times(&run)
}

/// G38 reports where the commands were, uncorrected, when the drives met the surface.
fn probing(bench: &Bench, run: &Run) -> Result<(), String> {
    let probed = run.told("probed")?;
    let &[tripped, ref position @ ..] = &probed[..] else {
        return Err("nothing was probed".to_owned());
    };
    let surface = run.told("surface")?[0];
    let correction = eval(
        bench,
        "machine.trax",
        &JOINTS,
        JOINTS.len(),
        &[position.to_vec()],
    )?;
    let correction = f64::from(correction[0][0]);
    let beyond = position[0] + correction - surface;
    // 1 mm/s, seen once in a millisecond, and what rounds.
    if tripped != 1.0 || !(-1e-9..=1.0 * PERIOD + 1e-9).contains(&beyond) || correction.abs() < 0.01
    {
        return Err(format!(
            "probed {probed:?}, correction {correction}, {beyond} beyond the surface"
        ));
    }
    println!(
        "probing: the surface at {surface} mm is reported at {:.4}, with the correction {:.4} left out",
        position[0], correction
    );
    Ok(())
}

/// In the corners of the travel no correction leads out of it, and beyond them nothing goes.
fn limits(run: &Run) -> Result<(), String> {
    let corners: Vec<&Vec<String>> = run.told.iter().filter(|w| w[0] == "corner").collect();
    let mut pushed_back = 0;
    for words in &corners {
        let number = |k: usize| words[k].parse::<f64>().unwrap_or(f64::NAN);
        let (position, correction) = (number(3), number(4));
        // Both as `halcmd` prints them, with seven digits.
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

/// Time stamps of the processor, mean and least, of each function.
fn times(run: &Run) -> Result<(), String> {
    let mean = |name: &str| {
        let all = run.rows.of(name);
        all.iter().sum::<f64>() / all.len() as f64
    };
    let least = |name: &str| run.rows.of(name).into_iter().fold(f64::INFINITY, f64::min);
    println!("function             mean    least     tmax  (counts of the processor's clock)");
    for (name, column) in [
        ("trueaxis.read", "read"),
        ("trueaxis.write", "write"),
        ("rivals.matrix", "matrix"),
        ("rivals.kins", "kins"),
    ] {
        let most = run.told(&format!("tmax {name}"))?[0];
        println!(
            "{name:16} {:8.0} {:8.0} {most:8.0}",
            mean(column),
            least(column)
        );
    }
    let share = |of: &dyn Fn(&str) -> f64| (of("read") + of("write")) / of("matrix");
    println!(
        "component / matrices: {:.3} of the mean, {:.3} of the least time",
        share(&mean),
        share(&least)
    );
    // The mean is that of caches which other programs have filled meanwhile, on both sides; the least time is what
    // the component does.
    if share(&least) > SHARE {
        return Err(format!(
            "the component takes more than {SHARE} of the time of matrices"
        ));
    }
    Ok(())
}

/// # Errors
/// What did not hold.
pub fn events(bench: &Bench) -> Result<(), String> {
    compile(bench, "EXX1 = -45e-6", "first.trax")?;
    compile(bench, "EXX1 = 60e-6", "second.trax")?;
    bench.write("third.trax", "no compensation at all")?;
    bench.copy("tests/golden/v1/router-10.trax", "fourth.trax")?;
    fs::copy(bench.file("first.trax"), bench.file("machine.trax")).map_err(|e| e.to_string())?;
    let run = Run::of(bench, "events")?;
    let largest = run.adds_up()?;
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

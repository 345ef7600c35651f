//! The simulated machines of `firmware/linuxcnc/configs`: without the compensation the error on the pins is that of the
//! exact kinematics, with it less than the tolerance.

use super::bench::{LinuxCncBench, without_panels};
use programs::csv::numbers;
use programs::files;
use programs::process::root;

/// A simulated machine: its configuration, its files in `examples`, and its number of axes.
struct SimulatedMachine {
    name: &'static str,
    machine: &'static str,
    errors: &'static str,
    axes: usize,
}

const MACHINES: [SimulatedMachine; 2] = [
    SimulatedMachine {
        name: "mill-21",
        machine: "mill-21/machine.toml",
        errors: "mill-21/errors-21.toml",
        axes: 3,
    },
    SimulatedMachine {
        name: "xyzac-trt",
        machine: "linuxcnc-xyzac-trt/machine.toml",
        errors: "linuxcnc-xyzac-trt/errors-11.toml",
        axes: 5,
    },
];

/// Permitted difference from `trueaxis pose`, µm and µrad: it prints 0.1 nm and 0.1 nrad, and six of these are
/// subtracted and added up.
const PRINTED: f64 = 1e-3;
/// The tolerance of `compile` at the tip, µm.
const TOLERANCE: f64 = 0.05;
/// Where `pose` counts from in the coordinates of LinuxCNC (mm): these have their zero at the tip with all joints at 0,
/// the tool-offset of `machine.hal` below the spindle.
const ZERO: [f64; 3] = [0.0, 0.0, 100.0];
/// Largest growth of the direction error due to corrections, µrad, as counted by `verify`.
const GROWTH: f64 = 1.0;

/// # Errors
/// The violated condition.
pub fn check(bench: &LinuxCncBench) -> Result<(), String> {
    for machine in &MACHINES {
        let [off, on] = (machine.check(bench)).map_err(|e| format!("{}: {e}", machine.name))?;
        println!(
            "{}: off by up to {:.1} µm and {:.0} µrad, with the compensation by {:.4} µm and {:.0} µrad",
            machine.name, off[0], off[1], on[0], on[1]
        );
    }
    Ok(())
}

impl SimulatedMachine {
    /// The largest errors without and with the compensation.
    fn check(&self, bench: &LinuxCncBench) -> Result<[[f64; 2]; 2], String> {
        let said = self.run(bench)?;
        let record = bench.file(&format!("configs/{}/record.csv", self.name));
        let record = files::read_text(&record).map_err(|e| format!("{e}\n{said}"))?;
        let rows = numbers(&record)?;
        let poses = self.poses(bench, &record)?;
        if self.axes == 5 {
            nominal(&rows, &poses).map_err(|e| format!("{e}\n{said}"))?;
        }
        let exact: Vec<[f64; 2]> = poses.iter().map(|row| error(row)).collect();
        compare(&rows, &exact, self.axes).map_err(|e| format!("{e}\n{said}"))
    }

    /// Paths of machine and errors.
    fn files(&self) -> [String; 2] {
        let path = |file| root().join("examples").join(file).display().to_string();
        [self.machine, self.errors].map(path)
    }

    /// Runs LinuxCNC with a script that records; returns what is said.
    fn run(&self, bench: &LinuxCncBench) -> Result<String, String> {
        let [machine, errors] = self.files();
        let file = |kind: &str| format!("configs/{0}/{0}.{kind}", self.name);
        let [ini, trax, model] = ["ini", "trax", "model"].map(file);
        bench.configurations()?;
        // The script replaces the screen, and nothing else needs one.
        let text = without_panels(&files::read_text(&bench.file(&ini))?);
        let text = text.replace("DISPLAY = axis", "DISPLAY = ../measure.py");
        bench.write(&ini, text)?;
        bench.compile(&machine, &errors, &trax, &[])?;
        bench.model(&machine, &errors, &model)?;
        bench.trueaxis(&["linuxcnc", "check", &ini, &trax, "--machine", &machine])?;
        bench.open_to_all("configs")?;
        bench.inside(&["linuxcnc", &format!("/tmp/{ini}")])
    }

    /// What `trueaxis pose` gives at the recorded positions.
    fn poses(&self, bench: &LinuxCncBench, record: &str) -> Result<Vec<Vec<f64>>, String> {
        let positions = record.lines().map(|line| {
            let cells: Vec<&str> = line.split(',').take(self.axes).collect();
            cells.join(",")
        });
        let positions: Vec<String> = positions.collect();
        bench.write("positions.csv", positions.join("\n"))?;
        let [machine, errors] = self.files();
        numbers(&bench.trueaxis(&["pose", &machine, &errors, "--positions", "positions.csv"])?)
    }
}

/// Errors of tip (µm) and direction (µrad) without a compensation.
fn error(pose: &[f64]) -> [f64; 2] {
    let apart = |from: usize, factor: f64| {
        let parts = (from..from + 3).map(|i| pose[i + 6] - pose[i]);
        parts.map(|d| d * d).sum::<f64>().sqrt() * factor
    };
    [apart(0, 1e3), apart(3, 1e6)]
}

/// Compares where LinuxCNC's kinematics have the tool, at each stop, with `trueaxis pose`: what `linuxcnc check` relies
/// on when it compares directions and locations of axes with those of the module.
fn nominal(rows: &[Vec<f64>], poses: &[Vec<f64>]) -> Result<(), String> {
    let mut stops = 0;
    for (row, pose) in rows.iter().zip(poses) {
        let end = row.len() - 3;
        if row[end - 1] == 0.0 {
            continue;
        }
        stops += 1;
        let apart = (0..3).map(|k| (row[end + k] - pose[k] - ZERO[k]).abs());
        // Feedback is the command without the correction, to the rounding of a sum; `pose` prints 0.1 nm.
        if apart.fold(0.0, f64::max) > 1e-6 {
            return Err(format!(
                "at {:?} LinuxCNC has the tool at {:?}, `pose` at {:?} mm",
                &row[..5],
                &row[end..],
                &pose[..3]
            ));
        }
    }
    match stops {
        0 => Err("no stop to compare".to_owned()),
        _ => Ok(()),
    }
}

/// Compares the positions of the machine; returns the largest errors without and with the compensation.
fn compare(rows: &[Vec<f64>], exact: &[[f64; 2]], axes: usize) -> Result<[[f64; 2]; 2], String> {
    let mut largest = [[0.0_f64; 2]; 2];
    let mut stops = [0; 2];
    for (row, exact) in rows.iter().zip(exact) {
        let shown = [row[axes], row[axes + 4]];
        let [factor, fault, stop] = [row[axes + 5], row[axes + 6], row[axes + 7]];
        if fault != 0.0 {
            return Err(format!("a fault at {:?}", &row[..axes]));
        }
        if stop == 0.0 {
            continue;
        }
        let on = usize::from(factor == 1.0);
        stops[on] += 1;
        for k in 0..2 {
            largest[on][k] = largest[on][k].max(shown[k]);
        }
        let wrong = match on {
            0 => (0..2).any(|k| (shown[k] - exact[k]).abs() > PRINTED),
            _ => shown[0] > TOLERANCE || shown[1] > exact[1] + GROWTH,
        };
        if wrong {
            return Err(format!(
                "at {:?} with factor {factor} the pins show {shown:?} (µm, µrad); without a compensation it is \
                 {exact:?}",
                &row[..axes]
            ));
        }
    }
    if stops[0] != stops[1] || stops[0] < 5 || largest[0][0] < 10.0 {
        return Err(format!(
            "too little to compare: {stops:?} stops, {largest:?}"
        ));
    }
    Ok(largest)
}

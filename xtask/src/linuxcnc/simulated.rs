//! The simulated machines of `firmware/linuxcnc/configs`: without the compensation the error on the pins is that of the
//! exact kinematics, with it less than the tolerance.

use super::bench::LinuxCncBench;
use crate::csv::numbers;
use crate::files;
use crate::process::{root, run};
use std::process::Command;

const CONFIGS: &str = "firmware/linuxcnc/configs";

/// Configuration, machine, errors, and number of axes.
const MACHINES: [(&str, &str, &str, usize); 2] = [
    (
        "mill-21",
        "examples/mill-21/machine.toml",
        "examples/mill-21/errors-21.toml",
        3,
    ),
    (
        "xyzac-trt",
        "examples/linuxcnc-xyzac-trt/machine.toml",
        "examples/linuxcnc-xyzac-trt/errors-11.toml",
        5,
    ),
];

/// Permitted difference from `trueaxis pose`, µm and µrad: it prints 0.1 nm and 0.1 nrad, and six of these are
/// subtracted and added up.
const PRINTED: f64 = 1e-3;
/// The tolerance of `compile` at the tip, µm.
const TOLERANCE: f64 = 0.05;
/// Where `pose` counts from in the coordinates of LinuxCNC (mm): these have their zero at the tip with all joints at 0, the
/// tool-offset of `machine.hal` below the spindle.
const ZERO: [f64; 3] = [0.0, 0.0, 100.0];
/// Largest growth of the direction error due to corrections, µrad, as counted by `verify`.
const GROWTH: f64 = 1.0;

/// # Errors
/// The violated condition.
pub fn check(bench: &LinuxCncBench) -> Result<(), String> {
    for (name, machine, errors, axes) in MACHINES {
        one(bench, name, machine, errors, axes).map_err(|e| format!("{name}: {e}"))?;
    }
    Ok(())
}

fn one(
    bench: &LinuxCncBench,
    name: &str,
    machine: &str,
    errors: &str,
    axes: usize,
) -> Result<(), String> {
    let [machine, errors] = [machine, errors].map(|p| root().join(p).display().to_string());
    let configs = bench.file("configs");
    let folder = format!("configs/{name}");
    run(Command::new("cp")
        .args(["-r", "-T"])
        .arg(root().join(CONFIGS))
        .arg(&configs))?;
    let ini = format!("{folder}/{name}.ini");
    let text = files::read_text(&bench.file(&ini))?;
    // The script replaces the screen, and nothing else needs one.
    let without = |line: &&str| !line.starts_with("PYVCP") && !line.starts_with("POSTGUI");
    let lines: Vec<&str> = text.lines().filter(without).collect();
    let text = lines.join("\n") + "\n";
    bench.write(
        &ini,
        text.replace("DISPLAY = axis", "DISPLAY = ../measure.py"),
    )?;
    let (trax, model) = (
        format!("{folder}/{name}.trax"),
        format!("{folder}/{name}.model"),
    );
    bench.trueaxis(&[
        "compile", &machine, &errors, "-o", &trax, "--random", "1000",
    ])?;
    bench.trueaxis(&["linuxcnc", "model", &machine, &errors, "-o", &model])?;
    bench.trueaxis(&["linuxcnc", "check", &ini, &trax, "--machine", &machine])?;
    run(Command::new("chmod").args(["-R", "a+rwX"]).arg(&configs))?;
    let said = bench.inside(&["linuxcnc", &format!("/tmp/{ini}")])?;
    let record = bench.file(&format!("{folder}/record.csv"));
    let record = files::read_text(&record).map_err(|e| format!("{e}\n{said}"))?;
    let rows = numbers(&record)?;
    let exact = exact(bench, &machine, &errors, &record, axes)?;
    if axes == 5 {
        nominal(bench, &machine, &errors, &rows).map_err(|e| format!("{e}\n{said}"))?;
    }
    compare(&rows, &exact, axes).map_err(|e| format!("{e}\n{said}"))
        .map(|[off, on]| {
            println!(
                "{name}: off by up to {:.1} µm and {:.0} µrad, with the compensation by {:.4} µm and {:.0} µrad",
                off[0], off[1], on[0], on[1]
            );
        })
}

/// Errors of tip (µm) and direction (µrad) without a compensation along the recorded positions.
fn exact(
    bench: &LinuxCncBench,
    machine: &str,
    errors: &str,
    record: &str,
    axes: usize,
) -> Result<Vec<[f64; 2]>, String> {
    let positions = record.lines().map(|line| {
        let cells: Vec<&str> = line.split(',').take(axes).collect();
        cells.join(",")
    });
    let positions: Vec<String> = positions.collect();
    bench.write("positions.csv", positions.join("\n"))?;
    let poses = bench.trueaxis(&["pose", machine, errors, "--positions", "positions.csv"])?;
    let apart = |row: &[f64], from: usize, factor: f64| {
        let parts = (from..from + 3).map(|i| row[i + 6] - row[i]);
        parts.map(|d| d * d).sum::<f64>().sqrt() * factor
    };
    let poses = numbers(&poses)?;
    Ok(poses
        .iter()
        .map(|row| [apart(row, 0, 1e3), apart(row, 3, 1e6)])
        .collect())
}

/// Compares where LinuxCNC's kinematics have the tool, at each stop, with `trueaxis pose`: what `linuxcnc check` relies on
/// when it compares directions and locations of axes with those of the module.
fn nominal(
    bench: &LinuxCncBench,
    machine: &str,
    errors: &str,
    rows: &[Vec<f64>],
) -> Result<(), String> {
    let poses = bench.trueaxis(&["pose", machine, errors, "--positions", "positions.csv"])?;
    let mut stops = 0;
    for (row, pose) in rows.iter().zip(numbers(&poses)?) {
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
                "at {:?} with factor {factor} the pins show {shown:?} (µm, µrad); without a compensation it is {exact:?}",
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

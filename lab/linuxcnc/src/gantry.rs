//! A gantry whose sides have errors of their own: `COMP_FILE` of each joint stays with LinuxCNC, and the component adds
//! the same to both.

use super::bench::LinuxCncBench;
use super::imported::{Described, prepare, recorded};
use programs::files;

/// X, both sides along Y, Z.
const JOINTS: [Described; 4] = [
    ("X", "LINEAR", [0.0, 200.0], "BACKLASH = 0.024\n"),
    (
        "Y",
        "LINEAR",
        [0.0, 150.0],
        "COMP_FILE = left.comp\nCOMP_FILE_TYPE = 1\n",
    ),
    (
        "Y",
        "LINEAR",
        [0.0, 150.0],
        "COMP_FILE = right.comp\nCOMP_FILE_TYPE = 1\n",
    ),
    ("Z", "LINEAR", [-150.0, 0.0], ""),
];

/// Where the errors of the sides along Y are known, mm, and the correction of each side there, mm: the side is off by
/// as much the other way.
const SIDES: [[f64; 3]; 4] = [
    [0.0, 0.004, -0.009],
    [50.0, -0.012, 0.011],
    [100.0, 0.021, -0.034],
    [150.0, 0.016, 0.007],
];

/// The bow of X in Y, 1/mm, which the component corrects on both sides.
const BOW: f64 = 2e-7;

const FOLDER: &str = "gantry";

/// # Errors
/// The violated condition.
pub fn check(bench: &LinuxCncBench) -> Result<(), String> {
    prepare(bench, FOLDER, &JOINTS)?;
    for (side, name) in [(1, "left"), (2, "right")] {
        let rows = SIDES
            .iter()
            .map(|row| format!("{} {1} {1}\n", row[0], row[side]));
        bench.write(&format!("{FOLDER}/{name}.comp"), rows.collect::<String>())?;
    }
    let [ini, machine, errors, trax] =
        ["machine.ini", "machine.toml", "errors.toml", "machine.trax"]
            .map(|name| format!("{FOLDER}/{name}"));
    let said = bench.trueaxis(&[
        "linuxcnc",
        "start",
        &ini,
        "--table",
        "X",
        "--install",
        "--yes",
    ])?;
    for line in [
        "COMP_FILE = left.comp of joint 1 stays in the INI file",
        "COMP_FILE = right.comp of joint 2 stays in the INI file",
    ] {
        if !said.contains(line) {
            return Err(format!("`{line}` is not in\n{said}"));
        }
    }
    let text = files::read_text(&bench.file(&errors))?;
    if !text.contains("EXXb") || text.contains("EYY") {
        return Err(format!("not what LinuxCNC gives away:\n{text}"));
    }
    let with_bow = text.replace("[parameters]\n", &format!("[parameters]\nEYX2 = {BOW:e}\n"));
    bench.write(&errors, with_bow)?;
    bench.compile(&machine, &errors, &trax, &[])?;
    bench.trueaxis(&["linuxcnc", "check", &ini, &trax, "--machine", &machine])?;
    judge(&recorded(bench, FOLDER)?)
}

/// By how much a side is off at a position along Y, mm.
fn off(side: usize, y: f64) -> f64 {
    let at = SIDES.windows(2).find(|pair| y <= pair[1][0]);
    let [a, b] = at.map_or([SIDES[2], SIDES[3]], |pair| [pair[0], pair[1]]);
    let share = (y - a[0]) / (b[0] - a[0]);
    -(a[side] + share * (b[side] - a[side]))
}

fn judge(rows: &[Vec<f64>]) -> Result<(), String> {
    let (mut before, mut after, mut least, mut most) = (0.0_f64, 0.0_f64, f64::MAX, 0.0_f64);
    for row in rows.chunks(JOINTS.len()) {
        let [x, left, right, _] = row else {
            return Err(format!("{} rows", rows.len()));
        };
        let y = left[1];
        let at = [(1, left), (2, right)].map(|(side, row)| row[3] + off(side, y));
        before = before.max((off(1, y) - off(2, y)).abs());
        after = after.max((at[0] - at[1]).abs());
        // Once, and on both sides: what the bow asks for, and nothing along Y.
        let bow = BOW * x[1] * x[1];
        for side in at {
            least = least.min(side.abs() - bow);
            most = most.max(side.abs() - bow);
        }
    }
    // The tables of the compensation keep 0.05 µm.
    let is_bow = least > -0.06e-3 && most < 0.06e-3;
    println!(
        "gantry: two joints with errors of their own: racked by up to {:.1} µm without, {:.4} nm with corrections; \
         both sides follow the bow of X within {:.3} µm",
        1e3 * before,
        1e6 * after,
        1e3 * most.max(-least),
    );
    match before > 0.05 && after < 1e-6 && is_bow {
        true => Ok(()),
        false => Err(format!("{before} {after} {least} {most} mm")),
    }
}

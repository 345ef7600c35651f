//! Corrected programs in `rs274`: every end point is the original's with the correction that `trueaxis eval` gives.

use super::{bare, output, plain_copy, programs, rs274};
use crate::process::target;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::Command;

/// Where the zero of the programs lies in the travel of `mill-21`.
const ZERO: [f64; 3] = [200.0, 100.0, -200.0];
/// At least so many programs are for three axes, flat, and fit there.
const LEAST: usize = 8;

/// # Errors
/// An end point that is not where it should be.
pub fn check(work: &Path) -> Result<(), String> {
    let trueaxis = target("debug").join("trueaxis");
    let blob = super::compensation(&trueaxis, work)?;
    let [x, y, z] = ZERO;
    let setup = work.join("setup.toml");
    let text = format!(
        "units = \"mm\"\n[start]\nX = {x}\nY = {y}\nZ = {z}\ntool = 1\n[offset.G54]\nX = {x}\nY = {y}\nZ = {z}\n\
         [home.G28]\nX = {x}\nY = {y}\nZ = {z}\n"
    );
    fs::write(&setup, text).map_err(|e| format!("{}: {e}", setup.display()))?;
    let no_tools = work.join("none.tbl");
    fs::write(&no_tools, "").map_err(|e| format!("{}: {e}", no_tools.display()))?;
    let (mut count, mut ends) = (0, 0);
    for path in programs()? {
        if bare(&path)?.contains(['#', '[', 'o', 'O']) {
            continue;
        }
        let copy = plain_copy(&path, work)?;
        let out = work.join("corrected.ngc");
        let _ = fs::remove_file(&out);
        let done = Command::new(&trueaxis)
            .arg("gcode")
            .arg(&copy)
            .arg("-o")
            .arg(&out)
            .arg("--compensation")
            .arg(&blob)
            .arg("--setup")
            .arg(&setup)
            .output()
            .map_err(|e| format!("trueaxis does not start: {e}"))?;
        if !done.status.success() {
            // For other axes, or beyond the travel: the comparison of interpreters tells what is refused.
            if out.exists() {
                return Err(format!("{}: refused, and written", path.display()));
            }
            continue;
        }
        let before = rs274::run(&copy, &no_tools, None)?;
        let after = rs274::run(&out, &no_tools, None)?;
        let mut positions = String::from("X,Y,Z\n");
        for motion in &before {
            let at: Vec<String> = (0..3)
                .map(|i| format!("{}", motion.to[i] + ZERO[i]))
                .collect();
            let _ = writeln!(positions, "{}", at.join(","));
        }
        let csv = work.join("positions.csv");
        fs::write(&csv, positions).map_err(|e| format!("{}: {e}", csv.display()))?;
        let printed = output(
            Command::new(&trueaxis)
                .arg("eval")
                .arg(&blob)
                .arg("--positions")
                .arg(&csv),
        )?;
        let mut rows = printed.lines();
        let header: Vec<&str> = rows.next().unwrap_or_default().split(',').collect();
        let order: Vec<usize> = ["dX", "dY", "dZ"]
            .iter()
            .filter_map(|name| header.iter().position(|h| h == name))
            .collect();
        let mut rest = after.iter();
        let (mut from, mut stood) = ([0.0; 9], [0.0; 9]);
        for (motion, row) in before.iter().zip(rows) {
            let cells: Vec<f64> = row.split(',').filter_map(|c| c.parse().ok()).collect();
            let expected: Vec<f64> = (0..3).map(|i| motion.to[i] + cells[order[i]]).collect();
            // Half a digit each of what is read, what is written, and the two that are printed.
            let digits = 2.2 * motion.digits + 1e-4;
            let arrives = |m: &rs274::Motion| {
                (0..3).all(|i| {
                    // An axis that nobody has commanded yet stands still during a rapid.
                    let held = motion.kind == "rapid" && motion.to[i] == from[i];
                    (m.to[i] - expected[i]).abs() <= digits || held && m.to[i] == stood[i]
                })
            };
            let stands = before
                .iter()
                .zip(before.iter().skip(1))
                .any(|(a, b)| std::ptr::eq(b, motion) && a.to == b.to);
            match rest.find(|m| arrives(m)) {
                Some(written) => stood = written.to,
                None if stands => {}
                None => {
                    return Err(format!(
                        "{}: nothing arrives at {expected:?}",
                        path.display()
                    ));
                }
            }
            from = motion.to;
            ends += 1;
        }
        count += 1;
    }
    println!("{count:>4} corrected programs in rs274: {ends} end points are the original's + Δq");
    match count >= LEAST {
        true => Ok(()),
        false => Err(format!(
            "only {count} programs were corrected, of at least {LEAST}"
        )),
    }
}

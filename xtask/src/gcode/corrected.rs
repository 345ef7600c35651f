//! Corrected programs in `rs274`: every end point is the original's plus the correction given by `trueaxis eval`.

use super::{correct, is_flat, plain_copy, programs, rs274};
use crate::process::{output, said};
use crate::{csv, files};
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::Command;

/// Zero of the programs in the travel of `mill-21`.
const ZERO: [f64; 3] = [200.0, 100.0, -200.0];
/// Minimum number of programs that are for three axes, flat, and fit there.
const LEAST: usize = 8;

/// # Errors
/// If an end point is wrong.
pub fn check(trueaxis: &Path, work: &Path) -> Result<(), String> {
    let blob = super::compensation(trueaxis, work)?;
    let [x, y, z] = ZERO;
    let setup = work.join("setup.toml");
    let text = format!(
        "units = \"mm\"\n[start]\nX = {x}\nY = {y}\nZ = {z}\ntool = 1\n[offset.G54]\nX = {x}\nY = {y}\nZ = {z}\n\
         [home.G28]\nX = {x}\nY = {y}\nZ = {z}\n"
    );
    files::write(&setup, text)?;
    let no_tools = work.join("none.tbl");
    files::write(&no_tools, "")?;
    let (mut count, mut ends) = (0, 0);
    for path in programs()? {
        if !is_flat(&path)? {
            continue;
        }
        let copy = plain_copy(&path, work)?;
        let out = work.join("corrected.ngc");
        let _ = fs::remove_file(&out);
        let done = said(&mut correct(trueaxis, &copy, &out, &blob, &setup))?;
        if !done.status.success() {
            // For other axes, or beyond the travel: the comparison of interpreters reports what is refused.
            if out.exists() {
                return Err(format!("{}: refused, and written", path.display()));
            }
            continue;
        }
        let before = rs274::run(&copy, &no_tools, &[])?;
        if before.is_empty() {
            // It has no motion to compare.
            count += 1;
            continue;
        }
        let after = rs274::run(&out, &no_tools, &[])?;
        let mut positions = String::from("X,Y,Z\n");
        for motion in &before {
            let at: Vec<String> = (0..3)
                .map(|i| format!("{}", motion.to[i] + ZERO[i]))
                .collect();
            let _ = writeln!(positions, "{}", at.join(","));
        }
        let table = work.join("positions.csv");
        files::write(&table, positions)?;
        let mut eval = Command::new(trueaxis);
        eval.arg("eval").arg(&blob).arg("--positions").arg(&table);
        let corrections = csv::columns::<f64>(&output(&mut eval)?, &["dX", "dY", "dZ"])?;
        let mut rest = after.iter();
        let (mut from, mut stood) = ([0.0; 9], [0.0; 9]);
        for (motion, correction) in before.iter().zip(corrections) {
            let expected: Vec<f64> = (0..3).map(|i| motion.to[i] + correction[i]).collect();
            // Half a digit each for the number read, the number written, and the two printed.
            let digits = 2.2 * motion.digits + 1e-4;
            let arrives = |m: &rs274::Rs274Motion| {
                (0..3).all(|i| {
                    // An axis that has not been commanded yet does not move during a rapid.
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

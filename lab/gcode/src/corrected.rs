//! Corrected programs in `rs274`: every end point is the original's plus the correction given by `trueaxis eval`.

use crate::rs274::{self, Rs274Motion};
use crate::{compensation, correct, is_flat, plain_copy, programs};
use programs::process::{output, said};
use programs::{csv, files};
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Zero of the programs in the travel of `mill-21`.
const ZERO: [f64; 3] = [200.0, 100.0, -200.0];
/// Minimum number of programs that are for three axes, flat, and fit there.
const LEAST: usize = 8;

/// # Errors
/// If an end point is wrong.
pub fn check(trueaxis: &Path, work: &Path) -> Result<(), String> {
    let bench = CorrectionBench::new(trueaxis, work)?;
    let (mut count, mut ends) = (0, 0);
    for path in programs()? {
        if !is_flat(&path)? {
            continue;
        }
        let found = bench.end_points(&path);
        if let Some(found) = found.map_err(|cause| format!("{}: {cause}", path.display()))? {
            count += 1;
            ends += found;
        }
    }
    println!("{count:>4} corrected programs in rs274: {ends} end points are the original's + Δq");
    match count >= LEAST {
        true => Ok(()),
        false => Err(format!(
            "only {count} programs were corrected, of at least {LEAST}"
        )),
    }
}

/// Files and the command.
struct CorrectionBench<'t> {
    trueaxis: &'t Path,
    work: &'t Path,
    blob: PathBuf,
    setup: PathBuf,
    no_tools: PathBuf,
}

impl<'t> CorrectionBench<'t> {
    fn new(trueaxis: &'t Path, work: &'t Path) -> Result<Self, String> {
        let [x, y, z] = ZERO;
        let setup = work.join("setup.toml");
        let text = format!(
            "units = \"mm\"\n[start]\nX = {x}\nY = {y}\nZ = {z}\ntool = 1\n[offset.G54]\nX = {x}\nY = {y}\nZ = {z}\n\
             [home.G28]\nX = {x}\nY = {y}\nZ = {z}\n"
        );
        files::write(&setup, text)?;
        let no_tools = work.join("none.tbl");
        files::write(&no_tools, "")?;
        Ok(Self {
            trueaxis,
            work,
            blob: compensation(trueaxis, work)?,
            setup,
            no_tools,
        })
    }

    /// Number of end points that are right; `None` if the program is refused.
    fn end_points(&self, path: &Path) -> Result<Option<usize>, String> {
        let copy = plain_copy(path, self.work)?;
        let out = self.work.join("corrected.ngc");
        let _ = fs::remove_file(&out);
        let done = said(&mut correct(
            self.trueaxis,
            &copy,
            &out,
            &self.blob,
            &self.setup,
        ))?;
        if !done.status.success() {
            // For other axes, or beyond the travel: the comparison of interpreters reports what is refused.
            return match out.exists() {
                true => Err("refused, and written".to_owned()),
                false => Ok(None),
            };
        }
        let before = rs274::run(&copy, &self.no_tools, &[])?;
        if before.is_empty() {
            // It has no motion to compare.
            return Ok(Some(0));
        }
        let after = rs274::run(&out, &self.no_tools, &[])?;
        compare(&before, &after, &self.corrections(&before)?)?;
        Ok(Some(before.len()))
    }

    /// What `trueaxis eval` gives for the end points of motions.
    fn corrections(&self, motions: &[Rs274Motion]) -> Result<Vec<Vec<f64>>, String> {
        let mut positions = String::from("X,Y,Z\n");
        for motion in motions {
            let [x, y, z] = [0, 1, 2].map(|i| motion.to[i] + ZERO[i]);
            let _ = writeln!(positions, "{x},{y},{z}");
        }
        let table = self.work.join("positions.csv");
        files::write(&table, positions)?;
        let mut eval = Command::new(self.trueaxis);
        eval.arg("eval").arg(&self.blob);
        eval.arg("--positions").arg(&table);
        csv::columns(&output(&mut eval)?, &["dX", "dY", "dZ"])
    }
}

/// Every motion arrives where it went before, corrected.
fn compare(
    before: &[Rs274Motion],
    after: &[Rs274Motion],
    corrections: &[Vec<f64>],
) -> Result<(), String> {
    let mut rest = after.iter();
    let (mut from, mut stood) = ([0.0; 9], [0.0; 9]);
    for (k, (motion, correction)) in before.iter().zip(corrections).enumerate() {
        let expected: Vec<f64> = (0..3).map(|i| motion.to[i] + correction[i]).collect();
        // Half a digit each for the number read, the number written, and the two printed.
        let digits = 2.2 * motion.digits + 1e-4;
        let arrives = |m: &&Rs274Motion| {
            (0..3).all(|i| {
                // An axis that has not been commanded yet does not move during a rapid.
                let held = motion.kind == "rapid" && motion.to[i] == from[i];
                (m.to[i] - expected[i]).abs() <= digits || held && m.to[i] == stood[i]
            })
        };
        let stands = k > 0 && before[k - 1].to == motion.to;
        match rest.find(arrives) {
            Some(written) => stood = written.to,
            None if stands => {}
            None => return Err(format!("nothing arrives at {expected:?}")),
        }
        from = motion.to;
    }
    Ok(())
}

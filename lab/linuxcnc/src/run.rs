//! A scenario driven under LinuxCNC's motion controller, and its recording.

use super::bench::LinuxCncBench;
use super::rows::{self, RecordedRows};
use programs::files;
use std::fs;
use std::io::ErrorKind;

/// Joints, in LinuxCNC's order.
pub const JOINTS: [&str; 5] = ["X", "Y", "Z", "A", "C"];
pub const PERIOD: f64 = 1e-3;
/// Values recorded by `firmware/linuxcnc/tests/xyzac.hal` for each joint, and others.
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
const BESIDES: [&str; 9] = [
    "factor",
    "fault-code",
    "loads",
    "enabled",
    "read",
    "write",
    "matrix",
    "kins",
    "nothing",
];
/// Number of roundings in a following error: the offset and the correction are added and removed again.
const ROUNDINGS: f64 = 4.0;

/// Result of a scenario.
pub struct ScenarioRun {
    pub rows: RecordedRows,
    /// `name value…`, as reported by `drive.py`.
    pub told: Vec<Vec<String>>,
    said: String,
}

impl ScenarioRun {
    /// Drives a scenario of `drive.py`.
    ///
    /// # Errors
    /// If LinuxCNC does not finish.
    pub fn of(bench: &LinuxCncBench, scenario: &str) -> Result<Self, String> {
        let folder = "firmware/linuxcnc/tests";
        for name in ["xyzac.ini", "xyzac.hal", "drive.py", "tool.tbl"] {
            bench.copy(&format!("{folder}/{name}"), name)?;
        }
        // The results of an earlier scenario must not be used instead.
        for name in ["record", "result"] {
            let file = bench.file(name);
            match fs::remove_file(&file) {
                Err(e) if e.kind() != ErrorKind::NotFound => {
                    return Err(format!("{}: {e}", file.display()));
                }
                _ => {}
            }
        }
        bench.write("scenario", scenario)?;
        let mut said = bench.inside(&["linuxcnc", "/tmp/xyzac.ini"])?;
        // Without a terminal, messages go here; without messages there is no file.
        for name in ["linuxcnc_print.txt", "linuxcnc_debug.txt"] {
            said += &fs::read_to_string(bench.file(name)).unwrap_or_default();
        }
        let told = files::read_text(&bench.file("result")).map_err(|e| format!("{e}\n{said}"))?;
        let told: Vec<Vec<String>> = told
            .lines()
            .map(|l| l.split('\t').map(str::to_owned).collect())
            .collect();
        let names: Vec<String> = (0..JOINTS.len())
            .flat_map(|j| OF_JOINT.map(|what| format!("{j}.{what}")))
            .chain(BESIDES.map(str::to_owned))
            .collect();
        let rows =
            RecordedRows::read(bench, "record", &names).map_err(|e| format!("{e}\n{said}"))?;
        let run = Self { rows, told, said };
        run.told("done")?;
        Ok(run)
    }

    pub fn told(&self, name: &str) -> Result<Vec<f64>, String> {
        let line = self.told.iter().find(|words| words[0] == name);
        let line = line
            .ok_or_else(|| format!("nothing is told of {name}: {:?}\n{}", self.told, self.said))?;
        Ok(line[1..].iter().filter_map(|w| w.parse().ok()).collect())
    }

    pub fn of_joint(&self, joint: usize, what: &str) -> Vec<f64> {
        self.rows.of(&format!("{joint}.{what}"))
    }

    /// The command is passed on with the correction added; the controller sees its own command.
    pub fn adds_up(&self) -> Result<f64, String> {
        let mut largest = 0.0_f64;
        for j in 0..JOINTS.len() {
            let of = |what| self.of_joint(j, what);
            let (cmd, drive, fb, correction) = (of("cmd"), of("drive"), of("fb"), of("correction"));
            // The drive is at its command of the previous period.
            rows::adds_up(j, &correction, [&cmd, &drive], [&drive, &fb])?;
            // Each rounds by half of the last digit of the largest number added.
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
    pub fn positions(&self) -> Vec<Vec<f64>> {
        let columns: Vec<usize> = (0..JOINTS.len())
            .map(|j| self.rows.column(&format!("{j}.pos")))
            .collect();
        let rows = self.rows.rows();
        rows.map(|row| columns.iter().map(|&c| row[c]).collect())
            .collect()
    }
}

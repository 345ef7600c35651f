//! The compensations to flash: one for every example, built with the real command.

use crate::Failure;
use crate::board::Setup;
use std::path::PathBuf;
use std::process::Command;
use std::sync::OnceLock;
use trueaxis::link::{EvaluateRow, MOST_AXES};
use trueaxis::{AUXILIARIES, AlignedBlob, AuxiliaryKind, Compensation, Inputs, Travel, Travelling};
use trueaxis_tests::Fixed;

/// Name, machine, error parameters, further options.
pub const CASES: [(&str, &str, &str, &[&str]); 10] = [
    (
        "huron-13",
        "huron-k2x8/machine",
        "huron-k2x8/errors-13",
        &[],
    ),
    (
        "huron-13-tool-length",
        "huron-k2x8/machine-tool-length",
        "huron-k2x8/errors-13",
        &[],
    ),
    ("hu40-13", "hu40/machine", "hu40/errors-13", &[]),
    (
        "hu40-84",
        "hu40/machine",
        "hu40/errors-84",
        // Finer tolerances, which are tried otherwise, take minutes.
        &["--allow-large", "--tolerance", "1"],
    ),
    ("kolibri-10", "kolibri/machine", "kolibri/errors-10", &[]),
    ("kolibri-12", "kolibri/machine", "kolibri/errors-12", &[]),
    (
        "kolibri-81",
        "kolibri/machine",
        "kolibri/errors-81",
        // `exact` would search for minutes for what its corrections of 6 mm leave.
        &["--allow-large", "--scheme", "poly25"],
    ),
    (
        "fork-head-13",
        "fork-head/machine",
        "fork-head/errors-13",
        &[],
    ),
    (
        "table-head-13",
        "table-head/machine",
        "table-head/errors-13",
        &[],
    ),
    ("router-10", "router/machine", "router/errors-10", &[]),
];

/// A compiled example.
pub struct Case {
    pub name: &'static str,
    pub path: PathBuf,
    pub blob: AlignedBlob,
}

/// The examples, each compiled when first needed, for all boards.
pub struct Compiled {
    /// The command `trueaxis`.
    command: PathBuf,
    /// Where the blobs are written.
    pub folder: PathBuf,
    done: [OnceLock<Result<PathBuf, String>>; CASES.len()],
}

impl Compiled {
    /// Nothing compiled yet.
    pub fn new(command: PathBuf, folder: PathBuf) -> Self {
        Self {
            command,
            folder,
            done: [const { OnceLock::new() }; CASES.len()],
        }
    }

    /// Compiles an example with the real command; returns the file.
    fn compile(&self, number: usize) -> Result<PathBuf, String> {
        let (name, machine, errors, further) = CASES[number];
        let examples = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples");
        let path = self.folder.join(format!("{name}.trax"));
        // The result of an earlier run must not be used instead.
        let _ = std::fs::remove_file(&path);
        let output = Command::new(&self.command)
            .arg("compile")
            .arg(format!("{examples}/{machine}.toml"))
            .arg(format!("{examples}/{errors}.toml"))
            .arg("-o")
            .arg(&path)
            .args(further)
            // The published coefficients of some examples cannot meet the tolerance.
            .arg("--best-effort")
            .output()
            .map_err(|e| e.to_string())?;
        // 1: written, but the tolerance is not met.
        if !matches!(output.status.code(), Some(0 | 1)) {
            return Err(String::from_utf8_lossy(&output.stderr).into());
        }
        Ok(path)
    }
}

/// An example, compiled.
pub fn compile(setup: &Setup<'_>, name: &str) -> Result<Case, Failure> {
    let number = CASES.iter().position(|case| case.0 == name);
    let number = number.ok_or("no such case")?;
    let compiled = setup.compiled;
    let path = compiled.done[number].get_or_init(|| compiled.compile(number));
    let path = path.clone()?;
    let blob = AlignedBlob::from_bytes(&std::fs::read(&path)?);
    Ok(Case {
        name: CASES[number].0,
        path,
        blob,
    })
}

impl Case {
    /// Loads it with the capacities of the board.
    pub fn load(&self) -> Result<Compensation<'_>, Failure> {
        Ok(Compensation::decode(&self.blob)?)
    }
}

/// Half the stroke of an endless axis.
const ENDLESS: f32 = 720.0;

/// Travel of axis `k`, or part of it if the axis is endless; 0 beyond the axes.
fn travel(c: &Compensation<'_>, k: usize) -> [f32; 2] {
    let part = |end: f32| {
        if end.abs() > 1e6 {
            ENDLESS.copysign(end)
        } else {
            end
        }
    };
    c.axes()
        .get(k)
        .map_or([0.0; 2], |axis| axis.travel.map(part))
}

/// A random position in the travel or slightly beyond.
pub fn position(c: &Compensation<'_>, random: &mut Fixed) -> [f32; 8] {
    std::array::from_fn(|k| {
        let [low, high] = travel(c, k);
        let beyond = 0.02 * (high - low);
        random.within(f64::from(low - beyond), f64::from(high + beyond)) as f32
    })
}

/// Random auxiliary values: tool lengths around that of the tables, temperatures within ±20 K.
pub fn auxiliaries(c: &Compensation<'_>, random: &mut Fixed) -> [f32; AUXILIARIES] {
    let mut values = [0.0; AUXILIARIES];
    for (value, auxiliary) in values.iter_mut().zip(c.auxiliaries()) {
        *value = match auxiliary.kind {
            AuxiliaryKind::ToolLength => auxiliary.reference + random.within(-90.0, 90.0) as f32,
            AuxiliaryKind::Temperature => random.within(-20.0, 20.0) as f32,
        };
    }
    values
}

/// A random position with random directions of travel.
pub fn row(c: &Compensation<'_>, random: &mut Fixed) -> EvaluateRow {
    const { assert!(MOST_AXES >= 8) };
    EvaluateRow {
        inputs: Inputs {
            axes: position(c, random),
            auxiliaries: auxiliaries(c, random),
        },
        travelling: Travelling(std::array::from_fn(|_| {
            [Travel::Unknown, Travel::Positive, Travel::Negative][random.bits() as usize % 3]
        })),
    }
}

/// A path of all axes at once, as in milling a five-axis part: lines across the part while the rotary axes swing, each
/// axis with its own period, smooth, with reversals; `n` periods.
pub fn tool_path(c: &Compensation<'_>, n: usize) -> Vec<[f32; 8]> {
    (0..n)
        .map(|i| {
            std::array::from_fn(|k| {
                let [low, high] = travel(c, k);
                let (middle, half) = (0.5 * (low + high), 0.4 * (high - low));
                // Slow axes beside fast ones, none a multiple of another.
                let turns = i as f64 * [1.0, 0.31, 0.17, 0.73, 0.43, 0.23, 0.11, 0.07][k] / 4000.0;
                let swing = (std::f64::consts::TAU * turns).sin() as f32;
                middle + half * swing
            })
        })
        .collect()
}

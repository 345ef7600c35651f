//! The whole process: a plan, probings of a machine with known errors, identification of these errors, their tables on
//! the board, and the same machine probed with the board's corrections.
//!
//! The command performs everything except the last step. The probings with the compensation on are simulated here: the
//! axis positions follow from the board's answers.

use crate::board::{Board, Setup, text};
use crate::{Failure, Seen};
use serde_json::Value;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use trueaxis::link::EvaluateRow;
use trueaxis::{Inputs, Travel, Travelling};
use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_identify::formats::probings::{self, Probing};
use trueaxis_identify::simulate::{Disturbances, compensated};
use trueaxis_link::{Client, Tcp};
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind, Switches};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{MAX_AXES, Machine, PerAxis};
use trueaxis_model::uncertainty;
use trueaxis_model::validate::Command;
use trueaxis_tests::{Fixed, errors, machine, read};

/// A machine, its true errors, the plan, and the plan that validates the compensation.
struct Way {
    folder: &'static str,
    errors: &'static str,
    model: &'static str,
    parameters: usize,
    /// Candidates for `plan`.
    plan: &'static [&'static str],
    validation: &'static str,
}

/// The Kolibri with the plan that validated its compensation (one ball, 60 pairs of A and C), and the HU40 with its
/// plan of four balls, a bar and an indexed spindle.
const WAYS: [Way; 2] = [
    Way {
        folder: "kolibri",
        errors: "errors-12.toml",
        model: "12",
        parameters: 12,
        plan: &[
            "--probings",
            "60",
            "--indexings",
            "A=-55:55:11,C=-360:360:30",
        ],
        validation: "validation.csv",
    },
    Way {
        folder: "hu40",
        errors: "errors-13.toml",
        model: "13",
        parameters: 13,
        plan: &[
            "--probings",
            "40",
            "--indexings",
            "B=-90:90:30,C=-360:360:60,S=0:300:60",
            "--cone",
            "90",
        ],
        validation: "plan.csv",
    },
];

/// Noise of a coordinate (µm).
const NOISE: &str = "1";
/// Number of calibrations of each machine, each with its own noise; the first one is validated.
const CALIBRATIONS: usize = 4;
/// Number of positions in the probed range at which the remaining volumetric error is examined, each time.
const POSITIONS: usize = 500;
/// Additional error permitted for tables (mm): the tolerance of `compile`.
const TABLES: f64 = 5e-5;
/// Minimum fraction of these positions in the band: errors of one calibration are correlated, so a fraction of 0.95
/// scatters as if each of four were one position or more, by 0.11 or less; two and a half times that.
const LEAST_INSIDE: f64 = 0.67;
/// Among 25 errors of parameters, one in 6000 exceeds this number of its standard uncertainties.
const FARTHEST: f64 = 4.5;

pub fn run(setup: &Setup<'_>) -> Seen {
    let mut seen = String::new();
    for way in &WAYS {
        let told = Walk::new(setup, way).and_then(|mut walk| walk.go());
        seen += &told.map_err(|e| format!("{}: {e}", way.folder))?;
    }
    Ok(seen)
}

/// State of one machine.
struct Walk<'s> {
    setup: &'s Setup<'s>,
    way: &'s Way,
    folder: PathBuf,
    board: Board<'s>,
    machine: Machine,
    truth: ErrorModel,
    artefact: Artefact,
}

/// The volumetric error at the tip (mm): sums over positions.
#[derive(Default)]
struct Remaining {
    before: f64,
    left: f64,
    band: f64,
    inside: usize,
    positions: usize,
}

impl<'s> Walk<'s> {
    fn new(setup: &'s Setup<'s>, way: &'s Way) -> Result<Self, Failure> {
        let folder = setup.folder.join(format!("way-{}-files", way.folder));
        // Left by an earlier run.
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder)?;
        let mut board = setup.board(&format!("way-{}", way.folder))?;
        board.start()?;
        let machine = machine(&format!("examples/{}/machine.toml", way.folder));
        let artefact = read(&format!("examples/{}/artefact.toml", way.folder));
        let artefact = Artefact::from_toml(&artefact, machine.tool_axis);
        Ok(Self {
            truth: errors(&format!("examples/{}/{}", way.folder, way.errors), &machine),
            artefact: artefact.map_err(|e| format!("{e:?}"))?,
            setup,
            way,
            folder,
            board,
            machine,
        })
    }

    /// A file of the example.
    fn example(&self, name: &str) -> String {
        let examples = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples");
        format!("{examples}/{}/{name}", self.way.folder)
    }

    /// A file produced along the way.
    fn file(&self, name: &str) -> Result<String, Failure> {
        Ok(text(&self.folder.join(name))?.to_owned())
    }

    /// Runs `trueaxis WORDS` for this machine; returns the output.
    fn trueaxis(&self, words: &[&str], further: &[&str]) -> Result<String, Failure> {
        let machine = self.example("machine.toml");
        self.setup.answer(&[words, &[&machine], further].concat())
    }

    fn go(&mut self) -> Result<String, Failure> {
        let (artefact, plan) = (self.example("artefact.toml"), self.file("plan.csv")?);
        let words = [
            "--artefact",
            &artefact,
            "--model",
            self.way.model,
            "-o",
            &plan,
        ];
        self.trueaxis(&["plan"], &[&words, self.way.plan].concat())?;
        let mut remaining = Remaining::default();
        let mut told = String::new();
        for seed in 1..=CALIBRATIONS {
            let known = self.calibrated(seed, &plan)?;
            if seed == 1 {
                told = self.validated(&known)?;
            }
            self.remaining(&known, seed as u64, &mut remaining)?;
        }
        let positions = remaining.positions as f64;
        let [before, left, band] =
            [remaining.before, remaining.left, remaining.band].map(|sum| sum / positions * 1e3);
        let inside = remaining.inside as f64 / positions;
        // The remaining error is below the band on average, whatever the noise.
        if inside < LEAST_INSIDE || left > band {
            return Err(format!("{left} µm are left, {inside} of them in the band, {band}").into());
        }
        let _ = writeln!(
            told,
            "  tip, {CALIBRATIONS} calibrations with {POSITIONS} positions each: {before:.2} µm before, {left:.2} µm left (mean); in the 95 % interval (mean {band:.2} µm) at {:.1} %",
            100.0 * inside
        );
        Ok(told)
    }

    /// Simulates a calibration, identifies, compiles, flashes; returns the errors found.
    fn calibrated(&self, seed: usize, plan: &str) -> Result<ErrorModel, Failure> {
        let [probings, errors, blob] =
            ["probings.csv", "errors.toml", "machine.trax"].map(|name| self.file(name));
        let (probings, errors, blob) = (probings?, errors?, blob?);
        self.probed(plan, seed, &probings, &[])?;
        self.identified(&probings, &["-o", &errors])?;
        self.trueaxis(&["compile"], &[&errors, "-o", &blob, "--random", "1000"])?;
        self.board.flash(Path::new(&blob), &["--activate"])?;
        let beside = |name: &str| {
            let path = self.folder.join(name);
            fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))
        };
        let known = ErrorModel::with_files(&fs::read_to_string(&errors)?, &self.machine, &beside);
        Ok(known.map_err(|e| format!("{errors}: {e:?}"))?)
    }

    /// `simulate probings`.
    fn probed(&self, plan: &str, seed: usize, to: &str, more: &[&str]) -> Result<(), Failure> {
        let (truth, artefact) = (self.example(self.way.errors), self.example("artefact.toml"));
        let seed = seed.to_string();
        let words = [
            &truth,
            "--artefact",
            &artefact,
            "--plan",
            plan,
            "--noise",
            NOISE,
        ];
        let words = [&words[..], &["--seed", &seed, "-o", to], more].concat();
        self.trueaxis(&["simulate", "probings"], &words)?;
        Ok(())
    }

    /// `identify`.
    fn identified(&self, probings: &str, more: &[&str]) -> Result<String, Failure> {
        let artefact = self.example("artefact.toml");
        let words = [probings, "--artefact", &artefact, "--model", self.way.model];
        self.trueaxis(&["identify"], &[&words[..], more].concat())
    }

    /// What the board adds to the axes (mm, deg) for these commands.
    fn corrections(
        &self,
        client: &mut Client<Tcp>,
        commands: &[Command],
    ) -> Result<Vec<PerAxis>, Failure> {
        let rows: Vec<EvaluateRow> = commands.iter().map(row).collect();
        let found = client.evaluate(&rows, self.machine.axes.len(), 0)?;
        let of = |dq: [f32; 8]| std::array::from_fn(|i| f64::from(dq[i]));
        Ok(found.into_iter().map(of).collect())
    }

    /// Probes with another plan, without and with the board's corrections: the eliminated part of each parameter.
    fn validated(&self, known: &ErrorModel) -> Result<String, Failure> {
        let plan = self.example(self.way.validation);
        let [before, old, after, twin, blob] = [
            "before.csv",
            "before.toml",
            "after.csv",
            "twin.csv",
            "machine.trax",
        ]
        .map(|name| self.file(name));
        let (before, old, after, twin, blob) = (before?, old?, after?, twin?, blob?);
        self.probed(&plan, 1001, &before, &[])?;
        self.identified(&before, &["-o", &old])?;
        let (mut client, _) = self.board.connect()?;
        let measured = compensated(
            &Kinematics::new(&self.machine, &self.truth),
            &self.artefact,
            &probings::read(&fs::read_to_string(&plan)?, &self.machine, false)
                .map_err(|e| format!("{e:?}"))?,
            &Disturbances {
                noise: 1e-3 * NOISE.parse::<f64>()?,
                seed: 1002,
                ..Disturbances::default()
            },
            |rows: &[Probing]| {
                let command =
                    |row: &Probing| Command::coming(&self.machine, &row.position, &row.direction);
                let commands: Vec<Command> = rows.iter().map(command).collect();
                self.corrections(&mut client, &commands)
            },
        )?;
        drop(client);
        fs::write(&after, probings::write(&measured, &self.machine))?;
        // The command reports the same for the same tables.
        self.probed(&plan, 1002, &twin, &["--active", &blob])?;
        if fs::read(&after)? != fs::read(&twin)? {
            return Err(format!("{after} is not {twin}").into());
        }
        let found = self.identified(&after, &["--before", &old, "--json"])?;
        self.compensability(&serde_json::from_str(&found)?, known)
    }

    /// The table of a validation. The remainder of each parameter is explained by the uncertainties of the calibration
    /// and the validation.
    fn compensability(&self, found: &Value, known: &ErrorModel) -> Result<String, Failure> {
        let compensated = &found["compensated"];
        let all = compensated["parameters"]
            .as_array()
            .ok_or("no parameters")?;
        if all.len() != self.way.parameters {
            return Err(format!("{} parameters, not {}", all.len(), self.way.parameters).into());
        }
        let mut told = format!(
            "\n  {}: before, with compensation, compensability (k = 2), effect on the tip before and after\n",
            self.machine.name
        );
        for one in all {
            let name = one["parameter"].as_str().ok_or("no name")?;
            let parameter = Parameter::parse(name).ok_or("no parameter")?;
            let number = |key: &str| one[key].as_f64().ok_or(format!("{name}: no {key}"));
            let (before, after) = (number("before")?, number("after")?);
            let calibrated = known.standard_uncertainty[&parameter];
            let uncertainty = number("after_standard_uncertainty")?.hypot(calibrated);
            if after.abs() > FARTHEST * uncertainty {
                return Err(format!("{name}: {after} is left, ± {uncertainty}").into());
            }
            let part = match one["compensability"].as_f64() {
                Some(part) => {
                    let of_part = number("compensability_standard_uncertainty")?;
                    format!("{:.1} ± {:.1} %", 100.0 * part, 200.0 * of_part)
                }
                None if one["is_small_before"] == true => "too small before".to_owned(),
                None => return Err(format!("{name}: {one}").into()),
            };
            let (factor, unit) = unit(parameter);
            let effect = |k: usize| one["effect_um"][k].as_f64().unwrap_or(f64::NAN);
            let _ = writeln!(
                told,
                "  {name:<6}{:>10.1}{:>8.1} {unit:<5}{part:>18}{:>10.2}{:>8.2} µm",
                before * factor,
                after * factor,
                effect(0),
                effect(1)
            );
        }
        Ok(told)
    }

    /// The remaining volumetric error with the board's corrections, and the one predicted from the uncertainty of the
    /// parameters.
    fn remaining(
        &self,
        known: &ErrorModel,
        seed: u64,
        sums: &mut Remaining,
    ) -> Result<(), Failure> {
        let mut random = Fixed::new(seed);
        let mut command = || {
            let mut position = PerAxis::default();
            let mut direction = PerAxis::default();
            for (i, (axis, range)) in self.machine.axes.iter().zip(&known.calibrated).enumerate() {
                let [low, high] = range.map(|q| axis.to_command(q));
                position[i] = random.within(low, high);
                direction[i] = random.within(-1.0, 1.0);
            }
            Command::coming(&self.machine, &position, &direction)
        };
        let commands: Vec<Command> = (0..POSITIONS).map(|_| command()).collect();
        let (mut client, _) = self.board.connect()?;
        let corrections = self.corrections(&mut client, &commands)?;
        let places: Vec<_> = commands
            .iter()
            .map(|c| c.kinematic(&self.machine))
            .collect();
        let leaves = uncertainty::leaves(&self.machine, known, &known.covariance(), &places);
        let real = Kinematics::new(&self.machine, &self.truth);
        for ((command, correction), ((q, situation), leaves)) in commands
            .iter()
            .zip(&corrections)
            .zip(places.iter().zip(&leaves))
        {
            let moved: PerAxis =
                std::array::from_fn(|i| f64::from(command.axes[i]) + correction[i]);
            let moved = self.machine.to_kinematic(&moved);
            let wanted = real.nominal(q, None).t;
            let off = |q: &PerAxis| (real.actual(q, situation, &Switches::ALL).t - wanted).norm();
            let (before, left, band) = (off(q), off(&moved), leaves.tip_band());
            sums.before += before;
            sums.left += left;
            sums.band += band;
            sums.inside += usize::from(left <= band + TABLES);
            sums.positions += 1;
        }
        Ok(())
    }
}

fn row(command: &Command) -> EvaluateRow {
    let mut row: EvaluateRow = EvaluateRow {
        inputs: Inputs::default(),
        travelling: Travelling([Travel::Unknown; 8]),
    };
    row.inputs.axes[..MAX_AXES].copy_from_slice(&command.axes);
    row.travelling.0[..MAX_AXES].copy_from_slice(&command.travel);
    row
}

/// Unit in which a parameter is shown, relative to mm, rad or mm/mm.
fn unit(parameter: Parameter) -> (f64, &'static str) {
    match (parameter.is_angular(), parameter.kind) {
        (true, _) => (1e6, "µrad"),
        (false, ParameterKind::Inter) => (1e3, "µm"),
        (false, _) => (1e6, "µm/m"),
    }
}

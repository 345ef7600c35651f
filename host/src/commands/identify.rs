//! `trueaxis identify`

use super::Outcome;
use super::bad_input::BadInput;
use super::files::{self, Text};
use clap::Args;
use serde::Serialize;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use trueaxis::Travel;
use trueaxis_host::compile::belongs;
use trueaxis_host::errors::{ErrorModel, Parameter, ParameterKind};
use trueaxis_host::formats::artefact::Artefact;
use trueaxis_host::formats::probings::{self, Probings};
use trueaxis_host::identify::{
    AutoError, Identified, IdentifyError, Level, Model, ModelError, Options, Problem, Unknown,
    automatic, error_file, identify,
};
use trueaxis_host::machine::Machine;
use trueaxis_host::validate::{Command, Runtime};

/// Identify error parameters, with their uncertainties, from probings of balls
///
/// A row of the probings has the axis positions at which the stylus was on the centre of a ball. The parameters,
/// the balls and the stylus are found together; parameters that these probings cannot tell get no value, but a
/// sentence that says why. The error file can be given to `trueaxis compile` as it is.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis identify machine.toml probings.csv --model 12 -o errors.toml\n\n\
Probings: a header, then one probing per line, mm and degrees. Beside ball and axes there may be S (spindle\n\
angle), run, time_s, sigma_um (standard uncertainty of a coordinate), temperature_C, and A_dir … (1 or -1:\n\
direction from which an axis came):\n  ball,X,Y,Z,A,C\n  1,70.012,20.004,111.497,0,0\n\n\
Models: 10, 12 and 13 (locations, scales, backlash, spindle; two rotary axes in the workpiece branch), 81 and\n\
84 (the coefficients published for two machines), auto (what the probings see), or names: EA0Z,EXX1,ECCb"
)]
pub struct Arguments {
    /// Machine description (machine.toml)
    machine: PathBuf,
    /// Probings (CSV)
    #[arg(value_name = "PROBINGS.csv")]
    probings: PathBuf,
    /// Which parameters to look for
    #[arg(long, default_value = "auto", value_name = "10|12|13|81|84|auto|NAMES")]
    model: String,
    /// What is known of balls, bars and stylus (artefact.toml)
    #[arg(long, value_name = "FILE")]
    artefact: Option<PathBuf>,
    /// Where to write the parameters (errors.toml)
    #[arg(short, long, value_name = "ERRORS.toml")]
    output: Option<PathBuf>,
    /// Let rows that fit badly count less
    #[arg(long)]
    robust: bool,
    /// Keep what this error file says of parameters that are not looked for
    #[arg(long, value_name = "OLD.toml")]
    update: Option<PathBuf>,
    /// The compensation that was on while probing, which is undone
    #[arg(long, value_name = "FILE.trax")]
    active: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let inputs = [
        Some(&arguments.machine),
        Some(&arguments.probings),
        arguments.artefact.as_ref(),
        arguments.update.as_ref(),
        arguments.active.as_ref(),
    ];
    let inputs: Vec<&Path> = inputs.into_iter().flatten().map(PathBuf::as_path).collect();
    if let Some(output) = &arguments.output {
        files::prepare(output, &inputs)?;
    }
    let machine = files::read_machine(&arguments.machine)?;
    let text = Text::read(&arguments.probings)?;
    let mut measured = probings::read(&text.text, &machine, true).map_err(|e| text.bad(e))?;
    let artefact = match &arguments.artefact {
        Some(path) => {
            let text = Text::read(path)?;
            Artefact::from_toml(&text.text, machine.tool_axis).map_err(|e| text.bad(e))?
        }
        None => Artefact::default(),
    };
    let base = match &arguments.update {
        Some(path) => known(path, &machine)?,
        None => ErrorModel::perfect(&machine),
    };
    if let Some(path) = &arguments.active {
        undo(&mut measured, path, &machine, &base)?;
    }
    let model: Model = arguments.model.parse().map_err(no_model)?;
    let options = Options {
        robust: arguments.robust,
    };
    let (identified, levels) = match model {
        Model::Auto => automatic(&machine, &measured, &artefact, &base, options).map_err(
            |error| match error {
                AutoError::Model(error) => no_model(error),
                AutoError::Identify(error) => arguments.not_identified(&error),
            },
        )?,
        model => {
            let parameters = model.parameters(&machine, 0, &[]).map_err(no_model)?;
            let problem = Problem::new(&machine, &measured, &artefact, &parameters, &base);
            let identified =
                identify(&problem, options).map_err(|e| arguments.not_identified(&e))?;
            (identified, Vec::new())
        }
    };
    if let Some(output) = &arguments.output {
        let errors = error_file(&machine, &measured, &identified);
        files::write(output, errors.as_bytes())?;
    }
    if arguments.json {
        files::print_json(&Answer::new(&machine, &measured, &identified, &levels))?;
    } else {
        files::print(&screen(&machine, &measured, &identified, &levels))?;
    }
    Ok(Outcome::Done)
}

/// What an error file says already; one with more than parameters would not be whole afterwards.
fn known(path: &Path, machine: &Machine) -> Result<ErrorModel, BadInput> {
    let errors = files::read_errors(path, machine)?;
    let mut motions = errors.motions.iter().flatten();
    if motions.any(|m| m.table.is_some() || !m.thermal.is_empty())
        || !errors.inter_thermal.is_empty()
    {
        return Err(BadInput::new(
            format!(
                "{}: tables and thermal changes cannot be kept by --update",
                path.display()
            ),
            "identify without --update, and copy the parameters into the file",
        ));
    }
    Ok(errors)
}

pub(super) fn no_model(error: ModelError) -> BadInput {
    BadInput::new(format!("--model: {}", error.reason), error.remedy)
}

impl Arguments {
    fn not_identified(&self, error: &IdentifyError) -> BadInput {
        let remedy = match error {
            IdentifyError::TooFew { .. } => {
                "probe at more rotary positions, or give a model with fewer parameters"
            }
            IdentifyError::NotConverged { .. } | IdentifyError::NothingSeen { .. } => {
                "look whether the machine file describes this machine (trueaxis pose), whether linear positions are machine coordinates without tool length, and whether balls have the right names"
            }
        };
        BadInput::new(format!("{}: {error}", self.probings.display()), remedy)
    }
}

/// Adds what a compensation has done to the axes.
fn undo(
    measured: &mut Probings,
    path: &Path,
    machine: &Machine,
    base: &ErrorModel,
) -> Result<(), BadInput> {
    let blob = files::read_blob(path)?;
    let runtime = Runtime::load(&blob).map_err(|e| BadInput::in_blob(e, path))?;
    belongs(machine, base, &runtime).map_err(|e| BadInput::mismatch(&e, path))?;
    for row in &mut measured.rows {
        let mut command = Command::at(machine, &row.position);
        for (travel, direction) in command.travel.iter_mut().zip(row.direction) {
            *travel = match direction {
                d if d > 0.0 => Travel::Positive,
                d if d < 0.0 => Travel::Negative,
                _ => Travel::Unknown,
            };
        }
        for (position, correction) in row.position.iter_mut().zip(runtime.evaluate(&command)) {
            *position += f64::from(correction);
        }
    }
    Ok(())
}

/// Correlations above this are named.
const CORRELATED: f64 = 0.9;

/// Pairs of parameters whose correlation is above [`CORRELATED`].
fn correlated(identified: &Identified) -> Vec<(usize, usize, f64)> {
    let covariance = &identified.covariance;
    let count = identified.parameters.len();
    let all = (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j)));
    all.map(|(i, j)| {
        (
            i,
            j,
            covariance[(i, j)] / (covariance[(i, i)] * covariance[(j, j)]).sqrt(),
        )
    })
    .filter(|(_, _, r)| r.abs() > CORRELATED)
    .collect()
}

/// The answer for programs. Parameters in mm, rad, per mm or rad to their degree; the rest as the names say.
#[derive(Serialize)]
struct Answer<'a> {
    machine: &'a str,
    probings: usize,
    balls: Vec<Ball<'a>>,
    stylus_mm: [f64; 3],
    parameters: Vec<One>,
    correlations: Vec<(String, String, f64)>,
    covariance: Vec<Vec<f64>>,
    unseen: Vec<NotSeen>,
    noise_um: f64,
    noise_of_stated: Option<f64>,
    degrees_of_freedom: usize,
    condition: f64,
    levels: Vec<AtLevel>,
    rows: Vec<AtRow>,
}

#[derive(Serialize)]
struct Ball<'a> {
    name: &'a str,
    place_mm: [f64; 3],
}

#[derive(Serialize)]
struct One {
    parameter: String,
    value: f64,
    standard_uncertainty: f64,
    expanded_uncertainty: f64,
}

#[derive(Serialize)]
struct NotSeen {
    unknown: String,
    sentence: String,
    /// What others are off by, per unit of this.
    with: Vec<(String, f64)>,
}

#[derive(Serialize)]
struct AtLevel {
    degree: u8,
    parameters: usize,
    left_um: f64,
    held_out_um: f64,
}

#[derive(Serialize)]
struct AtRow {
    line: usize,
    before_um: [f64; 3],
    after_um: [f64; 3],
    is_trusted: bool,
}

impl<'a> Answer<'a> {
    fn new(
        machine: &'a Machine,
        measured: &'a Probings,
        identified: &Identified,
        levels: &[Level],
    ) -> Self {
        let name = |i: usize| identified.parameters[i].parameter.to_string();
        let um = |v: nalgebra::Vector3<f64>| (v * 1e3).into();
        Self {
            machine: &machine.name,
            probings: measured.rows.len(),
            balls: (measured.balls.iter().zip(&identified.balls))
                .map(|(name, place)| Ball {
                    name,
                    place_mm: (*place).into(),
                })
                .collect(),
            stylus_mm: identified.stylus.into(),
            parameters: (identified.parameters.iter())
                .map(|e| One {
                    parameter: e.parameter.to_string(),
                    value: e.value,
                    standard_uncertainty: e.uncertainty,
                    expanded_uncertainty: EXPANDED * e.uncertainty,
                })
                .collect(),
            correlations: correlated(identified)
                .into_iter()
                .map(|(i, j, r)| (name(i), name(j), r))
                .collect(),
            covariance: identified
                .covariance
                .row_iter()
                .map(|row| row.iter().copied().collect())
                .collect(),
            unseen: (identified.unseen.iter())
                .map(|u| NotSeen {
                    unknown: u.unknown.to_string(),
                    sentence: u.sentence(),
                    with: u
                        .with
                        .iter()
                        .map(|(u, part)| (u.to_string(), *part))
                        .collect(),
                })
                .collect(),
            noise_um: identified.noise * 1e3,
            noise_of_stated: identified.of_stated,
            degrees_of_freedom: identified.freedom,
            condition: identified.condition,
            levels: (levels.iter())
                .map(|l| AtLevel {
                    degree: l.degree,
                    parameters: l.parameters,
                    left_um: l.left * 1e3,
                    held_out_um: l.held_out * 1e3,
                })
                .collect(),
            rows: (measured.rows.iter().zip(&identified.rows))
                .map(|(row, found)| AtRow {
                    line: row.line,
                    before_um: um(found.before),
                    after_um: um(found.after),
                    is_trusted: found.is_trusted,
                })
                .collect(),
        }
    }
}

/// Coverage factor of expanded uncertainties: 95 %.
pub(super) const EXPANDED: f64 = 2.0;
/// Rows that are named, at most.
const NAMED: usize = 10;

/// What a person reads.
fn screen(
    machine: &Machine,
    measured: &Probings,
    identified: &Identified,
    levels: &[Level],
) -> String {
    let mut text = format!(
        "{}: {} parameters from {} probings of {}\n\n",
        machine.name,
        identified.parameters.len(),
        measured.rows.len(),
        count(measured.balls.len(), "ball")
    );
    let _ = writeln!(text, "parameter        value   standard   expanded (k = 2)");
    for e in &identified.parameters {
        let p = e.parameter;
        let (factor, unit) = unit(p);
        let show = |v: f64| match factor {
            Some(factor) => format!("{:.2}", v * factor),
            None => format!("{v:.2e}"),
        };
        let _ = writeln!(
            text,
            "  {:<8}{:>12}{:>11}{:>11} {unit}",
            p.to_string(),
            show(e.value),
            show(e.uncertainty),
            show(EXPANDED * e.uncertainty)
        );
    }
    let distances = |of: fn(&trueaxis_host::identify::Row) -> f64| {
        let all = identified.rows.iter().map(of);
        let most = all.clone().fold(0.0, f64::max);
        (
            all.sum::<f64>() / identified.rows.len() as f64 * 1e3,
            most * 1e3,
        )
    };
    let (mean, most) = distances(|row| row.before.norm());
    let (rest, worst) = distances(|row| row.after.norm());
    let _ = writeln!(text, "\nfrom tip to ball (µm)      mean    maximum");
    let _ = writeln!(text, "  nominal machine      {mean:>8.2}{most:>11.2}");
    let _ = writeln!(text, "  unexplained          {rest:>8.2}{worst:>11.2}");
    let _ = writeln!(
        text,
        "noise of a coordinate {:.2} µm, from {} degrees of freedom; condition {:.0}",
        identified.noise * 1e3,
        identified.freedom,
        identified.condition
    );
    if let Some(factor) = identified.of_stated {
        let _ = writeln!(
            text,
            "that is {factor:.2} times what the file states, which uncertainties rest on"
        );
    }
    let close = correlated(identified);
    if !close.is_empty() {
        text += "\ncorrelations above 0.9\n";
        for (i, j, r) in close.iter().take(NAMED) {
            let [a, b] = [i, j].map(|k| identified.parameters[*k].parameter);
            let _ = writeln!(text, "  {a} and {b}: {r:.3}");
        }
        more(&mut text, close.len());
    }
    if !identified.unseen.is_empty() {
        text += "\nnot to be seen in these probings\n";
        let parameters =
            |u: &&trueaxis_host::identify::Unseen| matches!(u.unknown, Unknown::Parameter(_));
        for unseen in identified.unseen.iter().filter(parameters) {
            let _ = writeln!(text, "  {}", unseen.sentence());
        }
    }
    if !levels.is_empty() {
        text += "\ndegree   parameters   left (µm)   of balls held out (µm)\n";
        for l in levels {
            let _ = writeln!(
                text,
                "{:>6}{:>13}{:>12.2}{:>25.2}",
                l.degree,
                l.parameters,
                l.left * 1e3,
                l.held_out * 1e3
            );
        }
    }
    let rows = measured.rows.iter().zip(&identified.rows);
    let mut doubtful: Vec<(usize, f64)> = rows
        .filter(|(_, r)| !r.is_trusted)
        .map(|(row, r)| (row.line, r.after.norm()))
        .collect();
    doubtful.sort_by(|a, b| b.1.total_cmp(&a.1));
    if !doubtful.is_empty() {
        text += "\nrows that fit badly\n";
        for (line, distance) in doubtful.iter().take(NAMED) {
            let _ = writeln!(text, "  line {line}: {:.1} µm", distance * 1e3);
        }
        more(&mut text, doubtful.len());
    }
    text
}

fn more(text: &mut String, count: usize) {
    if count > NAMED {
        let _ = writeln!(text, "  and {} more", count - NAMED);
    }
}

pub(super) fn count(number: usize, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}

/// In what a parameter is shown.
pub(super) fn unit(parameter: Parameter) -> (Option<f64>, &'static str) {
    match (parameter.kind, parameter.is_angular()) {
        (ParameterKind::Degree(1), false) if "XYZUVW".contains(parameter.axis) => {
            (Some(1e6), "µm/m")
        }
        (ParameterKind::Degree(k), angular) if k > 0 => (
            None,
            if angular {
                "rad per mm or rad to the degree"
            } else {
                "mm per mm or rad to the degree"
            },
        ),
        (_, true) => (Some(1e6), "µrad"),
        (_, false) => (Some(1e3), "µm"),
    }
}

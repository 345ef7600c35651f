//! `trueaxis compile`

use super::bad_input::BadInput;
use super::files::{self, MachineFiles};
use super::progress::Bar;
use super::{Outcome, screen};
use clap::{Args, ValueEnum};
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis::SampleFormat;
use trueaxis_host::compile::{self, AxisBounds, Proof, Size, Warning, over_bounds};
use trueaxis_host::machine::Machine;
use trueaxis_host::schemes::{self, exact};
use trueaxis_host::validate::Runtime;

/// Turn a machine and its errors into a compensation, and prove what it does
///
/// Writes FILE.trax, reads it back, evaluates it with the runtime at random positions over the
/// whole travel with random directions of travel, and compares with the exact kinematic model.
/// Exits with 1 if the tolerance is not met inside the calibrated range; the file is written all
/// the same.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis compile examples/huron-k2x8/machine.toml examples/huron-k2x8/errors-13.toml -o huron.trax"
)]
pub struct Arguments {
    #[command(flatten)]
    files: MachineFiles,
    /// The compensation to write
    #[arg(short, long, value_name = "FILE.trax")]
    output: PathBuf,
    /// How tables are found
    #[arg(long, value_enum, default_value = "exact")]
    scheme: Scheme,
    /// What is to be least: instructions per evaluation, or the number of tables
    #[arg(long, value_enum, default_value = "cost")]
    minimize: Minimize,
    /// Largest difference to the kinematic correction: µm, and the same number of µrad
    #[arg(long, value_name = "µm", default_value_t = 0.05, value_parser = positive)]
    tolerance: f64,
    /// Points of every table that is not a straight line (default: as the tolerance needs)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=65536))]
    points: Option<u32>,
    /// Subtract the correction at this position everywhere, so that the machine's datum stays;
    /// axes left out are at 0
    #[arg(long, value_name = "X=0,Y=0,…")]
    zero_at: Option<String>,
    /// How samples are stored
    #[arg(long, value_enum, default_value = "f32")]
    samples: Samples,
    /// Accept corrections whose bound exceeds 1 mm or 1°
    #[arg(long)]
    allow_large: bool,
    #[command(flatten)]
    random: Random,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

/// Random positions.
#[derive(Args, Clone, Copy)]
pub struct Random {
    /// Random positions in each region of the verification
    #[arg(long, value_name = "N", default_value_t = 20_000, value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    pub random: u32,
    /// Seed of the random positions
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub seed: u64,
}

#[derive(Clone, Copy, ValueEnum)]
enum Scheme {
    /// Finds the factors itself, for any machine and any errors
    Exact,
}

#[derive(Clone, Copy, ValueEnum)]
enum Minimize {
    /// Instructions per evaluation
    Cost,
    /// The number of tables
    Tables,
}

#[derive(Clone, Copy, ValueEnum)]
enum Samples {
    /// 4 bytes each
    F32,
    /// 2 bytes each
    I16,
}

/// A finite number above 0.
pub fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("write a number above 0".to_owned()),
    }
}

/// Reads `X=0,Y=0,…` (mm, deg); axes left out are at 0.
pub fn zero_position(text: &str, machine: &Machine) -> Result<Vec<f64>, BadInput> {
    let bad = |cause: String| {
        let letters: Vec<String> = machine
            .axes
            .iter()
            .map(|a| format!("{}=0", a.letter))
            .collect();
        BadInput::new(
            format!("--zero-at: {cause}"),
            format!(
                "write a position within the travel in mm and degrees, like {}",
                letters.join(",")
            ),
        )
    };
    let mut position: Vec<Option<f64>> = vec![None; machine.axes.len()];
    for part in text.split(',') {
        let Some((name, value)) = part.split_once('=') else {
            return Err(bad(format!(
                "`{part}` is not an axis, an equals sign and a number"
            )));
        };
        let mut letters = name.trim().chars();
        let index = match (letters.next(), letters.next()) {
            (Some(letter), None) => machine.index(letter),
            _ => None,
        };
        let Some(index) = index else {
            return Err(bad(format!("the machine has no axis `{}`", name.trim())));
        };
        if position[index].is_some() {
            return Err(bad(format!("axis {} is given twice", name.trim())));
        }
        match value.trim().parse::<f64>() {
            Ok(value) if value.is_finite() => position[index] = Some(value),
            _ => return Err(bad(format!("`{}` is no finite number", value.trim()))),
        }
    }
    let position: Vec<f64> = position
        .into_iter()
        .map(Option::unwrap_or_default)
        .collect();
    for (axis, q) in machine.axes.iter().zip(&position) {
        let [low, high] = axis.travel;
        if *q < low || *q > high {
            return Err(bad(format!(
                "{} = {q} is outside its travel {low} to {high} {}",
                axis.letter,
                axis.unit()
            )));
        }
    }
    Ok(position)
}

/// The answer for programs.
#[derive(Serialize)]
struct Answer<'a> {
    file: &'a Path,
    machine: &'a str,
    scheme: &'static str,
    tolerance_um: f64,
    tolerance_urad: f64,
    meets_tolerance: bool,
    #[serde(flatten)]
    size: Size,
    axes: &'a [AxisBounds],
    #[serde(flatten)]
    proof: &'a Proof,
    notes: &'a [String],
    warnings: Vec<Message<'a>>,
}

#[derive(Serialize)]
struct Message<'a> {
    message: String,
    #[serde(flatten)]
    warning: &'a Warning,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let Arguments {
        files,
        output,
        tolerance,
        ..
    } = arguments;
    files::prepare(output, &[&files.machine, &files.errors])?;
    let (machine, errors) = files.read()?;
    let zero_at = arguments
        .zero_at
        .as_deref()
        .map(|text| zero_position(text, &machine))
        .transpose()?;
    let options = compile::Options {
        scheme: match arguments.scheme {
            Scheme::Exact => schemes::Scheme::Exact {
                minimize: match arguments.minimize {
                    Minimize::Cost => exact::Minimize::Cost,
                    Minimize::Tables => exact::Minimize::Tables,
                },
            },
        },
        tables: schemes::Options {
            tolerance: tolerance * 1e-3,
            points: arguments.points.map(|n| n as usize),
            format: match arguments.samples {
                Samples::F32 => SampleFormat::F32,
                Samples::I16 => SampleFormat::I16,
            },
            zero_at,
            ..schemes::Options::default()
        },
        allow_large: arguments.allow_large,
        random: arguments.random.random as usize,
        seed: arguments.random.seed,
    };
    let bar = Bar::new();
    let built = compile::build(&machine, &errors, &options, &bar)?;
    files::write(output, &built.blob)?;

    // Prove what lies on the disk, not what was meant to be written.
    let blob = files::read_blob(output)?;
    let runtime = Runtime::load(&blob).map_err(|e| BadInput::in_blob(e, output))?;
    let zero = options
        .tables
        .zero(&machine, &errors)
        .map_err(compile::CompileError::from)?;
    let proof = compile::prove(
        &machine,
        &errors,
        &runtime,
        &zero,
        options.random,
        options.seed,
        &bar,
    )?;
    drop(bar);

    let meets = proof.meets(*tolerance);
    let mut warnings = built.warnings.clone();
    warnings.extend(over_bounds(&built.bounds, &proof.travel.largest));
    if arguments.json {
        files::print_json(&Answer {
            file: output,
            machine: &machine.name,
            scheme: options.scheme.name(),
            tolerance_um: *tolerance,
            tolerance_urad: *tolerance,
            meets_tolerance: meets,
            size: built.size,
            axes: &built.bounds,
            proof: &proof,
            notes: &built.notes,
            warnings: warnings
                .iter()
                .map(|warning| Message {
                    message: warning.to_string(),
                    warning,
                })
                .collect(),
        })?;
    } else {
        let mut text = format!("{}: {}\n", output.display(), machine.name);
        text += &screen::size(&built.size);
        text.push('\n');
        text += &screen::quality(&proof);
        text.push('\n');
        text += &screen::bounds(&built.bounds, &proof.travel.largest);
        text += &screen::tool_length(&proof);
        files::print(&text)?;
    }
    for note in &built.notes {
        eprintln!("note: {note}");
    }
    for warning in &warnings {
        eprintln!("warning: {warning}");
    }
    if meets {
        return Ok(Outcome::Done);
    }
    let inside = proof.inside();
    eprintln!(
        "the tolerance of {tolerance} µm and µrad is not met: {} µm and {} µrad were achieved; {} was written all the same",
        screen::number(inside.difference_um),
        screen::number(inside.difference_urad),
        output.display()
    );
    Ok(Outcome::CheckFailed)
}

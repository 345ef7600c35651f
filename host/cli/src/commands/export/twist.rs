//! `trueaxis export klipper-twist`

use super::{LeftOptions, refused};
use crate::commands::files::MachineFiles;
use crate::commands::number::{finite, two};
use crate::commands::{Outcome, bad_input::BadInput, output};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis_export::klipper::twist::{self, Lookup, NozzleProbe};

/// Write the errors of a probe beside the nozzle on axes that twist (Klipper's axis_twist_compensation)
///
/// Klipper adds it to readings of the probe, not to motions. What is left over the travel is printed, and more than the
/// tolerance is refused.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis export klipper-twist machine.toml errors.toml --probe 0,25 -o twist.cfg"
)]
pub struct Arguments {
    #[command(flatten)]
    files: MachineFiles,
    /// x_offset and y_offset of [probe]
    #[arg(long, value_name = "X,Y", required = true, value_delimiter = ',', allow_hyphen_values = true, value_parser = finite)]
    probe: Vec<f64>,
    /// Position of Z at which it touches the bed
    #[arg(long, value_name = "mm", default_value_t = 0.0, allow_negative_numbers = true, value_parser = finite)]
    bed: f64,
    /// Where the firmware looks a value up: `bed`, Klipper since its pull request 7343 of August 2026; `nozzle`, Klipper
    /// before it, and Kalico
    #[arg(long, value_enum, default_value_t)]
    lookup: Lookup,
    /// Points of each table
    #[arg(long, value_name = "N", default_value_t = 9, value_parser = clap::value_parser!(u16).range(2..=100))]
    points: u16,
    /// Where to write the section
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    left: LeftOptions,
}

#[derive(Serialize)]
struct TwistAnswer<'a> {
    file: &'a Path,
    written: bool,
    meets_tolerance: bool,
    tolerance_um: f64,
    /// Largest error of a reading, but for a constant.
    largest_um: f64,
    /// What the tables leave.
    left_um: f64,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let Arguments { output, lookup, .. } = arguments;
    let tolerance_um = arguments.left.tolerance;
    let (machine, errors) = arguments.files.read()?;
    output::prepare(output, &[&arguments.files.machine, &arguments.files.errors])?;
    let bad = |error| refused(&error, &arguments.files.machine);
    let offset = two(&arguments.probe, "--probe", "mm")?;
    let probe = NozzleProbe::new(&machine, &errors, offset, arguments.bed).map_err(bad)?;
    let points = arguments.points.into();
    let tables = probe.tables(points, *lookup).map_err(bad)?;
    let text = twist::print(&tables, *lookup);
    let again = twist::read_again(&text).map_err(bad)?;
    let [largest_um, left_um] = probe.left(&again, *lookup).map_err(bad)?;
    let texts = [(output.clone(), text)];
    let verdict = arguments.left.write(&texts, left_um <= tolerance_um)?;
    let answer = TwistAnswer {
        file: output,
        written: verdict.written,
        meets_tolerance: verdict.meets,
        tolerance_um,
        largest_um,
        left_um,
    };
    output::print_answer(arguments.left.json, &answer, || {
        format!("{}\n{}", texts[0].1, screen(&answer, *lookup))
    })?;
    Ok(verdict.outcome(
        &format!("more than {tolerance_um} µm remains"),
        "the tables add a value over X and one over Y",
    ))
}

/// What the tables do, with the firmware that they are for.
fn screen(answer: &TwistAnswer<'_>, lookup: Lookup) -> String {
    let other = match lookup {
        Lookup::Bed => "nozzle",
        Lookup::Nozzle => "bed",
    };
    format!(
        "readings of the probe are wrong by up to ±{:.2} µm, with these tables by ±{:.2} µm,\n\
         in {}; for others give --lookup {other}\n",
        answer.largest_um,
        answer.left_um,
        lookup.firmware(),
    )
}

//! `trueaxis import cec`

use crate::commands::cec as shared;
use crate::commands::files::Text;
use crate::commands::policy::PolicyArguments;
use crate::commands::progress::ProgressBarOnScreen;
use crate::commands::{Outcome, bad_input::BadInput, files, output, screen};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis::{AlignedBlob, Auxiliary, AuxiliaryKind, Draft};
use trueaxis_export::cec::{self, CorrectionLimit, Limited, NamedAxes, ReadOptions, draft, read};
use trueaxis_model::machine::Machine;
use trueaxis_model::source::FileError;
use trueaxis_model::validate::Runtime;
use trueaxis_tables::compile::{AxisBounds, CompileError, Size, bounds_of};

/// Convert tables of a Sinumerik 840D or 828D to a compensation
///
/// Reads CEC tables and encoder tables. Statements that are not understood are refused, with their line. Warns about
/// unlikely values: slopes over 5 µm/mm, a value that stands out, a rounded STEP, a limit ($MA_CEC_MAX_SUM,
/// $MA_CEC_MAX_VELO) that the tables exceed.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis import cec cec.mpf --machine machine.toml --axes X=AX1,Y=AX2,Z=AX3,A=AX4,C=AX5 --factor-tables not-added -o machine.trax"
)]
pub struct Arguments {
    /// The tables in the controller's archive format
    #[arg(value_name = "FILE")]
    tables: PathBuf,
    /// Machine description
    #[arg(long, value_name = "machine.toml")]
    machine: PathBuf,
    /// Where to write the compensation
    #[arg(short, long, value_name = "FILE.trax")]
    output: PathBuf,
    /// Whether the controller also adds a table that multiplies another one
    #[arg(long, value_enum)]
    factor_tables: cec::FactorTables,
    /// The controller's name of each axis that has a table; an axis may be given several times
    #[arg(long, value_name = "X=AX1,Y=AX2,…")]
    axes: String,
    /// Unit of lengths, if the file does not say METRIC or INCH
    #[arg(long, value_enum)]
    units: Option<cec::LengthUnit>,
    /// Meaning of the $AA_ENC_COMP values, if there are any
    #[arg(long, value_enum)]
    encoder_values: Option<cec::EncoderValues>,
    #[command(flatten)]
    policy: PolicyArguments,
    /// Accept corrections whose bound exceeds 2 mm or 1°
    #[arg(long)]
    allow_large: bool,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct ImportCecAnswer<'a> {
    file: &'a Path,
    machine: &'a str,
    #[serde(flatten)]
    size: Size,
    warnings: Vec<String>,
    bounds: &'a [AxisBounds],
}

/// Seed of the positions at which bounds are computed.
const SEED: u64 = 1;

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let Arguments { output, .. } = arguments;
    output::prepare(output, &[&arguments.tables, &arguments.machine])?;
    let machine = files::read_machine(&arguments.machine)?;
    let text = Text::read(&arguments.tables)?;
    let axes = NamedAxes::of(&machine, &arguments.axes).map_err(|error| shared::axes(&error))?;
    let reading = ReadOptions {
        axes: &axes,
        factor_tables: arguments.factor_tables,
        units: arguments.units,
        encoder: arguments.encoder_values,
    };
    let policy = arguments.policy.stored()?;
    let found = read(&text.text, &reading).map_err(|e| text.bad(e))?;
    let (tables, factor_tables) = (&found.tables, reading.factor_tables);
    let auxiliaries = auxiliaries(&machine);
    let mut draft = draft(
        &machine.name,
        policy,
        &axes,
        auxiliaries,
        tables,
        factor_tables,
    );
    let (size, bounds) = arguments.bounded(&machine, &text, &mut draft)?;
    output::write(output, &encoded(&text, &draft)?)?;
    let beyond = (found.limits.iter()).filter_map(|limit| beyond(limit, &machine, &bounds));
    let doubts = found.doubts.iter().cloned().chain(beyond);
    let warnings: Vec<String> = doubts.map(|doubt| warned(&text, &doubt)).collect();
    for warning in &warnings {
        eprintln!("warning: {warning}");
    }
    let answer = ImportCecAnswer {
        file: output,
        machine: &machine.name,
        size,
        warnings,
        bounds: &bounds,
    };
    output::print_answer(arguments.json, &answer, || {
        let largest: Vec<f64> = bounds.iter().map(|b| b.largest).collect();
        let title = format!("{}: {}\n", output.display(), machine.name);
        title + &screen::size(&answer.size) + "\n" + &screen::bounds(&bounds, &largest)
    })?;
    Ok(Outcome::Done)
}

impl Arguments {
    /// Gives a compensation the bounds of its axes, from what its tables contain.
    fn bounded(
        &self,
        machine: &Machine,
        text: &Text,
        draft: &mut Draft,
    ) -> Result<(Size, Vec<AxisBounds>), BadInput> {
        let provisional = encoded(text, draft)?;
        let runtime = Runtime::load(&provisional).map_err(CompileError::from)?;
        let bar = ProgressBarOnScreen::new();
        let bounds = bounds_of(machine, &runtime, SEED, &bar)?;
        drop(bar);
        let large = |bound: &&AxisBounds| bound.value_bound > bound.most();
        if let (Some(bound), false) = (bounds.iter().find(large), self.allow_large) {
            return Err(too_large(text, bound));
        }
        for (axis, bound) in draft.axes.iter_mut().zip(&bounds) {
            bound.set(axis);
        }
        Ok((Size::of(&runtime), bounds))
    }
}

fn encoded(text: &Text, draft: &Draft) -> Result<AlignedBlob, BadInput> {
    draft.encode().map_err(|error| {
        BadInput::new(
            format!("{}: {error}", text.name),
            "these tables fit no compensation file: check their values, MIN, MAX and STEP",
        )
    })
}

/// A correction that is hardly meant.
fn too_large(text: &Text, bound: &AxisBounds) -> BadInput {
    BadInput::new(
        format!(
            "{}: the correction of {} reaches {:.3} {}",
            text.name, bound.axis, bound.largest, bound.unit
        ),
        "look at the unit and the values, and whether --factor-tables is right; if it is meant, give --allow-large",
    )
}

/// A doubt with its place and what to do about it.
fn warned(text: &Text, doubt: &FileError) -> String {
    format!(
        "{}: {}\n  {}",
        text.place(doubt),
        doubt.message,
        doubt.remedy
    )
}

/// A correction that the controller limits to less, in size or in speed, than its tables contain.
fn beyond(limit: &CorrectionLimit, machine: &Machine, bounds: &[AxisBounds]) -> Option<FileError> {
    let (axis, bound) = (&machine.axes[limit.axis], &bounds[limit.axis]);
    let unit = bound.unit;
    let (name, most, needed, unit) = match limit.limited {
        Limited::Sum => ("MD32720", limit.value, bound.largest, unit.to_owned()),
        Limited::Velocity => (
            "MD32730",
            1e-2 * limit.value * axis.max_speed,
            bound.largest_rate,
            format!("{unit}/s"),
        ),
    };
    (needed > most).then(|| {
        FileError::at(
            limit.span.clone(),
            format!(
                "{name} stops the correction of {} at {most:.4} {unit}, and its tables reach {needed:.4} {unit}",
                bound.axis
            ),
            "limited here",
            "the controller compensates less than what was imported, or later: raise the limit, or look at the tables",
        )
    })
}

/// The tool length, if it is an input of the machine; no table depends on it.
fn auxiliaries(machine: &Machine) -> Vec<Auxiliary> {
    let length = machine.length_range.map(|_| Auxiliary {
        kind: AuxiliaryKind::ToolLength,
        name: "tool length".try_into().unwrap_or_default(),
        reference: machine.tool_length() as f32,
        sensor: trueaxis::Sensor::USUAL,
    });
    length.into_iter().collect()
}

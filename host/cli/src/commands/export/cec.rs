//! `trueaxis export cec`

use crate::commands::cec as shared;
use crate::commands::number::{finite, positive};
use crate::commands::progress::ProgressBarOnScreen;
use crate::commands::random::RandomOptions;
use crate::commands::{Outcome, bad_input::BadInput, files, output};
use clap::{Args, ValueEnum};
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis_export::cec::{
    self, AxisDifference, CecOptions, CecPlan, CecProof, CecTolerance, LongProducts, NamedAxes,
    Note, TableLimits, plan, print, prove,
};
use trueaxis_gcode::compiled_from;
use trueaxis_model::policy::{of_blob, tolerance_urad};
use trueaxis_model::validate::Runtime;
use trueaxis_tables::compile::Progress;

/// Write a compensation as tables of a Sinumerik 840D or 828D (CEC)
///
/// Rewrites the tables to the controller's rules (one input and one output per table, products of two), reads the
/// text back, evaluates it under both interpretations of factor tables and compares the result with the
/// compensation. Exits with 1 and writes nothing if they differ by more than the tolerance.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis export cec machine.trax --axes X=AX1,Y=AX2,Z=AX3,A=AX4,C=AX5 --factor-tables not-added -o cec.mpf\n  \
trueaxis export cec --probe AX1 -o probe.mpf"
)]
pub struct Arguments {
    /// The compensation
    #[arg(value_name = "FILE.trax", required_unless_present = "probe")]
    blob: Option<PathBuf>,
    /// Where to write the tables
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Whether the controller also adds a table that multiplies another one; find out with --probe
    #[arg(long, value_enum, required_unless_present = "probe")]
    factor_tables: Option<cec::FactorTables>,
    /// The controller's name of each axis
    #[arg(long, value_name = "X=AX1,Y=AX2,…", required_unless_present = "probe")]
    axes: Option<String>,
    /// Instead, write two constant tables for the axis with this name; their displayed sum shows which
    /// --factor-tables applies
    #[arg(long, value_name = "AX1", conflicts_with_all = ["blob", "factor_tables", "axes"])]
    probe: Option<String>,
    /// Target controller
    #[arg(long, value_enum, default_value = "840d")]
    controller: CecController,
    /// Number of tables in the controller (default: twice its largest number of axes; 840D: 62, 828D: 8)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1000))]
    tables: Option<u16>,
    /// Largest number of values per table (828D: 200; 840D: the value of MD18342)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(3..))]
    points: Option<u16>,
    /// Number of the first table, if the tables before it are in use
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u16).range(..1000))]
    first: u16,
    /// Largest magnitude of a table that multiplies another one; a wrong --factor-tables can cause an error of no
    /// more than a few times this
    #[arg(long, value_name = "mm|deg", default_value_t = 2.0, value_parser = positive)]
    factor_limit: f64,
    /// Tool length at which the tables hold, if it is an input (default: that of the machine file)
    #[arg(long, value_name = "mm", allow_negative_numbers = true, value_parser = finite)]
    tool_length: Option<f64>,
    /// What to do with products of functions of more than two axes
    #[arg(long, value_enum, default_value = "refuse")]
    long_products: LongProducts,
    /// Machine description from which it was compiled: gives the name of the tool length
    #[arg(long, value_name = "machine.toml")]
    machine: Option<PathBuf>,
    /// Largest permitted difference from the compensation
    #[arg(long, value_name = "µm", default_value_t = 0.05, value_parser = positive)]
    tolerance: f64,
    #[command(flatten)]
    random: RandomOptions,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum CecController {
    /// 62 tables
    #[value(name = "840d")]
    Sinumerik840D,
    /// 8 tables of 200 values
    #[value(name = "828d")]
    Sinumerik828D,
}

#[derive(Serialize)]
struct ExportCecAnswer<'a> {
    file: &'a Path,
    written: bool,
    machine: &'a str,
    factor_tables: cec::FactorTables,
    tables: usize,
    first_table: usize,
    /// Number of values of each table, for MD18342.
    values: Vec<usize>,
    largest_factor: f32,
    tool_length_mm: Option<f64>,
    tolerance: CecTolerance,
    meets_tolerance: bool,
    notes: &'a [Note],
    verification: &'a CecProof,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let output = &arguments.output;
    if let Some(axis) = &arguments.probe {
        return write_probe(arguments, axis);
    }
    let missing = || BadInput::new("an argument is missing", "see trueaxis export cec --help");
    let path = arguments.blob.as_ref().ok_or_else(missing)?;
    let map = arguments.axes.as_ref().ok_or_else(missing)?;
    let factor_tables = arguments.factor_tables.ok_or_else(missing)?;
    output::prepare(output, &[path])?;
    let blob = files::read_blob(path)?;
    let runtime = Runtime::load(&blob).map_err(|e| BadInput::in_blob(e, path))?;
    let compensation = runtime.compensation();
    let axes = NamedAxes::new(compensation.axes(), map).and_then(NamedAxes::complete);
    let axes = axes.map_err(|error| shared::axes(&error))?;
    let tolerance = CecTolerance {
        um: arguments.tolerance,
        urad: tolerance_urad(of_blob(compensation.policy()), arguments.tolerance),
    };
    let options = arguments.options(factor_tables, tolerance);
    let made = plan(compensation, &axes, &options)
        .map_err(|e| BadInput::new(format!("{}: {e}", path.display()), e.remedy()))?;
    let machine = arguments.machine.as_deref().map(files::read_machine);
    let machine = machine.transpose()?;
    if let Some(machine) = &machine {
        compiled_from(machine, compensation)
            .map_err(|e| BadInput::new(e.to_string(), e.remedy()))?;
    }
    let length = made.length.or(machine.map(|m| m.tool_length()));
    let comments = cec::comments(compensation, factor_tables, length, &made, &axes);
    let first = options.limits.first;
    let text = print(&made.tables, &axes, first, &comments);
    let verification = arguments.read_again(&text, &runtime, &axes, &made, factor_tables)?;
    let meets = verification.meets(tolerance);
    if meets {
        output::write(output, text.as_bytes())?;
    }
    let answer = ExportCecAnswer {
        file: output,
        written: meets,
        machine: compensation.machine(),
        factor_tables,
        tables: made.tables.len(),
        first_table: first,
        values: made.tables.iter().map(cec::CecTable::stored).collect(),
        largest_factor: made.largest_factor(),
        tool_length_mm: length,
        tolerance,
        meets_tolerance: meets,
        notes: &made.notes,
        verification: &verification,
    };
    output::print_answer(arguments.json, &answer, || screen(&answer, &made, &axes))?;
    Ok(warned(&made, tolerance, meets))
}

/// Prints what the tables do not follow, and why nothing was written.
fn warned(made: &CecPlan, tolerance: CecTolerance, meets: bool) -> Outcome {
    for sensor in &made.sensors {
        eprintln!(
            "warning: the temperature of `{sensor}` is taken to be its reference: the tables do not follow it"
        );
    }
    if meets {
        return Outcome::Done;
    }
    eprintln!(
        "nothing is written: the tables differ from the compensation by more than {} µm or {} µrad",
        tolerance.um, tolerance.urad
    );
    Outcome::CheckFailed
}

/// Writes the two tables that show which interpretation applies.
fn write_probe(arguments: &Arguments, axis: &str) -> Result<Outcome, BadInput> {
    if !cec::is_name(axis) {
        return Err(BadInput::new(
            format!("--probe: `{axis}` is not a name of an axis"),
            "write the controller's name of the axis to look at, like AX1",
        ));
    }
    output::prepare(&arguments.output, &[])?;
    let first = usize::from(arguments.first);
    let text = cec::probe(&axis.to_ascii_uppercase(), first);
    output::write(&arguments.output, text.as_bytes())?;
    output::print(&format!(
        "{}: tables {first} and {} for {axis}\nthe compensation that is shown then: 0.005 --factor-tables not-added, \
         0.010 --factor-tables added\n",
        arguments.output.display(),
        first + 1
    ))?;
    Ok(Outcome::Done)
}

impl Arguments {
    /// Reads the tables as the controller will, and compares them with the compensation.
    fn read_again(
        &self,
        text: &str,
        runtime: &Runtime<'_>,
        axes: &NamedAxes,
        made: &CecPlan,
        factor_tables: cec::FactorTables,
    ) -> Result<CecProof, BadInput> {
        let bar = ProgressBarOnScreen::new();
        bar.stage("reading it again", 0);
        let RandomOptions { random, seed } = self.random;
        let found = prove(
            text,
            runtime,
            axes,
            made,
            factor_tables,
            random as usize,
            seed,
        );
        drop(bar);
        found.map_err(|error| {
            let blob = self.blob.as_deref().map(Path::display);
            BadInput::new(
                format!(
                    "{}: {error}",
                    blob.map_or(String::new(), |blob| blob.to_string())
                ),
                "this is a fault of trueaxis: please report it with the file",
            )
        })
    }

    fn options(&self, factor_tables: cec::FactorTables, tolerance: CecTolerance) -> CecOptions {
        let mut limits = match self.controller {
            CecController::Sinumerik840D => TableLimits::SINUMERIK_840D,
            CecController::Sinumerik828D => TableLimits::SINUMERIK_828D,
        };
        limits.first = self.first.into();
        limits.tables = self.tables.map_or(limits.tables, usize::from);
        limits.points = self.points.map(usize::from).or(limits.points);
        CecOptions {
            factor_tables,
            limits,
            factor_limit: self.factor_limit,
            tolerance,
            length: self.tool_length,
            long: self.long_products,
        }
    }
}

fn screen(answer: &ExportCecAnswer<'_>, plan: &CecPlan, axes: &NamedAxes) -> String {
    let mut text = format!("{}: {}\n", answer.file.display(), answer.machine);
    let each: Vec<String> = (0..axes.axes.len())
        .map(|axis| {
            let count = plan.tables.iter().filter(|t| t.output == axis).count();
            format!("{} {count}", axes.letter(axis))
        })
        .collect();
    text += &format!(
        "{} tables from number {} ({}), for a controller with factor tables {}\n",
        answer.tables,
        answer.first_table,
        each.join(", "),
        answer.factor_tables.name()
    );
    let most = answer.values.iter().max().copied().unwrap_or_default();
    text += &format!(
        "largest factor {:.4}; at most {most} values in a table (MD18342)\n",
        answer.largest_factor
    );
    text += &format!(
        "for one tool length: {}\n",
        cec::for_tool(answer.tool_length_mm)
    );
    if let Some(per_mm) = answer.verification.um_per_mm_of_tool_length {
        text += &format!("  corrections change by {per_mm:.4} µm per mm that the tool is longer\n");
    }
    let mut told: Vec<String> = answer.notes.iter().map(ToString::to_string).collect();
    told.dedup();
    for note in told {
        text += &format!("{note}\n");
    }
    text + &differences(answer.verification)
}

/// What the tables that were read again differ by.
fn differences(verification: &CecProof) -> String {
    let mut text = format!(
        "\nread again, {} random positions\naxis  largest correction   differs by   on the other kind of controller by\n",
        verification.positions
    );
    for AxisDifference { own, other_reading } in &verification.axes {
        text += &format!(
            "{}  {:>16.3} {u:<4} {:>12.4} {u:<4} {other_reading:>12.3} {u}\n",
            own.axis,
            own.largest,
            own.difference,
            u = own.unit
        );
    }
    text
}

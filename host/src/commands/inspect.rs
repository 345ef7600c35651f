//! `trueaxis inspect`

use super::bad_input::BadInput;
use super::{Outcome, files, screen};
use clap::Args;
use serde::Serialize;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use trueaxis::{AuxiliaryKind, Direction, Grid, Interpolation, Largest, Policy, SampleFormat};
use trueaxis_host::compile::{Size, belongs};
use trueaxis_host::policy::Told;
use trueaxis_host::schemes::fik;
use trueaxis_host::validate::Runtime;

/// Show what a compensation consists of
#[derive(Args)]
#[command(after_help = "Example:\n  trueaxis inspect machine.trax --json")]
pub struct Arguments {
    /// The compensation
    #[arg(value_name = "FILE.trax")]
    blob: PathBuf,
    /// Name the errors of each term: the machine and the errors of which --scheme fik made it
    #[arg(long, num_args = 2, value_names = ["MACHINE", "ERRORS"])]
    names: Option<Vec<PathBuf>>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Contents<'a> {
    file: &'a Path,
    machine: &'a str,
    #[serde(flatten)]
    policy: Told,
    #[serde(skip)]
    stored: Policy,
    #[serde(flatten)]
    size: Size,
    axes: Vec<AxisEntry>,
    auxiliaries: Vec<AuxiliaryEntry>,
    bank_list: Vec<BankEntry>,
    term_list: Vec<TermEntry>,
    grid_list: Vec<GridEntry>,
}

#[derive(Serialize)]
struct AxisEntry {
    name: char,
    unit: &'static str,
    /// `None`: turns without end.
    travel: Option<[f32; 2]>,
    /// `None`: positions do not repeat.
    period: Option<f32>,
    value_bound: f32,
    rate_bound: f32,
    ramp_rate: f32,
    hysteresis: f32,
}

#[derive(Serialize)]
struct AuxiliaryEntry {
    name: String,
    kind: &'static str,
    reference: f32,
}

#[derive(Serialize)]
struct BankEntry {
    input: String,
    /// Numbers of the first and of the last table.
    tables: [usize; 2],
    points: u32,
    start: f32,
    step: f32,
    modulo: bool,
    direction: &'static str,
    /// The last point; of cubic tables, where their last interval ends.
    end: f32,
    interpolation: &'static str,
    samples: &'static str,
    /// Largest magnitude of each table.
    largest: Vec<f32>,
}

#[derive(Serialize)]
struct TermEntry {
    output: char,
    weight: f32,
    limits: Option<[f32; 2]>,
    tables: Vec<u8>,
    /// The errors that it is for, if they were asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    errors: Vec<String>,
}

#[derive(Serialize)]
struct GridEntry {
    inputs: Vec<GridInputEntry>,
    outputs: Vec<char>,
    samples: &'static str,
}

#[derive(Serialize)]
struct GridInputEntry {
    input: String,
    points: u32,
    start: f32,
    step: f32,
    modulo: bool,
}

fn format(format: SampleFormat) -> &'static str {
    match format {
        SampleFormat::F32 => "f32",
        SampleFormat::I16 => "i16",
    }
}

fn unit(name: char) -> &'static str {
    if matches!(name, 'A' | 'B' | 'C') {
        "deg"
    } else {
        "mm"
    }
}

/// Name of an input: axes in order, then auxiliaries. Loading has checked that it exists.
fn input(compensation: &Largest<'_>, number: u8) -> String {
    let axes = compensation.axes();
    let number = usize::from(number);
    match axes.get(number) {
        Some(axis) => char::from(axis.name).to_string(),
        None => compensation.auxiliaries()[number - axes.len()]
            .name
            .to_string(),
    }
}

fn contents<'a>(path: &'a Path, runtime: &Runtime<'a>) -> Contents<'a> {
    let compensation = runtime.compensation();
    let letters: Vec<char> = compensation
        .axes()
        .iter()
        .map(|a| char::from(a.name))
        .collect();
    let axes = compensation
        .axes()
        .iter()
        .zip(&letters)
        .map(|(axis, name)| AxisEntry {
            name: *name,
            unit: unit(*name),
            travel: (axis.travel != [-f32::MAX, f32::MAX]).then_some(axis.travel),
            period: (axis.period > 0.0).then_some(axis.period),
            value_bound: axis.value_bound,
            rate_bound: axis.rate_bound,
            ramp_rate: axis.ramp_rate,
            hysteresis: axis.hysteresis,
        });
    let auxiliaries = compensation.auxiliaries().iter().map(|a| AuxiliaryEntry {
        name: a.name.to_string(),
        kind: match a.kind {
            AuxiliaryKind::ToolLength => "tool length",
            AuxiliaryKind::Temperature => "temperature",
        },
        reference: a.reference,
    });
    let mut next = 0;
    let banks = compensation.banks().iter().map(|bank| {
        let first = next;
        next += usize::from(bank.tables);
        BankEntry {
            input: input(compensation, bank.input),
            tables: [first, next - 1],
            points: bank.points,
            start: bank.start,
            step: bank.step,
            modulo: bank.modulo,
            direction: match bank.direction {
                Direction::Both => "both",
                Direction::Positive => "positive",
                Direction::Negative => "negative",
                Direction::Signed => "signed",
            },
            end: match bank.interpolation {
                Interpolation::Linear => end(bank.start, bank.step, bank.points),
                Interpolation::Cubic => bank.end(),
            },
            interpolation: match bank.interpolation {
                Interpolation::Linear => "linear",
                Interpolation::Cubic => "cubic",
            },
            samples: format(bank.format),
            largest: (first..next)
                .filter_map(|table| compensation.peak(table))
                .collect(),
        }
    });
    let terms = compensation.terms().map(|term| TermEntry {
        output: letters[usize::from(term.output)],
        weight: term.weight,
        limits: term.limits,
        tables: term.factors.to_vec(),
        errors: Vec::new(),
    });
    let grid = |grid: &Grid| GridEntry {
        inputs: grid
            .axes
            .iter()
            .map(|axis| GridInputEntry {
                input: input(compensation, axis.input),
                points: axis.points,
                start: axis.start,
                step: axis.step,
                modulo: axis.modulo,
            })
            .collect(),
        outputs: grid
            .outputs
            .iter()
            .map(|o| letters[usize::from(*o)])
            .collect(),
        samples: format(grid.format),
    };
    Contents {
        file: path,
        machine: compensation.machine(),
        policy: compensation.policy().into(),
        stored: compensation.policy(),
        size: Size::of(runtime),
        axes: axes.collect(),
        auxiliaries: auxiliaries.collect(),
        bank_list: banks.collect(),
        term_list: terms.collect(),
        grid_list: compensation.grids().iter().map(grid).collect(),
    }
}

/// The end of an evenly spaced row of points.
fn end(start: f32, step: f32, points: u32) -> f32 {
    start + step * (points - 1) as f32
}

fn listing(contents: &Contents<'_>) -> String {
    let mut text = format!("{}: {}\n", contents.file.display(), contents.machine);
    text += &screen::size(&contents.size);
    text += &screen::policy(contents.stored);
    text += "\naxes\n";
    for a in &contents.axes {
        let travel = match (a.travel, a.period) {
            (_, Some(period)) => format!("endless ({period} {})", a.unit),
            (Some([low, high]), None) => format!("{low} to {high} {}", a.unit),
            (None, None) => "without end".to_owned(),
        };
        let _ = writeln!(
            text,
            "  {}  {travel:<20} correction within {:.5} {u}, {:.3} {u}/s; ramps at {:.3} {u}/s; reverses after {} {u}",
            a.name,
            a.value_bound,
            a.rate_bound,
            a.ramp_rate,
            a.hysteresis,
            u = a.unit
        );
    }
    for a in &contents.auxiliaries {
        let _ = match a.kind {
            "tool length" => writeln!(
                text,
                "  {}: an input (mm), the machine's own tool has {}",
                a.name, a.reference
            ),
            _ => writeln!(text, "  {}: an input (K from {} °C)", a.name, a.reference),
        };
    }
    text += "\nbanks\n";
    for bank in &contents.bank_list {
        let [first, last] = bank.tables;
        let tables = if first == last {
            format!("T{first}")
        } else {
            format!("T{first} to T{last}")
        };
        let wraps = if bank.modulo { ", wraps" } else { "" };
        let direction = match bank.direction {
            "both" => String::new(),
            "signed" => ", times the sign of travel".to_owned(),
            other => format!(", {other} travel only"),
        };
        let samples = match bank.interpolation {
            "cubic" => "coefficients",
            _ => "points",
        };
        let _ = writeln!(
            text,
            "  {tables:<12} of {}: {} {samples} from {} to {}, {}, {}{wraps}{direction}",
            bank.input, bank.points, bank.start, bank.end, bank.interpolation, bank.samples
        );
    }
    text += "\nterms\n";
    let inputs: Vec<&str> = contents
        .bank_list
        .iter()
        .flat_map(|b| std::iter::repeat_n(b.input.as_str(), b.tables[1] + 1 - b.tables[0]))
        .collect();
    let mut before = None;
    for term in &contents.term_list {
        let head = if before == Some(term.output) {
            "    +".to_owned()
        } else {
            format!("d{} =", term.output)
        };
        before = Some(term.output);
        // A weight of 1 goes without saying, unless there is nothing else or it may change.
        let plain = term.weight == 1.0 && term.limits.is_none() && !term.tables.is_empty();
        let weight = (!plain).then(|| term.weight.to_string());
        let tables = term
            .tables
            .iter()
            .map(|table| format!("T{table}({})", inputs[usize::from(*table)]));
        let product: Vec<String> = weight.into_iter().chain(tables).collect();
        let product = product.join(" · ");
        let limits = term.limits.map_or(String::new(), |[low, high]| {
            format!("   adjustable, {low} to {high}")
        });
        let errors = match term.errors.join(", ") {
            none if none.is_empty() => none,
            some => format!("   {some}"),
        };
        let _ = writeln!(text, "  {head:>5} {product}{limits}{errors}");
    }
    if !contents.grid_list.is_empty() {
        text += "\ngrids\n";
    }
    for (number, grid) in contents.grid_list.iter().enumerate() {
        let outputs: Vec<String> = grid.outputs.iter().map(|o| format!("d{o}")).collect();
        let _ = writeln!(
            text,
            "  G{number} to {}, {}",
            outputs.join(", "),
            grid.samples
        );
        for i in &grid.inputs {
            let wraps = if i.modulo { ", wraps" } else { "" };
            let _ = writeln!(
                text,
                "     of {}: {} nodes from {} to {}{wraps}",
                i.input,
                i.points,
                i.start,
                end(i.start, i.step, i.points)
            );
        }
    }
    text
}

/// The errors that each term is for.
fn names(
    path: &Path,
    runtime: &Runtime<'_>,
    machine: &Path,
    errors: &Path,
) -> Result<Vec<Vec<String>>, BadInput> {
    let machine = files::read_machine(machine)?;
    let known = files::read_errors(errors, &machine)?;
    let compensation = runtime.compensation();
    belongs(&machine, &known, runtime).map_err(|e| BadInput::mismatch(&e, path))?;
    let names = fik::names(&machine, &known, compensation)
        .map_err(|error| BadInput::new(error.to_string(), error.remedy()))?;
    names.ok_or_else(|| {
        BadInput::new(
            format!(
                "{} is not what --scheme fik makes of {}",
                path.display(),
                errors.display()
            ),
            "give the errors of which it was compiled; other schemes have no terms of single errors",
        )
    })
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let path = &arguments.blob;
    let blob = files::read_blob(path)?;
    let runtime = Runtime::load(&blob).map_err(|e| BadInput::in_blob(e, path))?;
    let mut contents = contents(path, &runtime);
    if let Some([machine, errors]) = arguments.names.as_deref() {
        let names = names(path, &runtime, machine, errors)?;
        for (term, errors) in contents.term_list.iter_mut().zip(names) {
            term.errors = errors;
        }
    }
    if arguments.json {
        files::print_json(&contents)?;
    } else {
        files::print(&listing(&contents))?;
    }
    Ok(Outcome::Done)
}

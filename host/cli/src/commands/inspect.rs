//! `trueaxis inspect`

use super::bad_input::BadInput;
use super::{Outcome, files, output, screen};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis::Notes;
use trueaxis_model::validate::Runtime;
use trueaxis_tables::compile::belongs;
use trueaxis_tables::contents::{
    AuxiliaryEntry, AxisEntry, BankEntry, Contents, GridEntry, contents, end,
};
use trueaxis_tables::extremes::{Extremes, extremes};
use trueaxis_tables::schemes::fik;

/// Show the parts of a compensation
#[derive(Args)]
#[command(after_help = "Example:\n  trueaxis inspect machine.trax --json")]
pub struct Arguments {
    /// The compensation
    #[arg(value_name = "FILE.trax")]
    blob: PathBuf,
    /// List the errors of each term; takes the machine and the errors from which --scheme fik made it
    #[arg(long, num_args = 2, value_names = ["MACHINE", "ERRORS"])]
    names: Option<Vec<PathBuf>>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// The results as JSON.
#[derive(Serialize)]
struct InspectAnswer<'a> {
    file: &'a Path,
    #[serde(flatten)]
    contents: &'a Contents<'a>,
    /// What any input at all can give, of each axis.
    extremes: &'a [Extremes],
    /// Where and how well the errors are known.
    #[serde(skip_serializing_if = "Option::is_none")]
    notes: Option<Notes>,
}

/// Where and how well the errors behind the corrections are known.
fn known(notes: &Notes, contents: &Contents<'_>) -> String {
    let zone = notes.zone.iter().filter_map(|zone| {
        let axis = contents.axes.get(usize::from(zone.axis))?;
        let [low, high] = zone.range;
        Some(format!("{} {low} to {high} {}", axis.name, axis.unit))
    });
    let zone = zone.collect::<Vec<_>>().join(", ");
    let mut text = String::new();
    if !zone.is_empty() {
        text += &format!("  errors measured in {zone}\n");
    }
    if let Some(um) = notes.misfit_um {
        text += &format!("  misfit of the error model: {um:.1} µm\n");
    }
    if !notes.unseen.is_empty() {
        text += &format!("  not seen: {}\n", notes.unseen.join(", "));
    }
    text
}

fn listing(
    path: &Path,
    contents: &Contents<'_>,
    extremes: &[Extremes],
    notes: Option<&Notes>,
) -> String {
    let mut text = format!("{}: {}\n", path.display(), contents.machine);
    text += &screen::size(&contents.size);
    text += &screen::policy(contents.stored);
    text += &format!("capacities: {}\n", contents.size.capacities());
    text += "\naxes\n";
    text.extend(contents.axes.iter().map(axis));
    text.extend(contents.auxiliaries.iter().map(auxiliary));
    if let Some(notes) = notes {
        text += &format!("\norigin\n{}", known(notes, contents));
    }
    text += "\nat most, for any input\n";
    let axes = contents.axes.iter().zip(extremes);
    text.extend(axes.map(|(axis, of)| largest(axis, of)));
    text += "\nbanks\n";
    text.extend(contents.bank_list.iter().map(bank));
    text += "\nterms\n";
    text += &terms(contents);
    if !contents.grid_list.is_empty() {
        text += "\ngrids\n";
    }
    let grids = contents.grid_list.iter().enumerate();
    text.extend(grids.map(|(number, grid_entry)| grid(number, grid_entry)));
    text
}

fn axis(a: &AxisEntry) -> String {
    let travel = match (a.travel, a.period) {
        (_, Some(period)) => format!("endless ({period} {})", a.unit),
        (Some([low, high]), None) => format!("{low} to {high} {}", a.unit),
        (None, None) => "without end".to_owned(),
    };
    // Otherwise it is made up as slowly as a ramp begins.
    let reversal = match a.reversal_acceleration > 1.001 * a.ramp_rate / trueaxis::RISE {
        true => format!(
            ", made up at {:.3} {u}/s, {:.1} {u}/s²",
            a.reversal_rate,
            a.reversal_acceleration,
            u = a.unit
        ),
        false => String::new(),
    };
    format!(
        "  {}  {travel:<20} correction within {:.5} {u}, {:.3} {u}/s; ramps at {:.3} {u}/s; reverses after {} {u}{reversal}\n",
        a.name,
        a.value_bound,
        a.rate_bound,
        a.ramp_rate,
        a.reversal_threshold,
        u = a.unit
    )
}

/// An input other than an axis.
fn auxiliary(a: &AuxiliaryEntry) -> String {
    let (name, reference) = (&a.name, a.reference);
    if a.kind == "tool length" {
        return format!("  {name}: an input (mm), the machine's own tool has {reference}\n");
    }
    let lag = a.lag_s.map_or(String::new(), |lag| {
        format!(", follows with a lag of {lag:.0} s")
    });
    let followed = a.sensor.map_or(String::new(), |sensor| {
        let [low, high] = sensor.celsius;
        format!(
            ", followed at {} K/s within {low} to {high} °C",
            sensor.kelvin_per_s
        )
    });
    format!("  {name}: an input (K from {reference} °C){followed}{lag}\n")
}

/// What any input at all can give of an axis.
fn largest(axis: &AxisEntry, of: &Extremes) -> String {
    let slopes = of.steepest.iter();
    let slopes = slopes.map(|s| format!("{} {:.3e}", s.input, s.per_unit));
    let slopes = match slopes.collect::<Vec<_>>().join(", ") {
        none if none.is_empty() => none,
        some => format!("; per unit of {some}"),
    };
    format!(
        "  d{}  {:.5} {}{slopes}\n",
        axis.name, of.largest, axis.unit
    )
}

fn bank(bank: &BankEntry) -> String {
    let [first, last] = bank.tables;
    let tables = match first == last {
        true => format!("T{first}"),
        false => format!("T{first} to T{last}"),
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
    format!(
        "  {tables:<12} of {}: {} {samples} from {} to {}, {}, {}{wraps}{direction}\n",
        bank.input, bank.points, bank.start, bank.end, bank.interpolation, bank.samples
    )
}

/// The correction of each axis as a sum.
fn terms(contents: &Contents<'_>) -> String {
    let inputs = contents.inputs();
    let mut before = None;
    let mut text = String::new();
    for term in &contents.term_list {
        let head = match before == Some(term.output) {
            true => "    +".to_owned(),
            false => format!("d{} =", term.output),
        };
        before = Some(term.output);
        let product = term.product(&inputs);
        let limits = term.limits.map_or(String::new(), |[low, high]| {
            format!("   adjustable, {low} to {high}")
        });
        let errors = match term.errors.join(", ") {
            none if none.is_empty() => none,
            some => format!("   {some}"),
        };
        text += &format!("  {head:>5} {product}{limits}{errors}\n");
    }
    text
}

fn grid(number: usize, grid: &GridEntry) -> String {
    let outputs: Vec<String> = grid.outputs.iter().map(|o| format!("d{o}")).collect();
    let mut text = format!("  G{number} to {}, {}\n", outputs.join(", "), grid.samples);
    for i in &grid.inputs {
        let wraps = if i.modulo { ", wraps" } else { "" };
        text += &format!(
            "     of {}: {} nodes from {} to {}{wraps}\n",
            i.input,
            i.points,
            i.start,
            end(i.start, i.step, i.points)
        );
    }
    text
}

/// The errors that each term corrects.
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
            "pass the errors it was compiled from; other schemes have no terms for single errors",
        )
    })
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let path = &arguments.blob;
    let blob = files::read_blob(path)?;
    let runtime = Runtime::load(&blob).map_err(|e| BadInput::in_blob(e, path))?;
    let mut contents = contents(&runtime);
    let extremes = extremes(runtime.compensation());
    let notes = Notes::of(&blob);
    if let Some([machine, errors]) = arguments.names.as_deref() {
        let names = names(path, &runtime, machine, errors)?;
        for (term, errors) in contents.term_list.iter_mut().zip(names) {
            term.errors = errors;
        }
    }
    let answer = InspectAnswer {
        file: path,
        contents: &contents,
        extremes: &extremes,
        notes,
    };
    output::print_answer(arguments.json, &answer, || {
        listing(path, &contents, &extremes, answer.notes.as_ref())
    })?;
    Ok(Outcome::Done)
}

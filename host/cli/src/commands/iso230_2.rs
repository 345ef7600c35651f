//! `trueaxis iso230-2`

use super::Outcome;
use super::bad_input::BadInput;
use super::files;
use super::measured::{MeasuredFiles, positioning};
use clap::Args;
use trueaxis_measure::direct::iso230_2::{Analysis, AxisRecord, analysis, shown};
use trueaxis_measure::direct::{AxisRuns, misread};
use trueaxis_model::machine::Machine;

/// Evaluate runs of an axis to ISO 230-2: A, B, E, M, R
///
/// Deviations are those of the tool relative to the workpiece in the direction of a positive command, whatever the
/// instrument counts as positive. With -o, also writes error motions: a table for each direction of travel, or with
/// --one-number their mean and half of the mean reversal value; the files must then say where the other axes stood (at).
/// The standard asks for five runs in each direction. This is `trueaxis measured` for one kind of file.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis iso230-2 machine.toml x.csv y.csv -o errors.toml\n\n\
The file, with as many runs as there are:\n  # axis = \"X\"\n  # reads = \"tool +X\"\n  # unit = \"um\"\n  \
# at = { Y = 150.0, Z = -40.0 }\n  target,+1,-1,+2,-2\n  0,0.1,-1.2,0.0,-1.3\n  100,2.2,1.0,2.1,1.1"
)]
pub struct Arguments {
    #[command(flatten)]
    files: MeasuredFiles,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let (machine, measurements) = arguments.files.read(true)?;
    let evaluated: Vec<(String, AxisRuns, Analysis)> = positioning(&measurements)?
        .into_iter()
        .map(|(name, line)| (name.to_owned(), line.clone(), analysis(line)))
        .collect();
    let imported = match &arguments.files.output {
        Some(_) => arguments.files.import(machine, measurements)?.machine,
        None => {
            for (file, (name, line, _)) in evaluated.iter().enumerate() {
                if let Some(doubt) = misread(&machine, file, line) {
                    eprintln!("warning: {name}: {doubt}\n  {}", doubt.remedy());
                }
            }
            machine
        }
    };
    if arguments.json {
        let all: Vec<AxisRecord> = (evaluated.iter())
            .map(|(name, line, analysis)| AxisRecord::of(&imported, name, line, analysis))
            .collect();
        files::print_json(&all)?;
    } else {
        let screens = evaluated
            .iter()
            .map(|(name, line, found)| screen(&imported, name, line, found));
        files::print(&screens.collect::<Vec<_>>().join("\n"))?;
    }
    Ok(Outcome::Done)
}

/// A number with two decimals, or a dash.
fn number(value: Option<f64>, factor: f64) -> String {
    // Avoids "-0.00".
    value.map_or_else(
        || "–".to_owned(),
        |v| format!("{:.2}", (v * factor * 100.0).round() / 100.0 + 0.0),
    )
}

/// The text output.
fn screen(machine: &Machine, name: &str, line: &AxisRuns, found: &Analysis) -> String {
    let axis = &machine.axes[line.setup.moved];
    let (factor, unit) = shown(line);
    let mut text = format!(
        "{name}: {}, {} targets, {} runs ↑, {} ↓ ({unit})\n\n",
        axis.letter,
        line.targets.len(),
        found.runs[0],
        found.runs[1]
    );
    text += &targets(axis.unit(), found, factor);
    if let Some(reason) = found.not_to_the_standard() {
        text += &format!("\nnot to ISO 230-2: {reason}\n");
    }
    text + &results(found, factor)
}

/// A line for each target.
fn targets(unit: &str, found: &Analysis, factor: f64) -> String {
    let mut text = format!(
        "{:>12}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}\n",
        format!("target ({unit})"),
        "x̄↑",
        "x̄↓",
        "s↑",
        "s↓",
        "B",
        "R"
    );
    let show = |value| number(value, factor);
    for t in &found.targets {
        text += &format!(
            "{:>12} {:>7} {:>7} {:>8} {:>8} {:>8} {:>8}\n",
            t.target,
            show(t.mean[0]),
            show(t.mean[1]),
            show(t.spread[0]),
            show(t.spread[1]),
            show(t.reversal),
            show(t.both)
        );
    }
    text
}

/// The values for the whole axis.
fn results(found: &Analysis, factor: f64) -> String {
    let none = [None; 2];
    let rows = [
        ("accuracy A", found.accuracy, found.accuracy_both),
        (
            "systematic deviation E",
            found.systematic,
            found.systematic_both,
        ),
        (
            "repeatability R",
            found.repeatability,
            found.repeatability_both,
        ),
        ("range of mean deviations M", none, found.mean_range),
        ("reversal value B", none, found.reversal),
        ("mean reversal value", none, found.mean_reversal),
    ];
    let mut text = "\n                                        ↑        ↓     both\n".to_owned();
    for (what, one, both) in rows {
        let [up, down, both] = [one[0], one[1], both].map(|value| number(value, factor));
        text += &format!("{what:<32} {up:>8} {down:>8} {both:>8}\n");
    }
    text
}

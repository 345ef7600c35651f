//! `trueaxis iso230-2`

use super::Outcome;
use super::bad_input::BadInput;
use super::measured::{MeasuredFiles, positioning};
use super::output;
use clap::Args;
use trueaxis_direct::iso230_2::{Analysis, AxisRecord};
use trueaxis_direct::of_readings;
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
    let lines = positioning(&measurements)?;
    match &arguments.files.output {
        Some(_) => drop(arguments.files.import(&machine, &measurements)?),
        None => {
            for (file, (name, line)) in lines.iter().enumerate() {
                for doubt in of_readings(&machine, file, line) {
                    eprintln!("warning: {name}: {doubt}\n  {}", doubt.remedy);
                }
            }
        }
    }
    let records: Vec<AxisRecord> = (lines.iter())
        .map(|(name, line)| AxisRecord::of(&machine, name, line))
        .collect();
    output::print_answer(arguments.json, &records, || {
        let screens: Vec<String> = records.iter().map(|one| screen(&machine, one)).collect();
        screens.join("\n")
    })?;
    Ok(Outcome::Done)
}

/// A number with two decimals, or a dash.
fn number(value: Option<f64>) -> String {
    // Avoids "-0.00".
    value.map_or_else(
        || "–".to_owned(),
        |v| format!("{:.2}", (v * 100.0).round() / 100.0 + 0.0),
    )
}

/// The text output.
fn screen(machine: &Machine, record: &AxisRecord) -> String {
    let found = &record.found;
    let [up, down] = found.runs;
    let axis = machine.index(record.axis).map(|i| &machine.axes[i]);
    let mut text = format!(
        "{}: {}, {} targets, {up} runs ↑, {down} ↓ ({})\n\n",
        record.file,
        record.axis,
        found.targets.len(),
        record.unit
    );
    text += &targets(axis.map_or("", |axis| axis.unit()), found);
    if let Some(reason) = &found.not_to_the_standard {
        text += &format!("\nnot to ISO 230-2: {reason}\n");
    }
    text + &results(found)
}

/// A line for each target.
fn targets(unit: &str, found: &Analysis) -> String {
    let [target, heads @ ..] = ["target", "x̄↑", "x̄↓", "s↑", "s↓", "B", "R"];
    let mut text = format!("{:>12}", format!("{target} ({unit})"));
    text.extend(heads.map(|head| format!("{head:>9}")));
    text.push('\n');
    for t in &found.targets {
        let [up, down] = t.mean.map(number);
        text += &format!("{:>12} {up:>7} {down:>7}", t.target);
        let rest = [t.spread[0], t.spread[1], t.reversal, t.repeatability[2]];
        text.extend(rest.map(|value| format!(" {:>8}", number(value))));
        text.push('\n');
    }
    text
}

/// The values for the whole axis.
fn results(found: &Analysis) -> String {
    let both = |value| [None, None, value];
    let rows = [
        ("accuracy A", found.accuracy),
        ("systematic deviation E", found.systematic_deviation),
        ("repeatability R", found.repeatability),
        (
            "range of mean deviations M",
            both(found.range_of_mean_deviations),
        ),
        ("reversal value B", both(found.reversal)),
        ("mean reversal value", both(found.mean_reversal)),
    ];
    let mut text = "\n                                        ↑        ↓     both\n".to_owned();
    for (what, values) in rows {
        let [up, down, both] = values.map(number);
        text += &format!("{what:<32} {up:>8} {down:>8} {both:>8}\n");
    }
    text
}

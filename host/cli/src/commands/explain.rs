//! `trueaxis explain`

use super::Outcome;
use super::bad_input::BadInput;
use super::files::MachineFiles;
use super::output;
use clap::Args;
use serde::Serialize;
use trueaxis_model::errors::Parameter;
use trueaxis_model::explain::{
    BenchInstrument, BenchState, EntryKind, Explained, InstrumentReading, MinimalParameters, Sense,
    explain,
};
use trueaxis_model::machine::Machine;

/// Explain each error parameter by the reading of an instrument on this machine
///
/// Prints one sentence and one figure for each parameter, table and thermal change. They are computed with the exact
/// model of the uncompensated machine on which only this error exists. Compare the sign with that of your
/// measurement: a reading is positive if the tool goes too far, relative to the workpiece, in the direction of a
/// positive command. If a parameter changes nothing on an aligned part, the sentence says so and names the parameter
/// that you may have meant. The last line counts the independent constants of the machine.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis explain examples/mill-21/machine.toml errors.toml\n\n\
With --json, each entry has the reading (µm or µrad; on a square µm per 100 mm), the instrument, and the\n\
positions from which and to which it is read. To see where the tool has gone there, run `trueaxis pose` with\n\
an error file that contains nothing else."
)]
pub struct Arguments {
    #[command(flatten)]
    files: MachineFiles,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct ExplainAnswer<'a> {
    machine: &'a str,
    axes: Vec<char>,
    explained: Vec<ExplainedEntry>,
    /// N = 4R + 2P + 6, and the location errors among them.
    independent_constants: usize,
    location_errors: usize,
}

/// One parameter, table or thermal change.
#[derive(Serialize)]
struct ExplainedEntry {
    parameter: String,
    /// `parameter`, `table`, `table_reversal` or `per_kelvin`.
    kind: &'static str,
    value: Option<f64>,
    sentence: String,
    changes_nothing: bool,
    /// Parameters that may have been meant instead.
    meant: Vec<String>,
    shown: Option<InstrumentShown>,
}

/// The instrument that shows it.
#[derive(Serialize)]
struct InstrumentShown {
    instrument: &'static str,
    /// The axis that moves.
    moved: Option<char>,
    /// The direction of the reading: `X`; for an angle `X to Y`, or the letter of a rotary axis.
    reads_in: String,
    reading: f64,
    /// `µm`, `µm per 100 mm` or `µrad`.
    unit: &'static str,
    /// Positions (mm, deg) where the instrument is set to zero and where it is read.
    from: Vec<f64>,
    to: Vec<f64>,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let (machine, errors) = arguments.files.read()?;
    let explained = explain(&machine, &errors);
    let minimal = MinimalParameters::of(&machine);
    if arguments.json {
        output::print_json(&ExplainAnswer {
            machine: &machine.name,
            axes: machine.axes.iter().map(|a| a.letter.char()).collect(),
            explained: explained
                .iter()
                .map(|e| ExplainedEntry::new(&machine, e))
                .collect(),
            independent_constants: minimal.all(),
            location_errors: minimal.locations(),
        })?;
        return Ok(Outcome::Done);
    }
    let lines: String = explained.iter().map(|e| e.sentence() + "\n").collect();
    output::print(&format!("{lines}{minimal}\n"))?;
    Ok(Outcome::Done)
}

impl ExplainedEntry {
    fn new(machine: &Machine, explained: &Explained<'_>) -> Self {
        let alone = &explained.alone;
        let (kind, value) = match &alone.said {
            EntryKind::Parameter(value) => ("parameter", Some(*value)),
            EntryKind::Table => ("table", None),
            EntryKind::TableReversal => ("table_reversal", None),
            EntryKind::PerKelvin { per_kelvin, .. } => ("per_kelvin", Some(*per_kelvin)),
        };
        let name = alone.parameter.to_string();
        let whole = matches!(alone.said, EntryKind::Table | EntryKind::TableReversal);
        let meant = explained
            .meant
            .iter()
            .flat_map(|(_, parameters)| parameters);
        Self {
            parameter: if whole { name[..3].to_owned() } else { name },
            kind,
            value,
            sentence: explained.sentence(),
            changes_nothing: explained.reading.is_none(),
            meant: meant.map(Parameter::to_string).collect(),
            shown: explained
                .reading
                .map(|reading| InstrumentShown::new(machine, &reading)),
        }
    }
}

impl InstrumentShown {
    fn new(machine: &Machine, reading: &InstrumentReading) -> Self {
        let letter = |axis: usize| machine.axes[axis].letter.char();
        let position =
            |state: &BenchState| machine.to_command(&state.q)[..machine.axes.len()].to_vec();
        let (reads_in, factor, unit) = match (reading.sense, reading.instrument) {
            (Sense::In(axis), BenchInstrument::Square) => {
                (letter(axis).to_string(), 1e3, "µm per 100 mm")
            }
            (Sense::In(axis), _) => (letter(axis).to_string(), 1e3, "µm"),
            (Sense::From(a, b), _) => (format!("{} to {}", letter(a), letter(b)), 1e6, "µrad"),
            (Sense::About(axis), _) => (letter(axis).to_string(), 1e6, "µrad"),
        };
        Self {
            instrument: name_of(&reading.instrument),
            moved: reading.moved.map(letter),
            reads_in,
            reading: reading.value * factor,
            unit,
            from: position(&reading.from),
            to: position(&reading.to),
        }
    }
}

fn name_of(instrument: &BenchInstrument) -> &'static str {
    match instrument {
        BenchInstrument::Laser => "laser",
        BenchInstrument::Straightedge { .. } => "straightedge",
        BenchInstrument::Square => "square",
        BenchInstrument::Angle => "angle",
        BenchInstrument::Calibrator => "calibrator",
        BenchInstrument::Ball { .. } => "ball",
        BenchInstrument::Tram => "tram",
        BenchInstrument::Probe => "probe",
    }
}

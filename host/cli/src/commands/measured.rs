//! `trueaxis measured`

use super::Outcome;
use super::bad_input::BadInput;
use super::files::{self, Text};
use super::output;
use super::quantity::count;
use clap::Args;
use std::path::{Path, PathBuf};
use trueaxis_direct::formats::runs;
use trueaxis_direct::{
    AxisRuns, DirectRecord, DirectResult, MeasuredRuns, Measurement, SolveOptions, error_file,
    solve, warnings,
};
use trueaxis_identify::formats::kind::{FileKind, kind};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_model::numbers::extremes;

/// Turn readings of lasers, straightedges, levels and squares into error parameters
///
/// Takes runs of lasers, straightedges, levels, calibrators and squares, and gives error motions and squareness.
/// Each file says which axis moved, where the others stood, and what the instrument counts as positive; the sign in
/// the error file follows from the machine. Abbe offsets of angular motions to the measured line are corrected where
/// these motions are measured or known. The error file can be passed to `trueaxis compile` as it is.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis measured machine.toml x.csv x-pitch.csv xy-square.csv -o errors.toml\n\n\
A file begins with how it was measured; then come a line for each target and a column for each run, with its\n\
direction of travel. Units: um mm, urad arcsec mrad rad.\n  \
# axis = \"X\"\n  # reads = \"tool +X\"\n  # unit = \"um\"\n  # at = { Y = 150.0, Z = -40.0 }\n  \
target,+1,-1,+2,-2\n  0,0.1,-1.2,0.0,-1.3\n  100,2.2,1.0,2.1,1.1\n\n\
\"tool +X\": the reading grows where the tool is farther in the direction of a positive command of X, seen from\n\
the workpiece. Other readings: \"workpiece +X\", \"tool +Y to +Z\" (an angle), \"tool +C\" (a rotary calibrator).\n\
For a square: # reads_along = { X = \"tool +Y\", Y = \"tool +X\" }, and line,target,+1,-1 …"
)]
pub struct Arguments {
    #[command(flatten)]
    pub files: MeasuredFiles,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Input files and output.
#[derive(Args)]
pub struct MeasuredFiles {
    /// Machine description (machine.toml)
    pub machine: PathBuf,
    /// Files with readings (CSV)
    #[arg(value_name = "RUNS.csv", required = true)]
    pub runs: Vec<PathBuf>,
    /// Where to write the error motions and locations (errors.toml)
    #[arg(short, long, value_name = "ERRORS.toml")]
    pub output: Option<PathBuf>,
    /// An existing error file; everything that was not measured is kept
    #[arg(long, value_name = "OLD.toml")]
    pub update: Option<PathBuf>,
    /// Describe backlash of an axis by one number, half of the mean reversal value, not by a table for each
    /// direction
    #[arg(long)]
    pub one_number: bool,
}

impl MeasuredFiles {
    /// Reads all files. They need not say where other axes stood if nothing is written (`is_evaluated`).
    pub fn read(&self, is_evaluated: bool) -> Result<(Machine, Vec<Measurement>), BadInput> {
        let others = [Some(&self.machine), self.update.as_ref()];
        let inputs = others.into_iter().flatten().chain(&self.runs);
        let inputs: Vec<&Path> = inputs.map(PathBuf::as_path).collect();
        if let Some(output) = &self.output {
            output::prepare(output, &inputs)?;
        }
        let machine = files::read_machine(&self.machine)?;
        let mut measurements = Vec::new();
        for path in &self.runs {
            let text = Text::read(path)?;
            if kind(&text.text) == Ok(FileKind::Ballbar) {
                return Err(BadInput::new(
                    format!("{}: a ball-bar shows no single error motion", text.name),
                    "give it to `trueaxis identify`, together with these runs: trueaxis identify machine.toml x.csv circle.csv -o errors.toml",
                ));
            }
            let read = match is_evaluated && self.output.is_none() {
                true => runs::read_anywhere,
                false => runs::read,
            };
            let measured = read(&text.text, &machine).map_err(|e| text.bad(e))?;
            let name = text.name;
            measurements.push(Measurement { name, measured });
        }
        Ok((machine, measurements))
    }

    /// Computes the errors and writes them.
    pub fn import(
        &self,
        machine: &Machine,
        measurements: &[Measurement],
    ) -> Result<DirectResult, BadInput> {
        let known = match &self.update {
            Some(path) => {
                let errors = files::read_known_errors(path, machine)?;
                if errors.correlated.is_some() {
                    eprintln!(
                        "warning: {}: correlations are not kept: its parameters count as uncorrelated\n  give the runs to `trueaxis identify`, together with what was identified before",
                        path.display()
                    );
                }
                files::to_update(errors, path, "import")?
            }
            None => ErrorModel::perfect(machine),
        };
        let options = SolveOptions {
            one_number: self.one_number,
        };
        let found = solve(machine, measurements, &known, options).map_err(|error| {
            let files: Vec<&str> = (error.files.iter())
                .map(|k| measurements[*k].name.as_str())
                .collect();
            let place = if files.is_empty() { "" } else { ": " };
            BadInput::new(format!("{}{place}{error}", files.join(", ")), error.remedy)
        })?;
        for (said, doubt) in warnings(&found, measurements).iter().zip(&found.doubts) {
            eprintln!("warning: {said}\n  {}", doubt.remedy);
        }
        if let Some(output) = &self.output {
            let text = error_file(machine, measurements, &found);
            // The result is an error file; anything it would reject is reported before writing.
            ErrorModel::from_toml(&text, machine).map_err(|error| {
                BadInput::new(
                    format!("no error file can be written: {}", error.message),
                    error.remedy,
                )
            })?;
            output::write(output, text.as_bytes())?;
        }
        Ok(found)
    }
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let (machine, measurements) = arguments.files.read(false)?;
    let found = arguments.files.import(&machine, &measurements)?;
    let record = DirectRecord::of(&machine, &measurements, &found);
    output::print_answer(arguments.json, &record, || {
        screen(&machine, &measurements, &found)
    })?;
    Ok(Outcome::Done)
}

/// The text output.
fn screen(machine: &Machine, measurements: &[Measurement], found: &DirectResult) -> String {
    let mut text = format!(
        "{}: {} and {} from {}\n",
        machine.name,
        count(found.motions.len(), "error motion"),
        count(found.locations.len(), "squareness").replace("squarenesss", "squarenesses"),
        count(measurements.len(), "file")
    );
    if !found.motions.is_empty() {
        text += "\n";
    }
    motions(&mut text, machine, measurements, found);
    if !found.locations.is_empty() {
        text += "\n          value   uncertainty\n";
    }
    for location in &found.locations {
        let show = |v: f64| format!("{:.2}", v * 1e6);
        text += &format!(
            "  {:<4} {:>8} {:>13} µrad  {}\n",
            location.parameter.to_string(),
            show(location.value),
            location.uncertainty.map_or_else(|| "–".to_owned(), show),
            measurements[location.from].name
        );
    }
    if !found.slopes.is_empty() {
        text += "\nslope of the straightedge, which was removed\n";
    }
    for (file, slope) in &found.slopes {
        let name = &measurements[*file].name;
        text += &format!("  {:.2} µrad in {name}\n", slope * 1e6);
    }
    text + SIGNS
}

/// What nothing but the machine can show.
const SIGNS: &str = "\nsigns are as stated: where a reading grows, the tool goes too far along `reads`, seen from the workpiece; if it is the other way, corrections double the error\n";

/// The error motions as a list.
pub fn motions(
    text: &mut String,
    machine: &Machine,
    measurements: &[Measurement],
    found: &DirectResult,
) {
    if !found.motions.is_empty() {
        *text += "           from       to   reversal   uncertainty\n";
    }
    for motion in &found.motions {
        let (factor, unit) = motion.shown();
        let [low, high] = extremes(motion.all_values().copied());
        let show = |v: Option<f64>| {
            v.map_or_else(|| "–".to_owned(), |v| format!("{:.2}", v * factor + 0.0))
        };
        *text += &format!(
            "  {:<4} {:>8.2} {:>8.2} {:>10} {:>13} {unit:<5} {}\n",
            motion.name(machine),
            low * factor,
            high * factor,
            show(motion.backlash().map(|b| 2.0 * b)),
            show(motion.uncertainty),
            measurements[motion.from].name
        );
    }
}

/// The positioning runs of the axis itself, with their files.
pub fn positioning(measurements: &[Measurement]) -> Result<Vec<(&str, &AxisRuns)>, BadInput> {
    let each = measurements.iter().map(|m| match &m.measured {
        MeasuredRuns::Line(line) if line.setup.is_positioning() => Ok((m.name.as_str(), line)),
        _ => Err(BadInput::new(
            format!(
                "{}: this is not the position of the axis that moves",
                m.name
            ),
            "ISO 230-2 is about positions; give the file to `trueaxis measured`",
        )),
    });
    each.collect()
}

//! `trueaxis simulate laser` and `simulate square`

use super::super::Outcome;
use super::super::bad_input::BadInput;
use super::super::files::MachineFiles;
use super::super::number::finite;
use super::super::output;
use super::super::position_argument;
use super::disturbed::Disturbed;
use clap::Args;
use std::path::{Path, PathBuf};
use trueaxis_direct::MeasuredRuns;
use trueaxis_direct::formats::runs;
use trueaxis_direct::simulate::runs as simulated;
use trueaxis_model::explain::Bench;
use trueaxis_model::machine::Machine;

/// Simulate runs of a laser, straightedge, level or calibrator along an axis
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis simulate laser machine.toml errors.toml --axis X --reads \"tool +X\" --at Y=150,Z=-40 --noise 0.2 -o x.csv\n\n\
--reads says what is read: along X with \"tool +X\" the position, with \"tool +Y\" the straightness, with\n\
\"tool +Y to +Z\" the angle. The file can be given to `trueaxis measured` and `trueaxis iso230-2`."
)]
pub struct Laser {
    #[command(flatten)]
    files: MachineFiles,
    /// The axis that moves
    #[arg(long)]
    axis: char,
    /// What the instrument reads [default: the position of the axis]
    #[arg(long, value_name = "tool +X")]
    reads: Option<String>,
    /// First target [default: the lower end of the travel]
    #[arg(long, value_name = "mm|deg", allow_hyphen_values = true, value_parser = finite)]
    from: Option<f64>,
    /// Last target [default: the upper end of the travel]
    #[arg(long, value_name = "mm|deg", allow_hyphen_values = true, value_parser = finite)]
    to: Option<f64>,
    /// Keep the slope of a straightness run: the straightedge is aligned with the workpiece frame, not at both ends
    #[arg(long)]
    keep_slope: bool,
    #[command(flatten)]
    how: How,
}

/// Simulate runs of two axes along the lines of a square
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis simulate square machine.toml errors.toml --lines X,Y --at X=100,Y=100,Z=-40 -o xy.csv\n\n\
The square is aligned with its first line at both ends."
)]
pub struct SimulatedSquare {
    #[command(flatten)]
    files: MachineFiles,
    /// The two axes
    #[arg(long, value_name = "X,Y", value_delimiter = ',', num_args = 1..=2)]
    lines: Vec<char>,
    /// Deviation of the angle of the square from 90°, positive if it is larger
    #[arg(
        long,
        value_name = "µrad",
        default_value_t = 0.0,
        allow_hyphen_values = true,
        value_parser = finite
    )]
    square_urad: f64,
    #[command(flatten)]
    how: How,
}

/// Options of both commands.
#[derive(Args)]
struct How {
    /// Positions of the other axes [default: zero, or as near to it as they can reach]
    #[arg(long, value_name = "Y=150,Z=-40", allow_hyphen_values = true)]
    at: Option<String>,
    /// Offset from the tool tip to the measured point
    #[arg(
        long,
        value_name = "mm,mm,mm",
        value_delimiter = ',',
        allow_hyphen_values = true,
        value_parser = finite
    )]
    offset: Vec<f64>,
    /// Number of targets
    #[arg(long, default_value_t = 11, value_parser = clap::value_parser!(u32).range(2..=10_000))]
    targets: u32,
    /// Number of runs in each direction
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=400))]
    runs: u32,
    #[command(flatten)]
    disturbed: Disturbed,
    /// Where to write the readings (CSV; default: standard output)
    #[arg(short, long, value_name = "OUT.csv")]
    output: Option<PathBuf>,
}

impl Laser {
    pub fn run(&self) -> Result<Outcome, BadInput> {
        self.how.prepare(&self.files)?;
        let (machine, errors) = self.files.read()?;
        let bench = Bench::new(&machine, &errors, Default::default());
        let Some(index) = machine.index(self.axis) else {
            return Err(no_axis(&machine, "--axis", &self.axis.to_string()));
        };
        let own = format!("tool +{}", self.axis);
        let reads = self.reads.as_ref().unwrap_or(&own);
        let (sense, _) = runs::sense(reads, &machine).map_err(|message| {
            BadInput::new(
                format!("--reads: {message}"),
                "write tool +X, tool +C or tool +Y to +Z",
            )
        })?;
        let unit = match sense {
            trueaxis_model::explain::Sense::In(_) => "um",
            _ => "urad",
        };
        let mut text = format!(
            "# axis = \"{}\"\n# reads = \"{}\"\n# unit = \"{unit}\"\n",
            self.axis,
            reads.escape_default()
        );
        text += &self.how.at(&bench, Some(self.axis))?;
        if self.keep_slope {
            text += "# slope = \"keep\"\n";
        }
        text += &format!("target,{}\n", self.how.header());
        let travel = machine.axes[index].travel;
        let [from, to] = [self.from.unwrap_or(travel[0]), self.to.unwrap_or(travel[1])];
        self.how.rows(&mut text, "", [from, to]);
        self.how.write(&bench, &text)
    }
}

impl SimulatedSquare {
    pub fn run(&self) -> Result<Outcome, BadInput> {
        self.how.prepare(&self.files)?;
        let (machine, errors) = self.files.read()?;
        let bench = Bench::new(&machine, &errors, Default::default());
        let [a, b] = self.lines[..] else {
            return Err(BadInput::new("--lines takes two axes", "write --lines X,Y"));
        };
        let mut text = format!(
            "# reads_along = {{ {a} = \"tool +{b}\", {b} = \"tool +{a}\" }}\n# unit = \"um\"\n# square_urad = {:?}\n",
            self.square_urad
        );
        text += &self.how.at(&bench, None)?;
        text += &format!("line,target,{}\n", self.how.header());
        for letter in [a, b] {
            let Some(index) = machine.index(letter) else {
                return Err(no_axis(&machine, "--lines", &letter.to_string()));
            };
            let travel = machine.axes[index].travel;
            self.how.rows(&mut text, &format!("{letter},"), travel);
        }
        self.how.write(&bench, &text)
    }
}

impl How {
    fn prepare(&self, files: &MachineFiles) -> Result<(), BadInput> {
        let inputs: [&Path; 2] = [&files.machine, &files.errors];
        match &self.output {
            Some(output) => output::prepare(output, &inputs),
            None => Ok(()),
        }
    }

    /// Heading lines with the positions of the axes.
    fn at(&self, bench: &Bench<'_>, without: Option<char>) -> Result<String, BadInput> {
        let position = position(bench, self.at.as_deref())?;
        let axes = bench.machine.axes.iter().zip(position);
        let others = axes.filter(|(axis, _)| Some(axis.letter.char()) != without);
        let others = others.map(|(axis, at)| format!("{} = {at:?}", axis.letter));
        let others: Vec<String> = others.collect();
        let mut text = format!("# at = {{ {} }}\n", others.join(", "));
        match self.offset[..] {
            [] => {}
            [x, y, z] => {
                text += &format!("# offset_mm = [{x:?}, {y:?}, {z:?}]\n");
            }
            _ => {
                return Err(BadInput::new(
                    "--offset takes three numbers",
                    "write --offset 0,0,-20 in mm",
                ));
            }
        }
        Ok(text)
    }

    fn header(&self) -> String {
        let runs = (1..=self.runs).flat_map(|run| [format!("+{run}"), format!("-{run}")]);
        runs.collect::<Vec<_>>().join(",")
    }

    fn rows(&self, text: &mut String, first: &str, [from, to]: [f64; 2]) {
        let last = f64::from(self.targets - 1);
        for k in 0..self.targets {
            let target = from + (to - from) * f64::from(k) / last;
            let target = (target * 1e6).round() / 1e6 + 0.0;
            *text += &format!("{first}{target}{}\n", ",0".repeat(2 * self.runs as usize));
        }
    }

    /// Parses the plan, whose errors are reported, and simulates it.
    fn write(&self, bench: &Bench<'_>, plan: &str) -> Result<Outcome, BadInput> {
        let machine: &Machine = bench.machine;
        let plan = runs::read(plan, machine).map_err(|e| BadInput::new(e.message, e.remedy))?;
        let is_angular = match &plan {
            MeasuredRuns::Line(line) => line.setup.is_angular(),
            MeasuredRuns::Square(_) => false,
        };
        let unit = if is_angular { 1e-6 } else { 1e-3 };
        let disturbed = self.disturbed.of_readings(unit);
        let measured = match &plan {
            MeasuredRuns::Line(line) => {
                simulated::line(bench, line, &disturbed).map(MeasuredRuns::Line)
            }
            MeasuredRuns::Square(square) => {
                simulated::square(bench, square, &disturbed).map(MeasuredRuns::Square)
            }
        };
        let measured = measured.ok_or_else(|| {
            BadInput::new(
                "the linear axes cannot follow a ball",
                "read an angle, or give a machine with three linear axes",
            )
        })?;
        output(self.output.as_deref(), &runs::write(&measured, machine))
    }
}

fn no_axis(machine: &Machine, option: &str, name: &str) -> BadInput {
    let letters: Vec<String> = machine.axes.iter().map(|a| a.letter.to_string()).collect();
    BadInput::new(
        format!("{option}: the machine has no axis `{name}`"),
        format!("{} has the axes {}", machine.name, letters.join(" ")),
    )
}

/// Writes a file and prints its name, or prints the text.
pub fn output(path: Option<&Path>, csv: &str) -> Result<Outcome, BadInput> {
    let rows = csv.lines().filter(|line| !line.starts_with('#')).count() - 1;
    output::write_or_print(path, csv, &format!("{rows} rows"))?;
    Ok(Outcome::Done)
}

/// Positions (mm, deg) of all axes from `Y=150,Z=-40`; the others are at home.
pub fn position(bench: &Bench<'_>, text: Option<&str>) -> Result<Vec<f64>, BadInput> {
    let home = bench.machine.to_command(&bench.home());
    match text {
        None => Ok(home[..bench.machine.axes.len()].to_vec()),
        Some(text) => position_argument::position_or("--at", text, bench.machine, &home),
    }
}

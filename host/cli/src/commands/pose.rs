//! `trueaxis pose`

use super::Outcome;
use super::bad_input::BadInput;
use super::eval::EvalAlong;
use super::files;
use super::output;
use super::position_argument;
use clap::Args;
use serde::Serialize;
use std::path::PathBuf;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_model::motion::{self, Outside};
use trueaxis_model::pose::{AxisLine, Posed, ToolPose, pose};
use trueaxis_model::positions::ColumnInput;

/// Show the tool pose relative to the workpiece and the axis locations
///
/// To check the machine description, compare with the display of a controller with tool centre point control on
/// (G43.4, TRAORI, the world coordinates of LinuxCNC): move one axis after the other and see whether the tip moves
/// the same way. The direction points from the tip to the spindle. With an error file, also shows where the tool of the
/// uncompensated machine really is.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis pose machine.toml --at X=100,A=30\n  trueaxis pose machine.toml errors.toml --positions path.csv -o poses.csv\n\n\
Positions have the format of `trueaxis correct`. For each, the CSV has the tip x,y,z (mm) and the tool\n\
direction i,j,k from the tip to the spindle; with an error file, those of the actual tool follow."
)]
pub struct Arguments {
    /// Machine description (machine.toml)
    machine: PathBuf,
    /// Error parameters (errors.toml)
    errors: Option<PathBuf>,
    /// Axis positions; axes left out are at 0 (default: all)
    #[arg(long, value_name = "X=0,Y=0,…", conflicts_with = "positions")]
    at: Option<String>,
    /// Positions (CSV)
    #[arg(long, value_name = "P.csv")]
    positions: Option<PathBuf>,
    /// Where to write the poses of --positions (CSV; default: standard output)
    #[arg(short, long, value_name = "OUT.csv", requires = "positions")]
    output: Option<PathBuf>,
    /// Print JSON: the poses, or with -o what was written
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct PoseAnswer<'a> {
    machine: &'a str,
    axes: &'a [char],
    outside: &'a [Outside<f64>],
    poses: &'a [PosesAt],
}

/// A position (mm, deg) and the poses there.
#[derive(Serialize)]
struct PosesAt {
    position: Vec<f64>,
    #[serde(flatten)]
    posed: Posed,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let machine = files::read_machine(&arguments.machine)?;
    let errors = match &arguments.errors {
        Some(path) => Some(files::read_errors(path, &machine)?),
        None => None,
    };
    let along = arguments.along();
    let rows = match &along {
        Some(along) => arguments.rows(along, &machine, errors.as_ref())?,
        None => vec![arguments.position(&machine, errors.as_ref())?],
    };
    let poses = poses(&machine, errors.as_ref(), &rows);
    let letters: Vec<char> = machine.axes.iter().map(|a| a.letter.char()).collect();
    let outside = motion::outside_machine(&machine, &rows);
    let answer = PoseAnswer {
        machine: &machine.name,
        axes: &letters,
        outside: &outside,
        poses: &poses,
    };
    if let Some(along) = along {
        along.warn(&outside);
        let csv = || csv(&poses);
        return along.finish(None, rows.len(), "poses", csv, &answer, &outside);
    }
    for outside in &outside {
        eprintln!("warning: {outside}");
    }
    let screens = poses.iter().map(|at| screen(&machine, at));
    output::print_answer(arguments.json, &answer, || screens.collect::<String>())?;
    Ok(Outcome::Done)
}

impl Arguments {
    /// The file of positions, if there is one.
    fn along(&self) -> Option<EvalAlong> {
        Some(EvalAlong {
            positions: self.positions.clone()?,
            output: self.output.clone(),
            json: self.json,
        })
    }

    /// The rows of the file of positions.
    fn rows(
        &self,
        along: &EvalAlong,
        machine: &Machine,
        errors: Option<&ErrorModel>,
    ) -> Result<Vec<Vec<f64>>, BadInput> {
        let sensors = errors.into_iter().flat_map(|errors| &errors.sensors);
        let inputs = ColumnInput::of_machine(machine, sensors);
        let mut others = vec![self.machine.as_path()];
        others.extend(self.errors.as_deref());
        along.read(&inputs, &others)
    }

    /// The row for `--at`: the machine's own tool, reference temperatures.
    fn position(
        &self,
        machine: &Machine,
        errors: Option<&ErrorModel>,
    ) -> Result<Vec<f64>, BadInput> {
        let mut row = match &self.at {
            Some(text) => position_argument::position("--at", text, machine)?,
            None => vec![0.0; machine.axes.len()],
        };
        row.extend(machine.length_range.map(|_| machine.tool_length()));
        row.extend(errors.iter().flat_map(|e| &e.sensors).map(|_| 0.0));
        Ok(row)
    }
}

fn poses(machine: &Machine, errors: Option<&ErrorModel>, rows: &[Vec<f64>]) -> Vec<PosesAt> {
    let situations = motion::situations(machine, rows);
    let along = rows.iter().zip(situations);
    along
        .map(|(row, (q, situation))| PosesAt {
            position: row[..machine.axes.len()].to_vec(),
            posed: pose(machine, errors, &q, &situation),
        })
        .collect()
}

/// One line per position.
fn csv(poses: &[PosesAt]) -> String {
    let mut text = String::from("x,y,z,i,j,k");
    if poses.iter().any(|at| at.posed.actual.is_some()) {
        text += ",actual x,actual y,actual z,actual i,actual j,actual k";
    }
    for PosesAt { posed, .. } in poses {
        text.push('\n');
        let tools = std::iter::once(&posed.nominal).chain(&posed.actual);
        let cells: Vec<String> = tools
            .flat_map(|tool| {
                let tip = tool.tip.iter().map(|v| decimals(*v, 7));
                tip.chain(tool.direction.iter().map(|v| decimals(*v, 10)))
            })
            .collect();
        text += &cells.join(",");
    }
    text + "\n"
}

/// The text output for one position.
fn screen(machine: &Machine, at: &PosesAt) -> String {
    let Posed {
        nominal,
        actual,
        axes,
    } = &at.posed;
    let place = machine.axes.iter().zip(&at.position);
    let place: Vec<String> = place.map(|(a, q)| format!("{} = {q}", a.letter)).collect();
    let mut text = format!("{} at {}\n", machine.name, place.join(", "));
    let three = |v: [f64; 3], digits: usize| v.map(|v| format!("{:>12}", decimals(v, digits)));
    let mut block =
        |title: &str, of: fn(&ToolPose) -> [f64; 3], digits, unit: &str, factor: f64| {
            let heads = ["x", "y", "z"].map(|head| format!("{head:>12}")).concat();
            text += &format!("\n{title:<44}{heads}\n");
            let mut row = |name: &str, v: [f64; 3], digits| {
                text += &format!("  {name:<42}{}\n", three(v, digits).concat());
            };
            row("nominal", of(nominal), digits);
            if let Some(actual) = actual {
                row("actual", of(actual), digits);
                let off = std::array::from_fn(|i| (of(actual)[i] - of(nominal)[i]) * factor);
                row(&format!("actual less nominal ({unit})"), off, 2);
            }
        };
    let title = "tool tip in the workpiece frame (mm)";
    block(title, |t| t.tip, 4, "µm", 1e3);
    let title = "tool direction, from the tip to the spindle";
    block(title, |t| t.direction, 6, "µrad", 1e6);
    text += &axis_lines(axes);
    text.lines()
        .map(|l| l.trim_end().to_owned() + "\n")
        .collect()
}

/// What a positive command of each axis does.
fn axis_lines(axes: &[AxisLine]) -> String {
    let mut text = "\na positive command, in the foundation frame         along or about                    through (mm)\n".to_owned();
    for AxisLine {
        axis,
        carries,
        rotary,
        direction,
        point,
    } in axes
    {
        let what = match rotary {
            true => format!("{axis}  turns the {carries} about"),
            false => format!("{axis}  moves the {carries} along"),
        };
        let direction = direction.map(|v| format!("{:>9}", decimals(v, 4))).concat();
        let point = match rotary {
            true => point.map(|v| format!("{:>10}", decimals(v, 3))).concat(),
            false => String::new(),
        };
        text += &format!("  {what:<34}{direction}   {point}\n");
    }
    text
}

/// A number with `digits` decimals, without a minus sign before zeros.
fn decimals(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    match text.strip_prefix('-') {
        Some(zero) if zero.chars().all(|c| "0.".contains(c)) => zero.to_owned(),
        _ => text,
    }
}

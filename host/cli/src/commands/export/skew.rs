//! `trueaxis export klipper`, `marlin` and `reprapfirmware`

use super::ExportVerdict;
use crate::commands::number::positive;
use crate::commands::random::RandomOptions;
use crate::commands::{Outcome, bad_input::BadInput, files};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis_controllers::skew::{Firmware, SkewError, SkewFound, skew};
use trueaxis_tables::validate::Runtime;

#[derive(Args)]
pub struct Arguments {
    /// The compensation of a machine with the axes X, Y and Z
    #[arg(value_name = "FILE.trax")]
    blob: PathBuf,
    /// Where to write the lines
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Largest permitted difference from the compensation
    #[arg(long, value_name = "µm", default_value_t = 1.0, value_parser = positive)]
    tolerance: f64,
    /// Count scales as corrected, because you change the steps per mm as printed
    #[arg(long)]
    steps_changed: bool,
    /// Write the lines even if more is left than the tolerance
    #[arg(long)]
    best_effort: bool,
    #[command(flatten)]
    random: RandomOptions,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

/// With a height map.
#[derive(Args)]
pub struct WithMap {
    #[command(flatten)]
    lines: Arguments,
    /// Also write the correction of Z over X and Y as a height map
    #[arg(long, value_name = "FILE")]
    height_map: Option<PathBuf>,
    /// Points of the map along X and Y
    #[arg(long, value_name = "N,N", default_value = "21,21", value_parser = points)]
    points: [usize; 2],
}

/// Reads numbers of points.
fn points(text: &str) -> Result<[usize; 2], String> {
    let counts = text
        .split_once(',')
        .map(|(x, y)| [x, y].map(|n| n.trim().parse().ok()));
    match counts {
        Some([Some(x), Some(y)]) if (2..=1000).contains(&x) && (2..=1000).contains(&y) => {
            Ok([x, y])
        }
        _ => Err("write two whole numbers from 2 to 1000, like 21,21".to_owned()),
    }
}

#[derive(Serialize)]
struct ExportSkewAnswer<'a> {
    file: &'a Path,
    #[serde(skip_serializing_if = "Option::is_none")]
    height_map: Option<&'a Path>,
    firmware: Firmware,
    written: bool,
    meets_tolerance: bool,
    tolerance_um: f64,
    #[serde(flatten)]
    found: &'a SkewFound,
}

pub fn with_map(firmware: Firmware, arguments: &WithMap) -> Result<Outcome, BadInput> {
    let map = arguments.height_map.as_deref();
    write(
        firmware,
        &arguments.lines,
        map.map(|path| (path, arguments.points)),
    )
}

pub fn run(firmware: Firmware, arguments: &Arguments) -> Result<Outcome, BadInput> {
    write(firmware, arguments, None)
}

fn write(
    firmware: Firmware,
    arguments: &Arguments,
    map: Option<(&Path, [usize; 2])>,
) -> Result<Outcome, BadInput> {
    let Arguments {
        blob: path,
        output,
        tolerance,
        ..
    } = arguments;
    files::prepare(output, &[path])?;
    let blob = files::read_blob(path)?;
    let runtime = Runtime::load(&blob).map_err(|e| BadInput::in_blob(e, path))?;
    let RandomOptions { random, seed } = arguments.random;
    if let Some((to, _)) = map {
        files::prepare(to, &[path])?;
    }
    let points = map.map(|(_, points)| points);
    let made = skew(&runtime, firmware, points, random as usize, seed);
    let (text, found) = made.map_err(|error| refused(&error, path))?;
    let verdict = ExportVerdict::new(arguments.is_met_by(&found), arguments.best_effort);
    if verdict.written {
        files::write(output, text.lines.as_bytes())?;
        if let (Some((to, _)), Some(heights)) = (map, &text.map) {
            files::write(to, heights.as_bytes())?;
        }
    }
    match arguments.json {
        true => files::print_json(&ExportSkewAnswer {
            file: output,
            height_map: map.map(|(to, _)| to),
            firmware,
            written: verdict.written,
            meets_tolerance: verdict.meets,
            tolerance_um: *tolerance,
            found: &found,
        })?,
        false => files::print(&screen(&text.lines, &found))?,
    }
    let why = match map {
        None => "these lines correct squareness only",
        Some(_) => "these lines correct squareness, and the map Z over X and Y, only",
    };
    Ok(verdict.outcome(&format!("more than {tolerance} µm remains"), why))
}

impl Arguments {
    /// Whether what is left of each axis is within the tolerance.
    fn is_met_by(&self, found: &SkewFound) -> bool {
        found.axes.iter().all(|axis| {
            let left = match self.steps_changed {
                true => axis.left_with_steps_um,
                false => axis.left_um,
            };
            left <= self.tolerance
        })
    }
}

fn refused(error: &SkewError, path: &Path) -> BadInput {
    let remedy = match error {
        SkewError::Map(_) => "give fewer --points, or look at the values with `trueaxis inspect`",
        _ => {
            "compile a machine with three linear axes for it; `trueaxis gcode` corrects programs for any controller"
        }
    };
    BadInput::new(format!("{}: {error}", path.display()), remedy)
}

fn screen(text: &str, found: &SkewFound) -> String {
    let mut shown = format!(
        "{text}\nlargest, µm, {} random positions\naxis  correction   remaining   with steps per mm multiplied by\n",
        found.positions
    );
    let axes = found.axes.iter().zip(found.steps).zip(['X', 'Y', 'Z']);
    for ((axis, steps), letter) in axes {
        shown += &format!(
            "{letter}     {:>10.1} {:>11.1} {:>6.1}   {steps:.6}\n",
            axis.largest_um, axis.left_um, axis.left_with_steps_um
        );
    }
    let [x, y, z] = found.turned_urad;
    shown += &format!(
        "not counted: the work is turned by {x:.0}, {y:.0} and {z:.0} µrad about X, Y and Z\n"
    );
    if let Some([x, y]) = found.at_ends_um {
        shown += &format!(
            "Marlin corrects nothing in the first mm of X and of Y, nor where that would leave the travel: up to {x:.1} µm \
             in X and {y:.1} µm in Y stay there\n"
        );
    }
    shown
}

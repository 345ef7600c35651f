//! `trueaxis export klipper`, `marlin` and `reprapfirmware`

use super::{LeftOptions, refused};
use crate::commands::random::RandomOptions;
use crate::commands::{Outcome, bad_input::BadInput, files, output};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis_export::skew::{Firmware, SkewFound, skew};
use trueaxis_model::validate::Runtime;

#[derive(Args)]
pub struct Arguments {
    /// The compensation of a machine with the axes X, Y and Z
    #[arg(value_name = "FILE.trax")]
    blob: PathBuf,
    /// Where to write the lines
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    left: LeftOptions,
    /// Count scales as corrected, because you change the steps per mm as printed
    #[arg(long)]
    steps_changed: bool,
    #[command(flatten)]
    random: RandomOptions,
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
    let (path, output) = (&arguments.blob, &arguments.output);
    let tolerance = arguments.left.tolerance;
    output::prepare(output, &[path])?;
    let blob = files::read_blob(path)?;
    let runtime = Runtime::load(&blob).map_err(|e| BadInput::in_blob(e, path))?;
    let RandomOptions { random, seed } = arguments.random;
    let (to, points) = map.unzip();
    if let Some(to) = to {
        if to == output {
            return Err(BadInput::new(
                format!("{} would be written twice", output.display()),
                "give -o and --height-map different names",
            ));
        }
        output::prepare(to, &[path])?;
    }
    let made = skew(&runtime, firmware, points, random as usize, seed);
    let (text, found) = made.map_err(|error| refused(&error, path))?;
    let mut texts = vec![(output.clone(), text.lines.clone())];
    texts.extend(to.map(Path::to_owned).zip(text.map));
    let verdict = arguments.left.write(&texts, arguments.is_met_by(&found))?;
    let answer = ExportSkewAnswer {
        file: output,
        height_map: to,
        firmware,
        written: verdict.written,
        meets_tolerance: verdict.meets,
        tolerance_um: tolerance,
        found: &found,
    };
    output::print_answer(arguments.left.json, &answer, || screen(&text.lines, &found))?;
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
            left <= self.left.tolerance
        })
    }
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
    if let Some(um) = found.split_um {
        shown += &format!(
            "Klipper follows the map in steps of split_delta_z: {um:.0} µm by default may remain along a move in addition; set \
             split_delta_z: 0.01 in [bed_mesh], the least it takes\n"
        );
    }
    if let Some([x, y]) = found.at_ends_um {
        shown += &format!(
            "Marlin corrects nothing in the first mm of X and of Y, nor where that would leave the travel: up to {x:.1} µm \
             in X and {y:.1} µm in Y stay there\n"
        );
    }
    shown
}

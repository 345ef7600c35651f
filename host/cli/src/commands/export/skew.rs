//! `trueaxis export klipper`, `marlin` and `reprapfirmware`

use crate::commands::number::positive;
use crate::commands::random::Random;
use crate::commands::{Outcome, bad_input::BadInput, files};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis_controllers::skew::{Firmware, Found, skew};
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
    random: Random,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Answer<'a> {
    file: &'a Path,
    firmware: Firmware,
    written: bool,
    meets_tolerance: bool,
    tolerance_um: f64,
    #[serde(flatten)]
    found: &'a Found,
}

pub fn run(firmware: Firmware, arguments: &Arguments) -> Result<Outcome, BadInput> {
    let Arguments {
        blob: path,
        output,
        tolerance,
        ..
    } = arguments;
    files::prepare(output, &[path])?;
    let blob = files::read_blob(path)?;
    let runtime = Runtime::load(&blob).map_err(|e| BadInput::in_blob(e, path))?;
    let Random { random, seed } = arguments.random;
    let (text, found) = skew(&runtime, firmware, random as usize, seed).map_err(|error| {
        BadInput::new(
            format!("{}: {error}", path.display()),
            "compile a machine with three linear axes for it; `trueaxis gcode` corrects programs for any controller",
        )
    })?;
    let left = |axis: &trueaxis_controllers::skew::Left| match arguments.steps_changed {
        true => axis.left_with_steps_um,
        false => axis.left_um,
    };
    let meets = found.axes.iter().all(|axis| left(axis) <= *tolerance);
    let written = meets || arguments.best_effort;
    if written {
        files::write(output, text.as_bytes())?;
    }
    if arguments.json {
        files::print_json(&Answer {
            file: output,
            firmware,
            written,
            meets_tolerance: meets,
            tolerance_um: *tolerance,
            found: &found,
        })?;
    } else {
        files::print(&screen(&text, &found))?;
    }
    if !meets {
        eprintln!(
            "more than {tolerance} µm is left{}: these lines correct squareness only",
            match written {
                true => "",
                false => ", and nothing is written (--best-effort would)",
            }
        );
        return Ok(Outcome::CheckFailed);
    }
    Ok(Outcome::Done)
}

fn screen(text: &str, found: &Found) -> String {
    let mut shown = format!(
        "{text}\nlargest, µm, {} random positions\naxis  correction   left   with steps per mm multiplied by\n",
        found.positions
    );
    let axes = found.axes.iter().zip(found.steps).zip(['X', 'Y', 'Z']);
    for ((axis, steps), letter) in axes {
        shown += &format!(
            "{letter}     {:>10.1} {:>6.1} {:>6.1}   {steps:.6}\n",
            axis.largest_um, axis.left_um, axis.left_with_steps_um
        );
    }
    let [x, y, z] = found.turned_urad;
    shown
        + &format!(
            "not counted: the work is turned by {x:.0}, {y:.0} and {z:.0} µrad about X, Y and Z\n"
        )
}

//! `trueaxis iso230-7`

use super::Outcome;
use super::bad_input::BadInput;
use super::files::{self, Text};
use clap::Args;
use std::path::PathBuf;
use trueaxis_measure::direct::iso230_7::{ErrorMotion, Turns, TurnsRecord};
use trueaxis_measure::formats::revolutions;
use trueaxis_report::picture::{Drawing, Ink, Picture, Polar, PolarTurn};

/// Evaluate error motions of a spindle or a rotary table to ISO 230-7
///
/// Takes readings of up to five displacement sensors over whole turns and prints the total, synchronous and
/// asynchronous error motion values: radial and tilt for a fixed and a rotating sensitive direction, from the centre of
/// the least-squares circle, and axial from the centre of the polar plot.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis iso230-7 turns.csv --pictures spindle\n\n\
Each row has the number of its turn, the angle of the spindle from +X towards +Y, and what the sensors read there,\n\
positive towards +X, +Y and +Z. Every turn has the same angles; sensors may be left out:\n  \
# sensors_apart_mm = 100.0      # how far X2 and Y2 are from X1 and Y1 in +Z\n  \
turn,angle_deg,x1_um,y1_um,x2_um,y2_um,z_um\n  1,0,12.1,0.3,12.4,0.2,0.1\n  1,5,12.0,1.4,12.3,1.3,0.1"
)]
pub struct Arguments {
    /// Readings (CSV)
    readings: PathBuf,
    /// Write polar plots into this folder, as SVG files
    #[arg(long, value_name = "FOLDER")]
    pictures: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let text = Text::read(&arguments.readings)?;
    let measured = revolutions::read(&text.text).map_err(|error| text.bad(error))?;
    let found = measured.error_motions();
    if let Some(folder) = &arguments.pictures {
        files::write_pictures(folder, pictures(&measured, &found))?;
    }
    match arguments.json {
        true => files::print_json(&TurnsRecord::of(&measured, &found))?,
        false => files::print(&screen(&text.name, &measured, &found))?,
    }
    Ok(Outcome::Done)
}

/// The text output.
fn screen(name: &str, measured: &Turns, found: &[ErrorMotion]) -> String {
    let mut text = format!(
        "{name}: error motions of an axis of rotation (ISO 230-7)\n{} turns with {} angles\n\n{:<28}{:>10}{:>14}{:>15}{:>13}\n",
        measured.readings.len(),
        measured.angles.len(),
        "",
        "total",
        "synchronous",
        "asynchronous",
        "off centre"
    );
    for motion in found {
        let (factor, unit) = motion.unit.shown();
        let off = motion
            .off_centre
            .map_or("–".to_owned(), |v| format!("{:.2}", v * factor));
        text += &format!(
            "{:<28}{:>10.2}{:>14.2}{:>15.2}{off:>13}\n",
            format!("{} ({unit})", motion.name),
            motion.total * factor,
            motion.synchronous * factor,
            motion.asynchronous * factor
        );
    }
    text
}

/// A polar plot of each error motion, with its name.
fn pictures(measured: &Turns, found: &[ErrorMotion]) -> Vec<(String, Picture)> {
    let one = |motion: &ErrorMotion| {
        let name = motion.name.replace(", ", "-").replace(' ', "-");
        (name.to_lowercase(), picture(measured, motion))
    };
    found.iter().map(one).collect()
}

/// All turns, and their mean.
fn picture(measured: &Turns, motion: &ErrorMotion) -> Picture {
    let (factor, unit) = motion.unit.shown();
    let around = |values: &[f64]| -> Vec<(f64, f64)> {
        let both = measured.angles.iter().zip(values);
        both.map(|(angle, value)| (*angle, value * factor))
            .collect()
    };
    let total = motion.turns.iter().flat_map(|turn| around(turn)).collect();
    let mut mean = around(&motion.mean);
    // The curve is closed.
    mean.extend(mean.first().copied());
    let turn = |name: &str, ink, readings| PolarTurn {
        name: name.to_owned(),
        ink,
        readings,
    };
    Polar {
        title: format!(
            "{} error motion in {unit} over the angle: all turns, and their mean",
            motion.name
        ),
        axes: ["0°", "90°"].map(str::to_owned),
        unit: unit.to_owned(),
        turns: vec![
            turn("total", Ink::Before, total),
            turn("synchronous", Ink::After, mean),
        ],
    }
    .draw()
}

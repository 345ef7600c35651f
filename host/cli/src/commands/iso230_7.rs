//! `trueaxis iso230-7`

use super::Outcome;
use super::bad_input::BadInput;
use super::files::Text;
use super::output;
use clap::Args;
use std::path::PathBuf;
use trueaxis_direct::formats::revolutions;
use trueaxis_direct::iso230_7::{ErrorMotion, Turns, TurnsRecord};
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
    let record = measured.record();
    if let Some(folder) = &arguments.pictures {
        let one = |motion: &ErrorMotion| {
            let name = motion.name.replace(", ", "-").replace(' ', "-");
            (name.to_lowercase(), picture(&measured, motion))
        };
        let pictures: Vec<_> = record.error_motions.iter().map(one).collect();
        output::write_pictures(folder, pictures)?;
    }
    output::print_answer(arguments.json, &record, || screen(&text.name, &record))?;
    Ok(Outcome::Done)
}

/// The text output.
fn screen(name: &str, record: &TurnsRecord) -> String {
    let mut text = format!(
        "{name}: error motions of an axis of rotation (ISO 230-7)\n{} turns with {} angles\n\n{:<28}{:>10}{:>14}{:>15}{:>13}\n",
        record.turns, record.angles, "", "total", "synchronous", "asynchronous", "off centre"
    );
    for motion in &record.error_motions {
        let off = (motion.off_centre).map_or("–".to_owned(), |v| format!("{v:.2}"));
        text += &format!(
            "{:<28}{:>10.2}{:>14.2}{:>15.2}{off:>13}\n",
            format!("{} ({})", motion.name, motion.unit),
            motion.total,
            motion.synchronous,
            motion.asynchronous
        );
    }
    text
}

/// All turns, and their mean.
fn picture(measured: &Turns, motion: &ErrorMotion) -> Picture {
    let around = |values: &[f64]| -> Vec<(f64, f64)> {
        (measured.angles.iter().copied())
            .zip(values.iter().copied())
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
            "{} error motion in {} over the angle: all turns, and their mean",
            motion.name, motion.unit
        ),
        axes: ["0°", "90°"].map(str::to_owned),
        unit: motion.unit.to_string(),
        turns: vec![
            turn("total", Ink::Before, total),
            turn("synchronous", Ink::After, mean),
        ],
    }
    .draw()
}

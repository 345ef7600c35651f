//! `trueaxis export fanuc`

use super::left;
use crate::commands::number::{finite, positive};
use crate::commands::{Outcome, bad_input::BadInput, files, output};
use clap::Args;
use serde::Serialize;
use std::path::PathBuf;
use trueaxis_export::fanuc::{self, FanucOptions, MOST_ALONG};
use trueaxis_model::validate::Runtime;

/// Write a compensation as the grid of a Fanuc 30i (three-dimensional error compensation)
///
/// Corrections of X, Y and Z as whole numbers on a grid over X, Y and Z. Further axes are not corrected; what is left is
/// printed, and more than the tolerance is refused.
#[derive(Args)]
#[command(after_help = "Example:\n  trueaxis export fanuc machine.trax --unit 0.0001 -o grid.csv")]
pub struct Arguments {
    /// The compensation
    #[arg(value_name = "FILE.trax")]
    blob: PathBuf,
    /// Where to write the grid
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Points along X, Y and Z
    #[arg(long, value_name = "N,N,N", default_value = "25,25,25", value_parser = points)]
    points: [usize; 3],
    /// Detection unit of the control
    #[arg(long, value_name = "mm", default_value_t = 0.001, value_parser = positive)]
    unit: f64,
    /// Positions of further axes for which alone the grid is made
    #[arg(long, value_name = "A=0,C=0")]
    at: Option<String>,
    #[command(flatten)]
    left: left::Arguments,
}

/// Reads numbers of points.
fn points(text: &str) -> Result<[usize; 3], String> {
    let counts: Vec<Option<usize>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    let within = |n: &usize| (2..=MOST_ALONG).contains(n);
    match counts[..] {
        [Some(x), Some(y), Some(z)] if [x, y, z].iter().all(within) => Ok([x, y, z]),
        _ => Err(format!(
            "write three whole numbers from 2 to {MOST_ALONG}, like 25,25,25"
        )),
    }
}

#[derive(Serialize)]
struct FanucNotes {
    points: [usize; 3],
    magnification: [u32; 3],
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let Arguments { blob: path, .. } = arguments;
    output::prepare(&arguments.output, &[path])?;
    let blob = files::read_blob(path)?;
    let runtime = Runtime::load(&blob).map_err(|e| BadInput::in_blob(e, path))?;
    let options = FanucOptions {
        points: arguments.points,
        unit: arguments.unit,
        at: at(arguments.at.as_deref())?,
        positions: arguments.left.random.random as usize,
        seed: arguments.left.random.seed,
    };
    let made = fanuc::export(&runtime, &options).map_err(|error| super::refused(&error, path))?;
    let (table, text, found) = made;
    let [x, y, z] = table.magnification;
    let only = match &arguments.at {
        Some(at) => format!(", only for {at}"),
        None => String::new(),
    };
    let screen = format!(
        "{}: {} points, magnification {x}, {y}, {z}{only}\n",
        arguments.output.display(),
        table.values.len()
    );
    let more = FanucNotes {
        points: arguments.points,
        magnification: table.magnification,
    };
    let stays = "the grid knows X, Y and Z, and no direction of travel (--at holds rotary axes, --points and --unit make it finer)";
    let texts = [(arguments.output.clone(), text)];
    (arguments.left).write(&runtime, &texts, &found, &screen, stays, &more)
}

/// Positions by letters.
fn at(text: Option<&str>) -> Result<Vec<(char, f64)>, BadInput> {
    let parts = text.into_iter().flat_map(|text| text.split(','));
    let one = |part: &str| {
        let (letter, value) = part.split_once('=')?;
        let mut letters = letter.trim().chars();
        let letter = letters.next().filter(|_| letters.next().is_none())?;
        Some((letter.to_ascii_uppercase(), finite(value.trim()).ok()?))
    };
    parts
        .map(|part| {
            one(part).ok_or_else(|| {
                BadInput::new(
                    format!("--at: `{part}` is not an axis, an equals sign and a number"),
                    "write positions in degrees, like A=0,C=90",
                )
            })
        })
        .collect()
}

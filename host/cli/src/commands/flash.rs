//! `trueaxis flash`

use super::Outcome;
use super::bad_input::BadInput;
use super::files;
use super::output;
use super::port::PortArguments;
use super::progress::ProgressBarOnScreen;
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis::AlignedBlob;
use trueaxis::link::Storing;
use trueaxis_link::{Activated, LinkedController};
use trueaxis_model::validate::Runtime;
use trueaxis_tables::target::Target;

/// Upload a compensation to a controller
///
/// The upload goes to the table slot that is not in use. With --activate the compensation is in use from then on,
/// also after a restart; otherwise it waits for `trueaxis control … activate`. An interrupted upload is resumed. The
/// compensation in use remains so until the new one is complete and verified.
///
/// --dry-run uploads nothing: it prints the controller's capacity in the format of `compile --target`, and checks
/// the compensation, if given, as an upload would.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis flash machine.trax --port /dev/ttyUSB0 --activate\n\nContents of the controller:\n  trueaxis flash --dry-run --port /dev/ttyUSB0 > board.toml\n  trueaxis compile machine.toml errors.toml -o machine.trax --target board.toml"
)]
pub struct Arguments {
    /// The compensation
    #[arg(value_name = "FILE.trax", required_unless_present = "dry_run")]
    blob: Option<PathBuf>,
    #[command(flatten)]
    port: PortArguments,
    /// Switch to it now and at every start
    #[arg(long)]
    activate: bool,
    /// Upload nothing: check the compensation and print the controller's capacity
    #[arg(long, conflicts_with = "activate")]
    dry_run: bool,
    /// Even if the controller has a compensation for another machine (name or axes)
    #[arg(long)]
    force: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Flashed<'a> {
    file: &'a Path,
    firmware: &'a str,
    board: &'a str,
    slot: String,
    sequence: u32,
    bytes: usize,
    already: bool,
    resumed: u32,
    active: bool,
    fading: bool,
    at_start: bool,
}

#[derive(Serialize)]
struct CheckedBlob<'a> {
    file: Option<&'a Path>,
    firmware: &'a str,
    board: &'a str,
    target: &'a Target,
}

/// Reads a compensation and validates it.
fn read(path: &Path) -> Result<AlignedBlob, BadInput> {
    let blob = files::read_blob(path)?;
    Runtime::load(&blob).map_err(|e| BadInput::in_blob(e, path))?;
    Ok(blob)
}

/// Prints the controller's capacity in the format of `compile --target`; uploads nothing.
fn dry_run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let port = &arguments.port;
    let path = arguments.blob.as_deref();
    let blob = path.map(read).transpose()?;
    let (_, controller) = port.connect()?;
    if let Some(blob) = &blob {
        trueaxis_link::check(&controller, blob, arguments.force)
            .map_err(|error| port.bad_flash(&error))?;
    }
    let target = controller.target();
    let (firmware, board) = (&controller.firmware, &controller.board);
    if arguments.json {
        output::print_json(&CheckedBlob {
            file: path,
            firmware,
            board,
            target: &target,
        })?;
        return Ok(Outcome::Done);
    }
    let mut text = format!("# {}: {firmware} on {board}\n", port.port);
    if let Some(path) = path {
        text += &format!("# {} fits\n", path.display());
    }
    output::print(&(text + &target.to_toml()))?;
    Ok(Outcome::Done)
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let Arguments {
        blob: Some(path),
        port,
        activate,
        dry_run: false,
        force,
        json,
    } = arguments
    else {
        return dry_run(arguments);
    };
    let blob = read(path)?;
    let (mut client, controller) = port.connect()?;
    let bar = ProgressBarOnScreen::new();
    let outcome = trueaxis_link::flash(&mut client, &controller, &blob, *force, *activate, &bar)
        .map_err(|error| port.bad_flash(&error))?;
    drop(bar);
    let flashed = Flashed {
        file: path,
        firmware: &controller.firmware,
        board: &controller.board,
        slot: outcome.slot.to_string(),
        sequence: outcome.sequence,
        bytes: blob.len(),
        already: outcome.already,
        resumed: outcome.resumed,
        active: outcome.activated == Activated::Yes,
        fading: outcome.activated == Activated::WithMotion,
        at_start: outcome.at_start.in_use == Some(outcome.slot),
    };
    match *json {
        true => output::print_json(&flashed)?,
        false => output::print(&screen(port, &controller, &outcome, path, blob.len()))?,
    }
    Ok(Outcome::Done)
}

/// The text output.
fn screen(
    port: &PortArguments,
    controller: &LinkedController,
    outcome: &trueaxis_link::UploadOutcome,
    path: &Path,
    bytes: usize,
) -> String {
    let trueaxis_link::UploadOutcome {
        slot,
        sequence,
        already,
        resumed,
        activated,
        at_start,
    } = *outcome;
    let (firmware, board) = (&controller.firmware, &controller.board);
    let (port, path) = (&port.port, path.display());
    let mut text = format!("{port}: {firmware} on {board}\n");
    let from = match resumed {
        0 => String::new(),
        n => format!(" (from byte {n} on, the rest was there)"),
    };
    text += &match already {
        true => format!("{path}: slot {slot} holds it already, as number {sequence}\n"),
        false => format!(
            "{path}: {bytes} bytes{from} written to slot {slot} and verified, number {sequence}\n"
        ),
    };
    text += match activated {
        Activated::Yes => "in use\n",
        Activated::WithMotion => "accepted: it is faded in as soon as the machine moves\n",
        Activated::No if controller.active == Some(slot) => "in use\n",
        Activated::No => "not in use: `trueaxis control` activates it, or --activate\n",
    };
    if activated != Activated::No && at_start.in_use != Some(slot) {
        text += at_next_start(at_start.storing);
    }
    text
}

fn at_next_start(storing: Storing) -> &'static str {
    match storing {
        Storing::Failed(_) => {
            "not stored: the next start uses the previous compensation; see `trueaxis control`\n"
        }
        _ => "at the next start too once the machine has stood still with its drives off\n",
    }
}

//! `trueaxis control`

use super::Outcome;
use super::bad_input::BadInput;
use super::hal::PinValues;
use super::monitor::{activation, conditions};
use super::output;
use super::port::Connection;
use clap::{Args, Subcommand, ValueEnum};
use serde_json::{Value, json};
use std::thread::sleep;
use std::time::{Duration, Instant};
use trueaxis::link::{Slot, Storing};
use trueaxis_link::{Action, ControllerState, Done};

/// Switch corrections on or off, and choose the compensation in use
///
/// Shows the state before and after. Settings last until the controller restarts, except `enable-at-start`,
/// `activate` and `rollback`, which are stored. If writing flash stalls the controller, these are stored once the
/// machine stands still with its drives off; until then they are shown as pending. With --hal, the settings are pins of
/// the component in LinuxCNC: show, enable, disable, dry-run, reload, tool-length (machine units) and weight (number of
/// the pin).
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis control --port /dev/ttyUSB0 reference XYZ\n  trueaxis control --port /dev/ttyUSB0 enable\n  trueaxis control --hal enable"
)]
pub struct Arguments {
    #[command(flatten)]
    connection: Connection,
    /// Print JSON
    #[arg(long, global = true)]
    json: bool,
    #[command(subcommand)]
    what: ControlCommand,
}

#[derive(Subcommand)]
enum ControlCommand {
    /// Show the state and change nothing
    #[command(after_help = "Example:\n  trueaxis control --port /dev/ttyUSB0 show")]
    Show,
    /// Switch corrections on until the next restart
    #[command(after_help = "Example:\n  trueaxis control --port /dev/ttyUSB0 enable")]
    Enable,
    /// Switch corrections off
    #[command(after_help = "Example:\n  trueaxis control --port /dev/ttyUSB0 disable")]
    Disable,
    /// Switch corrections on at every start, or not (factory setting: not)
    ///
    /// Stored; uploads and rollbacks do not change it. Corrections stay off if the controller starts without the
    /// compensation that it should use, or with one for another machine.
    #[command(after_help = "Example:\n  trueaxis control --port /dev/ttyUSB0 enable-at-start on")]
    EnableAtStart {
        /// on or off
        switch: ControlSwitch,
    },
    /// Compute the corrections without applying them
    #[command(after_help = "Example:\n  trueaxis control --port /dev/ttyUSB0 dry-run on")]
    DryRun {
        /// on or off
        switch: ControlSwitch,
    },
    /// Read the file of the HAL component again
    #[command(after_help = "Example:\n  trueaxis control --hal reload")]
    Reload,
    /// Set the tool length in mm, along the tool axis from the spindle frame
    #[command(after_help = "Example:\n  trueaxis control --port /dev/ttyUSB0 tool-length 120.5")]
    ToolLength {
        /// Length in mm
        #[arg(value_name = "MM", allow_negative_numbers = true)]
        length: f32,
    },
    /// Set the weight of an adjustable term; `show` lists them
    #[command(after_help = "Example:\n  trueaxis control --port /dev/ttyUSB0 weight 7 0.5")]
    Weight {
        /// Number of the term, as printed by `show` and `inspect`
        term: u16,
        /// Weight, within the limits of the term
        #[arg(allow_negative_numbers = true)]
        value: f32,
    },
    /// Switch to the compensation in a slot, permanently
    #[command(after_help = "Example:\n  trueaxis control --port /dev/ttyUSB0 activate B")]
    Activate {
        /// A or B
        slot: SlotName,
        /// Even if it is for another machine (name or axes)
        #[arg(long)]
        force: bool,
    },
    /// Switch back to the previous compensation, permanently
    #[command(after_help = "Example:\n  trueaxis control --port /dev/ttyUSB0 rollback")]
    Rollback {
        /// Even if it is for another machine (name or axes)
        #[arg(long)]
        force: bool,
    },
    /// State which axes are referenced, unless the motion controller reports it itself
    #[command(
        after_help = "Examples:\n  trueaxis control --port /dev/ttyUSB0 reference XYZ\n  trueaxis control --port /dev/ttyUSB0 reference none"
    )]
    Reference {
        /// Letters of all referenced axes, or `all`, or `none`
        axes: String,
    },
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum ControlSwitch {
    On,
    Off,
}

#[derive(Clone, Copy, ValueEnum)]
enum SlotName {
    #[value(name = "A", alias = "a")]
    A,
    #[value(name = "B", alias = "b")]
    B,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let Some(port) = &arguments.connection.port() else {
        return in_hal(arguments);
    };
    let (mut client, controller) = port.connect()?;
    let action = action(&arguments.what, &controller.axes)?;
    let done =
        trueaxis_link::control(&mut client, &action).map_err(|error| port.refused(&error))?;
    if arguments.json {
        output::print_json(&object(&done))?;
    } else {
        let controller = &done.after.controller;
        let machine = match controller.machine.as_str() {
            "" => "no machine",
            name => name,
        };
        let (firmware, board) = (&controller.firmware, &controller.board);
        let head = format!("{}: {firmware} on {board}, {machine}\n", port.port);
        output::print(&text(head, &lines(&done.before), &lines(&done.after)))?;
    }
    Ok(Outcome::Done)
}

/// What a board is asked to do; `axes` are those of its machine.
fn action(what: &ControlCommand, axes: &str) -> Result<Action, BadInput> {
    let on = |switch: ControlSwitch| switch == ControlSwitch::On;
    Ok(match what {
        ControlCommand::Reload => {
            return Err(BadInput::new(
                "reload is for --hal: a board has slots",
                "`trueaxis flash` writes a compensation to a board",
            ));
        }
        ControlCommand::Show => Action::Show,
        ControlCommand::Enable => Action::Enable(true),
        ControlCommand::Disable => Action::Enable(false),
        ControlCommand::EnableAtStart { switch } => Action::EnableAtStart(on(*switch)),
        ControlCommand::DryRun { switch } => Action::DryRun(on(*switch)),
        ControlCommand::ToolLength { length } => Action::ToolLength(*length),
        ControlCommand::Weight { term, value } => Action::Weight {
            term: *term,
            value: *value,
        },
        ControlCommand::Activate { slot, force } => Action::Activate {
            slot: match slot {
                SlotName::A => Slot::A,
                SlotName::B => Slot::B,
            },
            force: *force,
        },
        ControlCommand::Rollback { force } => Action::Rollback { force: *force },
        ControlCommand::Reference { axes: letters } => Action::Reference(match letters.as_str() {
            "all" => axes.to_owned(),
            "none" => String::new(),
            letters => letters.to_uppercase(),
        }),
    })
}

/// The component of LinuxCNC: its switches are pins.
fn in_hal(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let before = PinValues::read()?;
    let switch = |name: &str, on: bool| before.set(name, if on { "1" } else { "0" });
    match &arguments.what {
        ControlCommand::Show => {}
        ControlCommand::Enable => switch("enable", true)?,
        ControlCommand::Disable => switch("enable", false)?,
        ControlCommand::DryRun { switch: to } => switch("dry-run", *to == ControlSwitch::On)?,
        ControlCommand::ToolLength { length } => before.set("tool-length", &length.to_string())?,
        ControlCommand::Weight { term, value } => {
            before.set(&format!("weight-{term}"), &value.to_string())?
        }
        ControlCommand::Reload => reload(&before)?,
        ControlCommand::EnableAtStart { .. }
        | ControlCommand::Activate { .. }
        | ControlCommand::Rollback { .. }
        | ControlCommand::Reference { .. } => {
            return Err(BadInput::new(
                "this is for a board: LinuxCNC references axes itself, and has one file",
                "enable, disable, dry-run, reload, tool-length, weight and show work with --hal",
            ));
        }
    }
    sleep(PERIODS);
    let mut after = PinValues::read()?;
    let until = Instant::now() + LONGEST;
    while after.is_on("loading") && Instant::now() < until {
        sleep(PERIODS);
        after = PinValues::read()?;
    }
    if arguments.json {
        output::print_json(&json!({"before": before.object(), "after": after.object()}))?;
    } else {
        let head = "HAL: trueaxis\n".to_owned();
        output::print(&text(head, &before.lines(), &after.lines()))?;
    }
    match (&arguments.what, after.load_fault()) {
        (ControlCommand::Reload, Some(fault)) => {
            eprintln!("the file is not accepted: {fault}; what was in use stays in use");
            Ok(Outcome::CheckFailed)
        }
        _ => Ok(Outcome::Done),
    }
}

/// Gives `reload` a rising edge and waits until the component has answered it. An edge counts when the servo thread has
/// seen both levels.
fn reload(before: &PinValues) -> Result<(), BadInput> {
    let until = Instant::now() + LONGEST;
    let mut level = false;
    while PinValues::read()?.index("reloads") == before.index("reloads") {
        if Instant::now() > until {
            return Err(BadInput::new(
                "the component does not read its file",
                "look whether its function is in a thread that runs: halcmd show thread",
            ));
        }
        level = !level;
        before.set("reload", if level { "1" } else { "0" })?;
        sleep(PERIODS);
    }
    before.set("reload", "0")
}

/// Some periods of any thread.
const PERIODS: Duration = Duration::from_millis(50);
/// How long to wait for a file to be read.
const LONGEST: Duration = Duration::from_secs(10);

/// Whether corrections are on.
fn corrections(state: &ControllerState) -> String {
    let report = &state.report;
    let wanted = match (report.enabled, report.dry_run) {
        (false, _) => "disabled",
        (true, false) => "enabled",
        (true, true) => "enabled, dry run",
    };
    let come = match (report.enabled, report.factor) {
        (_, 1.0) => "in".to_owned(),
        (_, 0.0) => "out".to_owned(),
        (true, factor) => format!("coming in, {:.0} %", 100.0 * factor),
        (false, factor) => format!("going out, {:.0} %", 100.0 * factor),
    };
    let holds = conditions(report.conditions);
    // Already part of the line above.
    let said = ["disabled", "dry run"];
    let holds: Vec<&str> = holds
        .into_iter()
        .filter(|name| !said.contains(name))
        .collect();
    let held = match holds[..] {
        [] => String::new(),
        _ => format!(" ({})", holds.join(", ")),
    };
    format!("{wanted}, {come}{held}")
}

fn start(state: &ControllerState) -> String {
    let at_start = &state.at_start;
    let slot =
        |slot: Option<Slot>| slot.map_or("no slot".to_owned(), |slot| format!("slot {slot}"));
    let enable = match at_start.enable {
        true => "enabled",
        false => "disabled",
    };
    let mut text = format!("{}, {enable}", slot(at_start.in_use));
    if let Some(before) = at_start.before {
        text += &format!("; for a rollback slot {before}");
    }
    if let Some(waiting) = at_start.waiting {
        text += &format!("; slot {waiting} waits to be activated");
    }
    match at_start.storing {
        Storing::Stored => {}
        Storing::Pending => {
            text += "; the change is stored at the next standstill with drives off";
        }
        Storing::Failed(why) => text += &format!("; the change is not stored: {why}"),
    }
    text
}

fn axes(state: &ControllerState) -> String {
    match state.referenced().as_str() {
        "" => "none".to_owned(),
        letters => letters.to_owned(),
    }
}

/// Every setting that can change, by name.
fn lines(state: &ControllerState) -> Vec<(String, String)> {
    let mut lines = vec![
        ("corrections".to_owned(), corrections(state)),
        (
            "compensation".to_owned(),
            activation(state.report.activation),
        ),
        ("at start".to_owned(), start(state)),
        ("referenced".to_owned(), axes(state)),
    ];
    for (k, value) in state.report.auxiliaries.iter().enumerate() {
        lines.push((format!("auxiliary {k}"), format!("{value:.3}")));
    }
    for weight in &state.weights {
        let letter = state.controller.axes.chars().nth(weight.output.into());
        let [low, high] = weight.limits;
        let name = format!("weight {}", weight.term);
        let on = letter.map_or(String::new(), |letter| format!(" on {letter}"));
        lines.push((name, format!("{}{on}, from {low} to {high}", weight.value)));
    }
    if let Some(fault) = state.report.fault {
        lines.push(("fault".to_owned(), fault.to_string()));
    }
    lines
}

/// Text output after a head: for settings that changed, the old and the new value; for the others, the current one.
fn text(mut text: String, before: &[(String, String)], after: &[(String, String)]) -> String {
    let was = |name: &str| {
        before
            .iter()
            .find(|line| line.0 == name)
            .map(|line| &line.1)
    };
    for (name, now) in after {
        let changed = was(name).filter(|was| *was != now);
        if let Some(was) = changed {
            text += &format!("{name:<12} {was}\n{:>12} {now}\n", "->");
        } else {
            text += &format!("{name:<12} {now}\n");
        }
    }
    for (name, was) in before {
        if after.iter().all(|line| line.0 != *name) {
            text += &format!("{name:<12} {was}\n{:>12} gone\n", "->");
        }
    }
    text
}

fn object(done: &Done) -> Value {
    let controller = &done.after.controller;
    json!({
        "firmware": controller.firmware,
        "board": controller.board,
        "machine": controller.machine,
        "axes": controller.axes,
        "before": state(&done.before),
        "after": state(&done.after),
    })
}

fn state(state: &ControllerState) -> Value {
    let (report, at_start) = (&state.report, &state.at_start);
    let slot = |slot: Option<Slot>| slot.map(|slot| slot.to_string());
    let weight = |weight: &trueaxis::link::TermWeight| {
        json!({
            "term": weight.term,
            "axis": state.controller.axes.chars().nth(weight.output.into()),
            "value": weight.value,
            "limits": weight.limits,
        })
    };
    json!({
        "enabled": report.enabled,
        "dry_run": report.dry_run,
        "factor": report.factor,
        "conditions": conditions(report.conditions),
        "active": slot(state.controller.active),
        "compensation": activation(report.activation),
        "referenced": state.referenced(),
        "auxiliaries": report.auxiliaries.as_slice(),
        "weights": state.weights.iter().map(weight).collect::<Vec<_>>(),
        "at_start": {
            "in_use": slot(at_start.in_use),
            "before": slot(at_start.before),
            "waiting": slot(at_start.waiting),
            "enable": at_start.enable,
            "storing": match at_start.storing {
                Storing::Stored => "stored".to_owned(),
                Storing::Pending => "pending".to_owned(),
                Storing::Failed(why) => why.to_string(),
            },
        },
        "fault": report.fault.map(|fault| fault.to_string()),
    })
}

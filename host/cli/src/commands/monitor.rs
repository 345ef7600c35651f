//! `trueaxis monitor`

use super::Outcome;
use super::bad_input::BadInput;
use super::hal::PinValues;
use super::output;
use super::port::{AnyClient, Connection, PortArguments};
use clap::Args;
use serde_json::json;
use std::io::IsTerminal;
use std::time::{Duration, Instant};
use trueaxis::Conditions;
use trueaxis::link::{Activation, CostUnit, Health, MOST_AXES, Report, SlotState, Upload};
use trueaxis_link::LinkedController;

/// Watch a controller or LinuxCNC: positions, corrections, faults
#[derive(Args)]
#[command(
    after_help = "Examples:\n  trueaxis monitor --port /dev/ttyUSB0 --csv > run.csv\n  trueaxis monitor --hal"
)]
pub struct Arguments {
    #[command(flatten)]
    connection: Connection,
    /// Print one line per sample: time, positions, corrections, status
    #[arg(long, conflicts_with = "json")]
    csv: bool,
    /// Print one JSON object per line and sample
    #[arg(long)]
    json: bool,
    /// Time between samples, ms
    #[arg(long, value_name = "MS", default_value_t = 200)]
    interval: u64,
    /// Number of samples (default: until interrupted)
    #[arg(long, value_name = "N")]
    count: Option<u64>,
}

/// What is watched, as of the last sample.
trait WatchedSource {
    fn sample(&mut self) -> Result<(), BadInput>;
    fn table(&self) -> String;
    /// Columns of `--csv`.
    fn header(&self) -> String;
    fn line(&self, seconds: f64) -> String;
    fn object(&self, seconds: f64) -> serde_json::Value;
}

/// A board on a port.
struct WatchedBoard {
    port: PortArguments,
    client: AnyClient,
    controller: LinkedController,
    report: Report,
    health: Option<Health>,
    known: Option<(Activation, Upload)>,
}

impl WatchedBoard {
    fn connect(port: PortArguments) -> Result<Self, BadInput> {
        let (mut client, controller) = port.connect()?;
        let report = client.status().map_err(|error| port.bad(&error))?;
        Ok(Self {
            port,
            client,
            controller,
            report,
            health: None,
            known: None,
        })
    }
}

impl WatchedSource for WatchedBoard {
    fn sample(&mut self) -> Result<(), BadInput> {
        let bad = |error| self.port.bad(&error);
        self.report = self.client.status().map_err(bad)?;
        self.health = self.client.health().map_err(bad)?;
        let state = (self.report.activation, self.report.upload);
        if self.known.replace(state) != Some(state) {
            // Slots, machine and axes may have changed.
            self.controller = self.client.hello().map_err(bad)?;
        }
        Ok(())
    }
    fn table(&self) -> String {
        let Self {
            controller, report, ..
        } = self;
        let port = &self.port.port;
        let (firmware, board) = (&controller.firmware, &controller.board);
        let machine = match controller.machine.as_str() {
            "" => "no machine",
            name => name,
        };
        let mut text = format!("{port}: {firmware} on {board}, {machine}\n");
        for (name, report) in ["A", "B"].into_iter().zip(&controller.slots) {
            let (state, erased) = (slot(report.state), report.erased);
            text += &format!("slot {name}       {state}; erased {erased} times\n");
        }
        text += &corrections(report);
        if let Some(health) = self.health {
            text += &well(&health);
        }
        for (k, value) in report.auxiliaries.iter().enumerate() {
            let lost = match (report.sensors_lost >> k) & 1 {
                0 => "",
                _ => " (sensor lost: its last value, or 0 if there was none)",
            };
            let value = match value.is_nan() {
                true => "not known yet".to_owned(),
                false => format!("{value:.3}"),
            };
            text += &format!("auxiliary {k}  {value}{lost}\n");
        }
        text + &axes(&controller.axes, report)
    }

    fn header(&self) -> String {
        let mut text = "time".to_owned();
        for prefix in ["", "d", "computed "] {
            for letter in self.controller.axes.chars() {
                text += &format!(",{prefix}{letter}");
            }
        }
        text + ",factor,conditions,saturated,rate_limited,travel_limited,missed,worst_cost\n"
    }

    fn line(&self, seconds: f64) -> String {
        let report = &self.report;
        let mut text = format!("{seconds:.3}");
        for values in [&report.positions, &report.dq, &report.computed] {
            for value in values {
                text += &format!(",{value}");
            }
        }
        let Report {
            factor,
            saturated,
            rate_limited,
            travel_limited,
            missed,
            worst_cost,
            ..
        } = report;
        let holds = conditions(report.conditions).join(" + ");
        text += &format!(
            ",{factor},{holds},{saturated},{rate_limited},{travel_limited},{missed},{worst_cost}\n"
        );
        text
    }

    fn object(&self, seconds: f64) -> serde_json::Value {
        let Self {
            controller,
            report,
            health,
            ..
        } = self;
        json!({
            "time": seconds,
            "machine": controller.machine,
            "axes": controller.axes,
            "positions": report.positions.as_slice(),
            "dq": report.dq.as_slice(),
            "computed": report.computed.as_slice(),
            "auxiliaries": report.auxiliaries.as_slice(),
            "sensors_lost": report.sensors_lost,
            "weights": report.weights.as_slice(),
            "enabled": report.enabled,
            "dry_run": report.dry_run,
            "suspended": report.suspended,
            "referenced": report.referenced,
            "factor": report.factor,
            "conditions": conditions(report.conditions),
            "saturated": report.saturated,
            "rate_limited": report.rate_limited,
            "travel_limited": report.travel_limited,
            "limits": report.limits.iter().map(|r| [r.value, r.rate, r.travel]).collect::<Vec<_>>(),
            "updates": report.updates,
            "missed": report.missed,
            "cost": report.cost,
            "worst_cost": report.worst_cost,
            "cost_unit": unit(report),
            "compensation": activation(report.activation),
            "upload": upload(report.upload),
            "fault": report.fault.map(|fault| fault.to_string()),
            "health": health.map(|h| json!({
                "healthy": h.healthy,
                "restart": h.restart.to_string(),
                "frames": h.frames,
                "repeated": h.repeated,
                "skipped": h.skipped,
                "damaged": h.damaged,
                "faults": h.faults,
                "overruns": h.overruns,
                "garbled": h.garbled,
            })),
        })
    }
}

impl WatchedSource for PinValues {
    fn sample(&mut self) -> Result<(), BadInput> {
        *self = Self::read()?;
        Ok(())
    }
    fn table(&self) -> String {
        self.table()
    }
    fn header(&self) -> String {
        self.header()
    }
    fn line(&self, seconds: f64) -> String {
        self.line(seconds)
    }
    fn object(&self, seconds: f64) -> serde_json::Value {
        let mut object = self.object();
        object["time"] = json!(seconds);
        object
    }
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let mut source: Box<dyn WatchedSource> = match arguments.connection.port() {
        Some(port) => Box::new(WatchedBoard::connect(port)?),
        None => Box::new(PinValues::read()?),
    };
    let mut drawn = DrawnTable::new();
    let start = Instant::now();
    let interval = Duration::from_millis(arguments.interval);
    let mut columns = String::new();
    let (mut due, mut sample) = (start, 0);
    while arguments.count.is_none_or(|count| sample < count) {
        if sample > 0 {
            due = (due + interval).max(Instant::now());
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
        }
        source.sample()?;
        let seconds = start.elapsed().as_secs_f64();
        let mut text = String::new();
        if arguments.json {
            text = format!("{}\n", source.object(seconds));
        } else if arguments.csv {
            let head = source.header();
            if head != columns {
                text.clone_from(&head);
                columns = head;
            }
            text += &source.line(seconds);
        } else {
            text = drawn.replaced_by(&source.table());
        }
        if !output::stream(&text)? {
            break;
        }
        sample += 1;
    }
    Ok(Outcome::Done)
}

/// The table on the screen, which the next one replaces.
struct DrawnTable {
    is_terminal: bool,
    lines: usize,
}

impl DrawnTable {
    fn new() -> Self {
        Self {
            is_terminal: std::io::stdout().is_terminal(),
            lines: 0,
        }
    }

    fn replaced_by(&mut self, table: &str) -> String {
        let before = std::mem::replace(&mut self.lines, table.lines().count());
        match self.is_terminal && before > 0 {
            // Move up and clear to the end of the screen.
            true => format!("\x1b[{before}A\x1b[J{table}"),
            false => table.to_owned(),
        }
    }
}

/// Names of the active conditions.
pub(super) fn conditions(bits: u16) -> Vec<&'static str> {
    Conditions(bits).names().collect()
}

/// The limits that currently limit an axis.
fn limits(report: &Report, axis: usize) -> String {
    let acts = [
        (report.saturated, "value bound"),
        (report.rate_limited, "rate bound"),
        (report.travel_limited, "travel"),
    ];
    let names: Vec<&str> = acts
        .into_iter()
        .filter(|(mask, _)| (mask >> axis) & 1 != 0)
        .map(|(_, name)| name)
        .collect();
    names.join(", ")
}

fn unit(report: &Report) -> &'static str {
    match report.cost_unit {
        CostUnit::None => "",
        CostUnit::Cycles => "cycles",
        CostUnit::Instructions => "instructions",
    }
}

pub(super) fn activation(activation: Activation) -> String {
    match activation {
        Activation::Active(None) => "none in use".to_owned(),
        Activation::Active(Some(slot)) => format!("slot {slot} in use"),
        Activation::Fading(slot) => format!("fading over to slot {slot}"),
        Activation::Ramping(slot) => format!("to zero, then slot {slot}"),
    }
}

fn upload(upload: Upload) -> Option<String> {
    match upload {
        Upload::None => None,
        Upload::Ramping => Some("waits for the corrections to be zero".to_owned()),
        Upload::Erasing { done, blocks } => Some(format!("erasing, {done} of {blocks} blocks")),
        Upload::Receiving { next, length } => Some(format!("{next} of {length} bytes")),
        Upload::Paused { next, length } => Some(format!(
            "paused at {next} of {length} bytes: the machine is moving"
        )),
        Upload::Committed { slot, sequence } => Some(format!("slot {slot}, number {sequence}")),
    }
}

fn slot(state: SlotState) -> String {
    match state {
        SlotState::Blank => "blank".to_owned(),
        SlotState::Erasing => "being erased".to_owned(),
        SlotState::Uploading {
            received, length, ..
        } => format!("{received} of {length} bytes of an upload"),
        SlotState::Valid {
            sequence, length, ..
        } => format!("number {sequence}, {length} bytes"),
        SlotState::Damaged(damage) => format!("damaged: {damage}"),
    }
}

/// Which compensation is in use, and whether it corrects.
fn corrections(report: &Report) -> String {
    let mut text = format!("compensation {}\n", activation(report.activation));
    let wanted = match (report.enabled, report.dry_run) {
        (false, _) => "disabled",
        (true, false) => "enabled",
        (true, true) => "dry run",
    };
    let holds = conditions(report.conditions).join(", ");
    text += &format!(
        "corrections  {wanted}, factor {:.3}; {holds}\n",
        report.factor
    );
    if report.suspended {
        text += "servo        paused for an upload\n";
    }
    if let Some(state) = upload(report.upload) {
        text += &format!("upload       {state}\n");
    }
    if let Some(fault) = report.fault {
        text += &format!("fault        {fault}\n");
    }
    text + &format!(
        "updates      {}, {} without a command; worst {} {}\n",
        report.updates,
        report.missed,
        report.worst_cost,
        unit(report)
    )
}

/// A line for each axis.
fn axes(letters: &str, report: &Report) -> String {
    let mut text = format!(
        "axis {:>14} {:>12} {:>12}  {:>26}\n",
        "position", "correction", "computed", "value/rate/travel limited"
    );
    for (k, letter) in letters.chars().enumerate().take(MOST_AXES) {
        let at = |values: &[f32]| values.get(k).copied().unwrap_or_default();
        let counted = report.limits.get(k).copied().unwrap_or_default();
        let homed = match (report.referenced >> k) & 1 {
            0 => "  not referenced",
            _ => "",
        };
        text += &format!(
            "{letter:<4} {:>14.4} {:>12.5} {:>12.5}  {:>26}  {}{homed}\n",
            at(&report.positions),
            at(&report.dq),
            at(&report.computed),
            format!("{}/{}/{}", counted.value, counted.rate, counted.travel),
            limits(report, k),
        );
    }
    text
}

/// Counts of frames from the motion controller, and the reason for the last restart.
fn well(health: &Health) -> String {
    let Health {
        healthy,
        restart,
        frames,
        repeated,
        skipped,
        damaged,
        faults,
        overruns,
        garbled,
    } = health;
    let pin = if *healthy { "no fault" } else { "fault" };
    format!(
        "frames       {frames}, {repeated} periods without, {skipped} skipped, {damaged} damaged; \
         {faults} faults\n\
         periods      {overruns} overrun; fault pin: {pin}\n\
         line         {garbled} garbled frames of the host\n\
         started      {restart}\n"
    )
}

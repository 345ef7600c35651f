//! The pins of the HAL component `trueaxis`, read and set with `halcmd`.

use super::bad_input::BadInput;
use serde_json::{Value, json};
use std::process::Command;

/// Values of the pin `state`, in words: `man trueaxis`.
const STATES: [&str; 8] = [
    "active",
    "enable is off",
    "dry run",
    "joint {} is not homed",
    "joint {} is homing",
    "a fault",
    "fading in",
    "no file has been read yet",
];

/// Values of the pin `fault-code`.
const FAULTS: [&str; 13] = [
    "none",
    "the file cannot be read",
    "the file is damaged, of another format or too large",
    "the axes of the file differ from axes=",
    "the file needs more temperature pins",
    "the file was not accepted while corrections are active: disable, reload, enable",
    "pos-in of a joint is not connected",
    "tool-length is not connected",
    "a temperature is not connected",
    "a weight is outside its limits",
    "the period of the thread is not from 1 µs to 10 ms",
    "a position is out of reach, or a temperature is implausible",
    "a bug in the library: please report it",
];

/// A pin.
struct Pin {
    name: String,
    value: String,
    signal: Option<String>,
}

/// All pins at one time.
pub struct PinValues(Vec<Pin>);

impl PinValues {
    /// Reads them.
    pub fn read() -> Result<Self, BadInput> {
        let shown = halcmd(&["-s", "show", "pin", "trueaxis."])?;
        let pins = Self(shown.lines().filter_map(pin).collect());
        if pins.text("state").is_some() {
            return Ok(pins);
        }
        Err(BadInput::new(
            "HAL: the component trueaxis is not loaded",
            "start LinuxCNC with HALFILE = trueaxis.hal below [HAL] of its INI file",
        ))
    }

    fn text(&self, name: &str) -> Option<&str> {
        let pin = self.0.iter().find(|pin| pin.name == name)?;
        Some(&pin.value)
    }

    fn number(&self, name: &str) -> f64 {
        let text = self.text(name).unwrap_or("nan");
        text.parse().unwrap_or(f64::NAN)
    }

    pub fn index(&self, name: &str) -> usize {
        let text = self.text(name).unwrap_or("");
        text.parse().unwrap_or(usize::MAX)
    }

    /// Whether a switch is on.
    pub fn is_on(&self, name: &str) -> bool {
        self.text(name) == Some("TRUE")
    }

    /// Sets a pin, or the signal on it.
    pub fn set(&self, name: &str, value: &str) -> Result<(), BadInput> {
        let pin = self.0.iter().find(|pin| pin.name == name);
        let pin = pin.ok_or_else(|| {
            BadInput::new(
                format!("HAL: there is no pin trueaxis.{name}"),
                "load the component with enough pins: weights= and temperatures=",
            )
        })?;
        let whole = format!("trueaxis.{name}");
        let set = match &pin.signal {
            Some(signal) => halcmd(&["sets", signal, value]),
            None => halcmd(&["setp", &whole, value]),
        };
        set.map(|_| ())
    }

    /// Why the corrections are in, or are not.
    pub fn reason(&self) -> String {
        let state = self.index("state");
        let words = STATES.get(state).copied().unwrap_or("unknown state");
        let words = words.replace("{}", self.text("waiting-for").unwrap_or("?"));
        match (state, self.fault()) {
            (5, Some(fault)) => format!("a fault: {fault}"),
            _ => words,
        }
    }

    /// The fault, if any.
    pub fn fault(&self) -> Option<&'static str> {
        self.fault_of("fault-code")
    }

    /// Why the last file was not accepted, if it was not.
    pub fn load_fault(&self) -> Option<&'static str> {
        self.fault_of("load-fault")
    }

    fn fault_of(&self, pin: &str) -> Option<&'static str> {
        let code = self.index(pin);
        let fault = FAULTS.get(code).copied().unwrap_or("unknown");
        (code != 0).then_some(fault)
    }

    fn joints(&self) -> usize {
        let is = |j: &usize| self.text(&format!("joint.{j}.pos-in")).is_some();
        (0..).take_while(is).count()
    }

    fn of_joints(&self, pin: &str) -> Vec<f64> {
        let joints = 0..self.joints();
        joints
            .map(|j| self.number(&format!("joint.{j}.{pin}")))
            .collect()
    }

    /// Inputs other than positions, with their values.
    fn inputs(&self) -> impl Iterator<Item = &Pin> {
        self.0.iter().filter(|pin| {
            let of = |start| pin.name.starts_with(start);
            of("tool-length") || of("temperature-") || of("weight-")
        })
    }

    /// The state, by name.
    pub fn lines(&self) -> Vec<(String, String)> {
        let mut lines = vec![
            (
                "corrections".to_owned(),
                format!("{}, factor {:.3}", self.reason(), self.number("factor")),
            ),
            (
                "file".to_owned(),
                match self.index("checksum") {
                    0 => "none".to_owned(),
                    sum => format!("{sum:08x}, number {}", self.index("loads")),
                },
            ),
        ];
        for pin in self.inputs() {
            lines.push((pin.name.clone(), pin.value.clone()));
        }
        if let Some(fault) = self.fault() {
            lines.push(("fault".to_owned(), fault.to_owned()));
        }
        lines
    }

    /// The text output of `monitor`.
    pub fn table(&self) -> String {
        let mut text = String::from("HAL: trueaxis\n");
        for (name, value) in self.lines() {
            text += &format!("{name:<13}{value}\n");
        }
        if self.is_on("saturated") {
            text += "limited      a correction is limited to the largest of its axis\n";
        }
        if self.is_on("beyond-range") {
            text += "beyond range a temperature is outside of the range that was measured\n";
        }
        text += &format!(
            "{:<5} {:>14} {:>12} {:>12}  {:>8}\n",
            "joint", "position", "correction", "computed", "of bound"
        );
        for j in 0..self.joints() {
            let of = |pin: &str| self.number(&format!("joint.{j}.{pin}"));
            let (position, correction) = (of("pos-in"), of("correction"));
            let (computed, used) = (of("computed"), of("bound-used"));
            let homed = match self.is_on(&format!("joint.{j}.homed")) {
                true => "",
                false => "  not homed",
            };
            text += &format!(
                "{j:<5} {position:>14.4} {correction:>12.5} {computed:>12.5}  {:>6.0} % |{}|{homed}\n",
                100.0 * used,
                bar(used)
            );
        }
        text
    }

    /// Columns of `--csv`.
    pub fn header(&self) -> String {
        let mut text = "time".to_owned();
        for prefix in ["", "d", "computed "] {
            for j in 0..self.joints() {
                text += &format!(",{prefix}{j}");
            }
        }
        text + ",factor,state,waiting_for,fault_code,saturated,beyond_range\n"
    }

    /// A line of `--csv`.
    pub fn line(&self, seconds: f64) -> String {
        let mut text = format!("{seconds:.3}");
        for pin in ["pos-in", "correction", "computed"] {
            for value in self.of_joints(pin) {
                text += &format!(",{value}");
            }
        }
        for pin in ["factor", "state", "waiting-for", "fault-code"] {
            text += &format!(",{}", self.text(pin).unwrap_or(""));
        }
        let [saturated, beyond] =
            ["saturated", "beyond-range"].map(|pin| u8::from(self.is_on(pin)));
        text + &format!(",{saturated},{beyond}\n")
    }

    /// The state as JSON.
    pub fn object(&self) -> Value {
        let waiting = self.text("waiting-for").and_then(|j| j.parse::<u8>().ok());
        let inputs = self.inputs().map(|pin| {
            let value: Option<f64> = pin.value.parse().ok();
            (pin.name.clone(), json!(value.filter(|v| v.is_finite())))
        });
        json!({
            "positions": self.of_joints("pos-in"),
            "corrections": self.of_joints("correction"),
            "computed": self.of_joints("computed"),
            "bound_used": self.of_joints("bound-used"),
            "enabled": self.is_on("enable"),
            "dry_run": self.is_on("dry-run"),
            "active": self.is_on("active"),
            "factor": self.number("factor"),
            "saturated": self.is_on("saturated"),
            "beyond_range": self.is_on("beyond-range"),
            "state": self.index("state"),
            "reason": self.reason(),
            "waiting_for": waiting,
            "fault": self.fault(),
            "loads": self.index("loads"),
            "checksum": self.index("checksum"),
            "inputs": inputs.collect::<serde_json::Map<String, Value>>(),
        })
    }
}

/// A fraction as a bar.
fn bar(used: f64) -> String {
    const WIDTH: usize = 20;
    let filled = (0..WIDTH)
        .filter(|k| used > (*k as f64 + 0.5) / WIDTH as f64)
        .count();
    format!("{}{}", "#".repeat(filled), " ".repeat(WIDTH - filled))
}

/// `OWNER TYPE DIRECTION VALUE NAME`, and `<== SIGNAL` or `==> SIGNAL` if it is connected.
fn pin(line: &str) -> Option<Pin> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let name = words.get(4)?.strip_prefix("trueaxis.")?;
    Some(Pin {
        name: name.to_owned(),
        value: (*words.get(3)?).to_owned(),
        signal: words.get(6).map(|signal| (*signal).to_owned()),
    })
}

fn halcmd(words: &[&str]) -> Result<String, BadInput> {
    let output = Command::new("halcmd").args(words).output().map_err(|e| {
        BadInput::new(
            format!("HAL: `halcmd` does not start: {e}"),
            "run this on the computer with LinuxCNC, or give --port for a board",
        )
    })?;
    if output.status.success() {
        return Ok(String::from_utf8_lossy(&output.stdout).into_owned());
    }
    let said = String::from_utf8_lossy(&output.stderr);
    let last = said.lines().last().unwrap_or("no message");
    Err(BadInput::new(
        format!("HAL: halcmd {}: {last}", words.join(" ")),
        "start LinuxCNC first; a pin on a signal that a switch or panel writes is set there",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_panel_says_the_same_words() {
        let panel = include_str!("../../../../firmware/linuxcnc/panel/trueaxis_panel.py");
        let list = |name: &str| -> Vec<&str> {
            let (_, list) = panel.split_once(&format!("\n{name} = [\n")).unwrap();
            let lines = list.lines().take_while(|line| *line != "]");
            let word = |line: &'static str| line.trim().strip_prefix('"')?.strip_suffix("\",");
            lines.map(|line| word(line).unwrap()).collect()
        };
        assert_eq!(list("STATES"), STATES);
        assert_eq!(list("FAULTS"), FAULTS);
    }
}

//! HAL lines that install the component in a configuration, with the files that describe the machine.

use crate::check::Finding;
use crate::configuration::Configuration;
use crate::description::{DescribedAxis, divide, entries, machine, rounded, unknown_pivot};
use crate::formats::hal::Hal;
use crate::imported::{self, AxisMotion, Import};
use crate::install::PANEL;
use std::fmt::Write;

/// The generated files.
#[derive(Clone, Debug, PartialEq)]
pub struct SetupFiles {
    /// `trueaxis.hal`.
    pub hal: String,
    /// `machine.toml`.
    pub machine: String,
    /// `errors.toml`, if the INI file compensates anything.
    pub errors: Option<String>,
}

/// What the user says about the machine.
#[derive(Clone, Copy, Debug)]
pub struct MachineFacts<'a> {
    /// Name of the machine.
    pub name: &'a str,
    /// Path of the compensation in HAL.
    pub blob: &'a str,
    /// Letters of the linear axes that move the table, if known; the others move the spindle.
    pub table: Option<&'a str>,
    /// Corrections come in whenever the axes are homed; otherwise the operator switches them on.
    pub enabled: bool,
    /// From the pivot of a head to the nose of its spindle (mm), if known.
    pub pivot: Option<f64>,
    /// Pins with the temperatures (°C) of sensors, in the order of the compensation.
    pub temperatures: &'a [String],
}

/// The lines, the description and the imported errors. `imports` is what the INI file compensates, `findings` what speaks
/// against a compensation.
#[must_use]
pub fn setup(
    configuration: &Configuration,
    known: MachineFacts<'_>,
    imports: &[Import],
    findings: &[Finding],
) -> SetupFiles {
    let MachineFacts { name, table, .. } = known;
    let (mut entries, mut tip) = entries(configuration);
    if let Some(pivot) = known.pivot {
        tip = rounded(-pivot);
    }
    let unsure = unknown_pivot(configuration).filter(|_| known.pivot.is_none());
    if let Some(table) = table {
        divide(&mut entries, table);
    }
    let motions = entries.iter().map(|entry| AxisMotion {
        letter: entry.joint.letter,
        reversed: entry.reversed,
        endless: configuration.is_endless(entry.joint),
    });
    let motions: Vec<AxisMotion> = motions.collect();
    SetupFiles {
        hal: hal(configuration, known, &entries, findings),
        machine: machine(configuration, name, &entries, tip, unsure),
        errors: imported::errors(configuration, name, &motions, imports),
    }
}

fn hal(
    configuration: &Configuration,
    known: MachineFacts<'_>,
    entries: &[DescribedAxis],
    findings: &[Finding],
) -> String {
    let blob = known.blob;
    let hal = &configuration.hal;
    let letters = configuration.module.letters.chars();
    let is_axis = |letter: char| entries.iter().any(|e| e.joint.letter == letter);
    let letters = letters.map(|l| if is_axis(l) { l } else { '-' });
    let letters: String = letters.collect();
    let mut text = introduction(findings);
    let _ = writeln!(
        text,
        "loadrt trueaxis file={blob} axes={letters} units={}{}",
        configuration.unit_word(),
        match known.temperatures.len() {
            0 => String::new(),
            count => format!(" temperatures={count}"),
        }
    );
    text += &functions(configuration);
    let joints = letters
        .chars()
        .enumerate()
        .filter(|(_, letter)| *letter != '-');
    for (number, letter) in joints {
        text += &joint(configuration, number, letter);
    }
    text += "\n# Read only if the compensation depends on it: the length along the tool axis.\n";
    let pin = "motion.tooloffset.z";
    text += &net(hal, pin, "trueaxis.tool-length", "tool-length");
    for (number, pin) in known.temperatures.iter().enumerate() {
        let own = format!("temperature-{number}");
        text += &net(hal, pin, &format!("trueaxis.{own}"), &own);
    }
    text + switching(known.enabled)
}

/// What the file is for, how it gets into the configuration, and what else is to be changed.
fn introduction(findings: &[Finding]) -> String {
    let mut text = String::from(
        "# Brings the component trueaxis into this machine. In the INI file, behind the other HAL files:\n#\n\
         #   [HAL]\n#   HALFILE = trueaxis.hal\n#\n\
         # It changes what those have connected; without that line all is as before. For the panel:\n#\n\
         #   [DISPLAY]\n",
    );
    for line in PANEL {
        let _ = writeln!(text, "#   {line}");
    }
    if !findings.is_empty() {
        text += "#\n# Before the corrections are switched on, write\n";
    }
    for Finding {
        file, line, write, ..
    } in findings
    {
        let _ = writeln!(text, "#   {file}, line {line}: {write}");
    }
    text
}

/// Who switches the corrections on.
fn switching(enabled: bool) -> &'static str {
    match enabled {
        false => {
            "\n# The operator switches the corrections on: from a panel, or with `trueaxis control --hal enable`.\n\
             # They come in slowly, once the axes are homed.\nsetp trueaxis.enable 0\n"
        }
        true => {
            "\n# The corrections come in slowly whenever the axes are homed; the panel and `trueaxis control --hal disable`\n\
             # switch them off.\nsetp trueaxis.enable 1\n"
        }
    }
}

/// Connects a pin of the component with another one, on the signal that this has already or on a signal `trueaxis-…`.
fn net(hal: &Hal, pin: &str, ours: &str, own: &str) -> String {
    match hal.signal(pin) {
        Some(signal) => format!("net {signal} => {ours}\n"),
        None => format!("net trueaxis-{own} {pin} => {ours}\n"),
    }
}

/// Adds the two functions, around the motion controller.
fn functions(configuration: &Configuration) -> String {
    let is = |name: &str| {
        let threads = configuration.hal.threads.iter();
        threads
            .map(|(thread, functions)| (thread, functions.iter().position(|(f, _)| f == name)))
            .find_map(|(thread, at)| Some((thread.clone(), at?)))
    };
    let Some((thread, controller)) = is("motion-controller") else {
        return "# CHECK: trueaxis.read must come before motion-controller, trueaxis.write behind it and before the drives.\n\
                addf trueaxis.read servo-thread 1\naddf trueaxis.write servo-thread -1\n"
            .to_owned();
    };
    let first = match is("motion-command-handler") {
        Some((of, handler)) if of == thread => handler.min(controller),
        _ => controller,
    };
    // Positions count from 1; the second one counts trueaxis.read before it.
    format!(
        "addf trueaxis.read  {thread} {}\naddf trueaxis.write {thread} {}\n",
        first + 1,
        controller + 3
    )
}

fn joint(configuration: &Configuration, number: usize, letter: char) -> String {
    let hal = &configuration.hal;
    let mut text = format!("\n# Joint {number}, axis {letter}\n");
    let ours = |pin: &str| format!("trueaxis.joint.{number}.{pin}");
    let theirs = |pin: &str| format!("joint.{number}.{pin}");
    for (from, to) in [
        ("pos-cmd", "pos-in"),
        ("homed", "homed"),
        ("homing", "homing"),
    ] {
        text += &net(hal, &theirs(from), &ours(to), &format!("{number}-{from}"));
    }
    text + &motor(hal, number)
}

/// Brings the component between the motion controller and the drive of a joint.
fn motor(hal: &Hal, number: usize) -> String {
    let ours = |pin: &str| format!("trueaxis.joint.{number}.{pin}");
    let command = format!("joint.{number}.motor-pos-cmd");
    let feedback = format!("joint.{number}.motor-pos-fb");
    let mut text = String::new();
    let (drive, back) = (hal.signal(&command), hal.signal(&feedback));
    for pin in [(&command, drive), (&feedback, back)] {
        if pin.1.is_some() {
            let _ = writeln!(text, "unlinkp {}", pin.0);
        }
    }
    let _ = writeln!(
        text,
        "net trueaxis-{number}-cmd {command} => {}",
        ours("motor-cmd-in")
    );
    let _ = match drive {
        Some(signal) => writeln!(text, "net {signal} <= {}", ours("motor-cmd-out")),
        None => writeln!(
            text,
            "# CHECK: {command} was not found connected. Its drive gets the corrected command:\n# net joint-{number}-drive {} => (the drive)",
            ours("motor-cmd-out")
        ),
    };
    let _ = match back {
        Some(signal) => writeln!(text, "net {signal} => {}", ours("motor-fb-in")),
        None => writeln!(
            text,
            "# CHECK: {feedback} was not found connected. The feedback of the drive goes to:\n# net joint-{number}-feedback (the drive) => {}",
            ours("motor-fb-in")
        ),
    };
    let _ = writeln!(
        text,
        "net trueaxis-{number}-fb {} => {feedback}",
        ours("motor-fb-out")
    );
    text
}

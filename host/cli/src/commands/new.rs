//! `trueaxis new`

mod answers;
mod kinds;

use super::Outcome;
use super::bad_input::BadInput;
use super::files::{self, Text};
use super::number::positive;
use super::output;
use answers::{AnswerUnit, Answers, GivenOptions, NewAxis};
use clap::Args;
use clap::builder::PossibleValuesParser;
use kinds::KINDS;
use std::io::{IsTerminal, stderr, stdin};
use std::path::{Path, PathBuf};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;

/// Begin: write a machine file and an error file with comments
///
/// Asks at a terminal for what is not given. Files that are there are never overwritten.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis new --kind mill --travel X=0:500,Y=0:300,Z=400\n  trueaxis new my-machine --kind trunnion --travel X=500,Y=400,Z=0:300 --rotary C=0,0,-50"
)]
pub struct Arguments {
    /// Folder for machine.toml and errors.toml, made if it is missing
    #[arg(value_name = "FOLDER", default_value = ".")]
    folder: PathBuf,
    /// Kind of machine, from --list
    #[arg(long, value_parser = PossibleValuesParser::new(KINDS.map(|kind| kind.name)))]
    kind: Option<String>,
    /// Which axes carry the workpiece and which the tool, from w to t (default: that of the kind)
    #[arg(long, value_name = "wXYFZSt")]
    layout: Option<String>,
    /// Travels: a length, centred on 0 (on Z: below 0), or both ends; A, B, C in degrees (default: 120 and 360 to both
    /// sides)
    #[arg(long, value_name = "X=500,Y=0:300,…")]
    travel: Option<String>,
    /// A point through which a rotary axis turns, with all axes at 0; repeat for each axis (default: 0,0,0)
    #[arg(long, value_name = "C=x,y,z")]
    rotary: Vec<String>,
    /// Unit of lengths in the options; files have mm (default: mm)
    #[arg(long, value_enum)]
    unit: Option<AnswerUnit>,
    /// Distance from the spindle nose to the tip of the tool (default: 100 mm)
    #[arg(long, value_name = "LENGTH", value_parser = positive)]
    tool: Option<f64>,
    /// Name of the machine
    #[arg(long, default_value = "My machine")]
    name: String,
    /// Print the kinds of machines
    #[arg(long)]
    list: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    if arguments.list {
        output::print(&answers::list())?;
        return Ok(Outcome::Done);
    }
    let folder = &arguments.folder;
    let [machine, errors] = ["machine.toml", "errors.toml"].map(|name| folder.join(name));
    for path in [&machine, &errors] {
        if path.symlink_metadata().is_ok() {
            return Err(BadInput::new(
                format!(
                    "{} is there already, and is not overwritten",
                    path.display()
                ),
                "give another folder, or move the file away",
            ));
        }
    }
    let answers = arguments.answers()?;
    let tool = arguments
        .tool
        .map_or(100.0, |length| answers.unit.mm(length));
    let text = Text {
        name: machine.display().to_string(),
        text: machine_file(&arguments.name, &answers, tool),
    };
    let described = files::machine_in(&text)?;
    let empty = Text {
        name: errors.display().to_string(),
        text: error_file(&arguments.name, &answers.axes),
    };
    ErrorModel::from_toml(&empty.text, &described).map_err(|error| empty.bad(error))?;
    output::make_folder(folder, "FOLDER")?;
    let both = [(machine, text.text), (errors, empty.text)];
    output::write_all(&both)?;
    let blob = folder.join("machine.trax");
    output::print(&said(&described, [&text.name, &empty.name], &blob))?;
    Ok(Outcome::Done)
}

/// What the new files are, and what comes next.
fn said(described: &Machine, [machine, errors]: [&str; 2], blob: &Path) -> String {
    // A position away from zero, within the travel: nothing shows a sign at zero.
    let first = described.axes.first();
    let (first, at) = first.map_or(('X', 10.0), |axis| {
        let [low, high] = axis.travel.map(|end| axis.to_command(end));
        let at = if high >= 10.0 {
            10.0
        } else if low <= -10.0 {
            -10.0
        } else if high.abs() > low.abs() {
            high
        } else {
            low
        };
        (axis.letter.char(), at)
    });
    format!(
        "{machine}: {}\n{errors}: no errors yet\n\n\
         next, compare the signs with the machine:   trueaxis pose {machine} --at {first}={at}\n\
         then enter what you have measured, and:     trueaxis compile {machine} {errors} -o {}\n",
        described.topology(),
        blob.display(),
    )
}

impl Arguments {
    /// From a person at a terminal, otherwise by options alone.
    fn answers(&self) -> Result<Answers, BadInput> {
        let given = GivenOptions {
            kind: self.kind.as_deref(),
            layout: self.layout.as_deref(),
            unit: self.unit,
            travel: self.travel.as_deref(),
            rotary: &self.rotary,
        };
        match stdin().is_terminal() && stderr().is_terminal() {
            true => given.ask(&mut stdin().lock(), &mut stderr()),
            false => given.answers(),
        }
    }
}

/// A name as TOML: a string of JSON is one.
fn quoted(name: &str) -> String {
    serde_json::Value::from(name).to_string()
}

fn numbers<const N: usize>(numbers: [f64; N]) -> String {
    let numbers = numbers.map(|n| format!("{n:?}"));
    format!("[{}]", numbers.join(", "))
}

fn machine_file(name: &str, answers: &Answers, tool: f64) -> String {
    let mut text = format!(
        "# Lengths in mm, angles in degrees, every frame with all axes at 0.\nname = {}\n\
         topology = \"{}\"  # from the workpiece w to the tool t; F is the foundation, S the spindle\n",
        quoted(name),
        answers.layout
    );
    for axis in &answers.axes {
        let NewAxis { letter, range, .. } = axis;
        let branch = if axis.carries_workpiece {
            "workpiece"
        } else {
            "tool"
        };
        text += &format!("\n[[axis]]\nname = \"{letter}\"\nbranch = \"{branch}\"\n");
        if axis.is_rotary() {
            text += &format!(
                "origin_mm = {}  # a point through which it turns\n",
                numbers(axis.origin)
            );
        }
        text += &format!("range = {}\n", numbers(*range));
        if axis.carries_workpiece {
            let verb = if axis.is_rotary() { "turns" } else { "moves" };
            text += &format!(
                "reversed = true  # as in ISO 841: a positive command {verb} the workpiece the negative way. Delete this if not\n"
            );
        }
    }
    text + &format!(
        "\n[spindle]\naxis = \"z\"\n\n[tool]\ntip_mm = {}  # from the spindle nose\n",
        numbers([0.0, 0.0, -tool])
    )
}

/// An error file whose parameters are comments: the usual ones of the linear axes.
fn error_file(name: &str, axes: &[NewAxis]) -> String {
    let mut text = format!(
        "# Remove the # of what you have measured; `trueaxis explain` prints the reading that belongs to each number.\n\
         machine = {}\n\n[parameters]  # mm, rad\n",
        quoted(name)
    );
    let has = |letters: &str| letters.chars().all(|l| axes.iter().any(|a| a.letter == l));
    for letter in "XYZ".chars().filter(|letter| has(&letter.to_string())) {
        text += &format!("# E{letter}{letter}1 = -20e-6  # scale of {letter}: 20 µm per metre\n");
    }
    for (planes, parameter) in [("XY", "EC0X"), ("XZ", "EB0Z"), ("YZ", "EA0Z")] {
        if let (true, Some((a, b))) = (has(planes), planes.split_at_checked(1)) {
            text +=
                &format!("# {parameter} = 30e-6  # squareness of {a} and {b}: 30 µm per metre\n");
        }
    }
    if axes.iter().any(NewAxis::is_rotary) {
        text += "# Errors of rotary axes: see `trueaxis plan` and `trueaxis identify`.\n";
    }
    text
}

//! `trueaxis skew`

use super::files::{self, Text};
use super::number::positive;
use super::output;
use super::{Outcome, bad_input::BadInput};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis_export::skew::measured::{PLANES, lean, parameters, printer};
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::machine::Machine;

/// Find the squareness of a printer from two diagonals and a side of a printed part
///
/// AC, BD and AD are what Klipper and Marlin ask for: A is the corner with the lower values of both axes, C is opposite to
/// it, D along the first axis. Print or draw the part with every correction of the firmware switched off. The machine file
/// is written if there is none; in the error file the squareness is replaced and everything else stays.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis skew --xy 141.32,141.51,100 --travel 235,235,250\n  trueaxis compile machine.toml errors.toml -o printer.trax"
)]
pub struct Arguments {
    /// Diagonals and side in the plane of X and Y (mm)
    #[arg(long, value_name = "AC,BD,AD", value_delimiter = ',', value_parser = positive)]
    xy: Vec<f64>,
    /// Diagonals and side in the plane of X and Z (mm), of a part that was printed upright
    #[arg(long, value_name = "AC,BD,AD", value_delimiter = ',', value_parser = positive)]
    xz: Vec<f64>,
    /// Diagonals and side in the plane of Y and Z (mm), of a part that was printed upright
    #[arg(long, value_name = "AC,BD,AD", value_delimiter = ',', value_parser = positive)]
    yz: Vec<f64>,
    /// Machine description: read, or written if it is not there
    #[arg(long, value_name = "FILE", default_value = "machine.toml")]
    machine: PathBuf,
    /// Error parameters: written, or merged with what is there
    #[arg(long, value_name = "FILE", default_value = "errors.toml")]
    errors: PathBuf,
    /// Travel of X, Y and Z (mm) for a new machine file, from 0 or as MIN:MAX
    #[arg(long, value_name = "X,Y,Z", value_parser = travels, allow_hyphen_values = true)]
    travel: Option<[[f64; 2]; 3]>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

fn travels(text: &str) -> Result<[[f64; 2]; 3], String> {
    let range = |text: &str| {
        let (low, high) = text.split_once(':').unwrap_or(("0", text));
        let [low, high] = [low, high].map(|n| n.trim().parse::<f64>().ok());
        low.zip(high)
            .map(|(low, high)| [low, high])
            .filter(|[low, high]| low < high && low.abs().max(high.abs()) <= 1e5)
    };
    let ranges: Option<Vec<[f64; 2]>> = text.split(',').map(range).collect();
    ranges
        .and_then(|ranges| ranges.try_into().ok())
        .ok_or_else(|| {
            "write three lengths or ranges, like 235,235,250 or -3:250,-4:210,0:210".to_owned()
        })
}

#[derive(Serialize)]
struct SkewPlane {
    plane: &'static str,
    /// mm per mm of the second axis, towards the first.
    lean: f64,
    /// Parameters (rad).
    parameters: Vec<(&'static str, f64)>,
}

#[derive(Serialize)]
struct SkewAnswer<'a> {
    machine: &'a Path,
    machine_written: bool,
    errors: &'a Path,
    planes: &'a [SkewPlane],
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let (machine_path, errors_path) = (&arguments.machine, &arguments.errors);
    let given = [&arguments.xy, &arguments.xz, &arguments.yz];
    if given.iter().all(|lengths| lengths.is_empty()) {
        return Err(BadInput::new(
            "no lengths",
            "give two diagonals and a side in mm: --xy AC,BD,AD, and --xz, --yz for upright parts",
        ));
    }
    output::prepare(errors_path, &[machine_path])?;
    let new = arguments.new_machine()?;
    let machine = match &new {
        None => files::read_machine(machine_path)?,
        Some(text) => Machine::from_toml(&text.text).map_err(|error| text.bad(error))?,
    };
    let measured = (0..given.len()).filter(|number| !given[*number].is_empty());
    let planes: Vec<SkewPlane> = measured
        .map(|number| plane(&machine, number, given[number]))
        .collect::<Result<_, _>>()?;
    let merged = merged(errors_path, &machine, &planes)?;
    let mut written = vec![(errors_path.clone(), merged)];
    if let Some(text) = &new {
        output::prepare(machine_path, &[])?;
        written.push((machine_path.clone(), text.text.clone()));
    }
    output::write_all(&written)?;
    let answer = SkewAnswer {
        machine: machine_path,
        machine_written: new.is_some(),
        errors: errors_path,
        planes: &planes,
    };
    output::print_answer(arguments.json, &answer, || {
        screen(arguments, new.is_some(), &planes)
    })?;
    Ok(Outcome::Done)
}

impl Arguments {
    /// The description of a printer, if there is none yet.
    fn new_machine(&self) -> Result<Option<Text>, BadInput> {
        let name = self.machine.display().to_string();
        match (self.machine.exists(), self.travel) {
            (true, None) => Ok(None),
            (true, Some(_)) => Err(BadInput::new(
                format!("--travel: {name} is there already"),
                "leave --travel out, or give --machine another name",
            )),
            (false, None) => Err(BadInput::new(
                format!("{name}: there is no such file"),
                "give --travel X,Y,Z in mm, and it is written, or --machine the file of the machine",
            )),
            (false, Some(travels)) => Ok(Some(Text {
                name,
                text: printer(travels),
            })),
        }
    }
}

/// What the lengths in a plane say.
fn plane(machine: &Machine, number: usize, lengths: &[f64]) -> Result<SkewPlane, BadInput> {
    let name = PLANES[number].0;
    let wrong = |cause: String, remedy: &str| BadInput::new(format!("--{name}: {cause}"), remedy);
    let lengths = <[f64; 3]>::try_from(lengths).map_err(|_| {
        wrong(
            "takes three lengths".to_owned(),
            "give both diagonals and a side in mm, like 141.32,141.51,100",
        )
    })?;
    let lean = lean(lengths).map_err(|error| {
        wrong(
            error.to_string(),
            "give AC, BD and AD in this order: the diagonal from corner A, the other one, the side from A",
        )
    })?;
    let parameters = parameters(machine, number, lean).map_err(|error| {
        wrong(
            error.to_string(),
            "give the machine file of a printer or router with the axes X, Y and Z",
        )
    })?;
    Ok(SkewPlane {
        plane: name,
        lean,
        parameters: parameters
            .map(|(name, value)| (name, rounded(value)))
            .to_vec(),
    })
}

/// The text output.
fn screen(arguments: &Arguments, is_new: bool, planes: &[SkewPlane]) -> String {
    let mut screen = String::new();
    for plane in planes {
        let [first, second] = [0, 1].map(|k| plane.plane[k..=k].to_uppercase());
        let way = match plane.lean < 0.0 {
            true => "away from",
            false => "towards",
        };
        screen += &format!(
            "{second} leans by {:.3} mm per 100 mm {way} {first}\n",
            plane.lean.abs() * 100.0
        );
    }
    if is_new {
        screen += &format!("{}: a new machine\n", arguments.machine.display());
    }
    let values = planes.iter().flat_map(|plane| &plane.parameters);
    let values = values.filter(|(_, value)| *value != 0.0);
    let values: Vec<String> = values
        .map(|(name, value)| format!("{name} {:.1} µrad", value * 1e6))
        .collect();
    screen + &format!("{}: {}\n", arguments.errors.display(), values.join(", "))
}

/// The error file with the parameters that were measured; everything else in it stays as it is.
fn merged(path: &Path, machine: &Machine, planes: &[SkewPlane]) -> Result<String, BadInput> {
    let all = || planes.iter().flat_map(|plane| &plane.parameters);
    let mut text = match path.exists() {
        true => {
            not_correlated(path, machine, all())?;
            Text::read(path)?.text
        }
        false => format!(
            "# Squareness, from `trueaxis skew`.\nmachine = {}\n",
            toml::Value::from(machine.name.as_str())
        ),
    };
    for (name, value) in all() {
        for section in ["[standard_uncertainty]", "[unseen]"] {
            text = without(&text, section, name);
        }
        text = with(&text, name, *value);
    }
    // What is written must say what was measured, and nothing else than before.
    let again = ErrorModel::from_toml(&text, machine);
    let holds = |(name, value): &(&str, f64)| {
        let (Some(parameter), Ok(again)) = (Parameter::parse(name), &again) else {
            return false;
        };
        let mut of_before = [&again.standard_uncertainty, &again.unseen].into_iter();
        again.parameters.get(&parameter).copied().unwrap_or(0.0) == *value
            && of_before.all(|entries| !entries.contains_key(&parameter))
    };
    match all().all(holds) {
        true => Ok(text),
        false => Err(BadInput::new(
            format!(
                "{}: the squareness cannot be replaced in this file",
                path.display()
            ),
            "take its squareness out of the file, or give --errors another name",
        )),
    }
}

/// Refuses an error file whose covariances have one of the parameters.
fn not_correlated<'p>(
    path: &Path,
    machine: &Machine,
    mut all: impl Iterator<Item = &'p (&'p str, f64)>,
) -> Result<(), BadInput> {
    let before = files::read_errors(path, machine)?;
    let correlated = before.correlated.unwrap_or_default().parameters;
    match all.find(|(name, _)| Parameter::parse(name).is_some_and(|p| correlated.contains(&p))) {
        None => Ok(()),
        Some((name, _)) => Err(BadInput::new(
            format!(
                "{}: its covariance file has the uncertainty of {name} as it was measured before",
                path.display()
            ),
            "take `covariance` out of [uncertainty], or give --errors another name",
        )),
    }
}

/// As it is written: to 1e-10 rad.
fn rounded(value: f64) -> f64 {
    (value * 1e10).round() / 1e10 + 0.0
}

/// The text with a parameter in its section.
fn with(text: &str, name: &str, value: f64) -> String {
    let line = format!("{name} = {value:?}  # rad, measured diagonals");
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let Some((section, place)) = place(&lines, "[parameters]", name) else {
        if value == 0.0 {
            return text.to_owned();
        }
        return format!("{}\n\n[parameters]\n{line}\n", text.trim_end());
    };
    match place {
        Some(at) => lines[at] = line,
        // Zero is what is not there.
        None if value == 0.0 => {}
        None => lines.insert(section + 1, line),
    }
    lines.join("\n") + "\n"
}

/// The text without what a section says of a parameter.
fn without(text: &str, section: &str, name: &str) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let Some((_, Some(at))) = place(&lines, section, name) else {
        return text.to_owned();
    };
    lines.remove(at);
    lines.join("\n") + "\n"
}

/// The line of a section, and the line in it that gives a parameter.
fn place(lines: &[String], section: &str, name: &str) -> Option<(usize, Option<usize>)> {
    let header = |line: &String| line.trim_start().starts_with(section);
    let section = lines.iter().position(header)?;
    let of_section = lines[section + 1..]
        .iter()
        .take_while(|line| !line.trim_start().starts_with('['));
    let is_it = |line: &String| {
        let rest = line.trim_start().strip_prefix(name);
        rest.is_some_and(|rest| rest.trim_start().starts_with('='))
    };
    let at = of_section.map(is_it).position(|is_it| is_it);
    Some((section, at.map(|at| section + 1 + at)))
}

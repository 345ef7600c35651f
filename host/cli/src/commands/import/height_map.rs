//! `trueaxis import klipper` and `reprapfirmware`

use crate::commands::files::Text;
use crate::commands::number::{finite, two};
use crate::commands::position_argument::position;
use crate::commands::{Outcome, bad_input::BadInput, files, output};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis_export::height_map::HeightMap;
use trueaxis_export::klipper::{bed_mesh, kinematics, probe, twist};
use trueaxis_export::reprapfirmware;
use trueaxis_identify::formats::observations;
use trueaxis_model::machine::{Machine, PerAxis};

#[derive(Args)]
pub struct Arguments {
    /// The file of the firmware
    #[arg(value_name = "FILE")]
    map: PathBuf,
    /// Machine description
    #[arg(long, value_name = "machine.toml")]
    machine: PathBuf,
    /// Where to write the observations
    #[arg(short, long, value_name = "OBSERVATIONS.csv")]
    output: PathBuf,
    /// Where the machine file has the position that the firmware counts as zero, of Z and any other axis
    #[arg(long, value_name = "Z=0,…")]
    zero: Option<String>,
    /// Where the probe is beside the nozzle: x_offset and y_offset of Klipper (default: those in FILE), X and Y of G31 in
    /// RepRapFirmware. Without, the nozzle counts as the probe
    #[arg(long, value_name = "X,Y", value_delimiter = ',', allow_hyphen_values = true, value_parser = finite)]
    probe: Vec<f64>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

/// `--probe`, or what `printer.cfg` says of its probe.
pub fn probe_offset(text: &Text, given: &[f64]) -> Result<Option<[f64; 2]>, BadInput> {
    match given_offset(given)? {
        None => probe::offset(&text.text).map_err(|error| text.bad(error)),
        given => Ok(given),
    }
}

fn given_offset(given: &[f64]) -> Result<Option<[f64; 2]>, BadInput> {
    match given {
        [] => Ok(None),
        given => two(given, "--probe", "mm").map(Some),
    }
}

/// With the name of a profile.
#[derive(Args)]
pub struct OfProfile {
    #[command(flatten)]
    map: Arguments,
    /// Name of the profile, if there are several
    #[arg(long, value_name = "NAME")]
    profile: Option<String>,
}

#[derive(Serialize)]
struct HeightMapAnswer<'a> {
    file: &'a Path,
    points: usize,
    /// Lowest and highest value (mm).
    lowest_mm: f64,
    highest_mm: f64,
    /// Where the probe is beside the nozzle.
    #[serde(skip_serializing_if = "Option::is_none")]
    probe_mm: Option<[f64; 2]>,
}

/// What probed a map.
struct MapProbe {
    /// Where it is beside the nozzle (mm), if that is stated.
    offset: Option<[f64; 2]>,
    /// Along which of X and Y its readings were corrected to those of the nozzle.
    corrected: [bool; 2],
}

pub fn klipper(arguments: &OfProfile) -> Result<Outcome, BadInput> {
    let text = Text::read(&arguments.map.map)?;
    kinematics::check(&text.text).map_err(|error| text.bad(error))?;
    let map = bed_mesh::read(&text.text, arguments.profile.as_deref());
    let map = map.map_err(|error| text.bad(error))?;
    let probe = MapProbe {
        offset: probe_offset(&text, &arguments.map.probe)?,
        corrected: twist::corrects(&text.text).map_err(|error| text.bad(error))?,
    };
    run(&arguments.map, &map, &probe)
}

pub fn reprapfirmware(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let text = Text::read(&arguments.map)?;
    let map = reprapfirmware::read(&text.text).map_err(|error| text.bad(error))?;
    let probe = MapProbe {
        offset: given_offset(&arguments.probe)?,
        corrected: [false; 2],
    };
    run(arguments, &map, &probe)
}

/// The axes X, Y and Z of the machine.
fn axes_of(arguments: &Arguments, machine: &Machine) -> Result<[usize; 3], BadInput> {
    let index = |letter: char| {
        machine.index(letter).ok_or_else(|| {
            BadInput::new(
                format!(
                    "{}: the map is over X and Y, and the machine has no axis {letter}",
                    arguments.map.display()
                ),
                "give the machine file of this printer",
            )
        })
    };
    Ok([index('X')?, index('Y')?, index('Z')?])
}

/// The firmwares write positions (mm) to as much.
const POSITIONS: f64 = 0.01;

/// Refuses a map that the machine cannot have probed, and a zero of Z where it has no travel.
fn within_travel(
    arguments: &Arguments,
    machine: &Machine,
    axes: [usize; 3],
    touches: &[(PerAxis, f64)],
) -> Result<(), BadInput> {
    for axis in axes {
        let stood = touches.iter().map(|(at, _)| at[axis]);
        let from = stood.clone().fold(f64::INFINITY, f64::min);
        let to = stood.fold(f64::NEG_INFINITY, f64::max);
        let axis = &machine.axes[axis];
        let [low, high] = axis.travel;
        if from < low - POSITIONS || to > high + POSITIONS {
            let stood = match from == to {
                true => format!("{from:.2}"),
                false => format!("{from:.2} to {to:.2}"),
            };
            return Err(BadInput::new(
                format!(
                    "{}: {} stood at {stood} mm, and travels from {low} to {high} mm",
                    arguments.map.display(),
                    axis.letter
                ),
                "give the machine file of this printer, the place of its probe, and with --zero where it has the firmware's zero",
            ));
        }
    }
    Ok(())
}

fn run(arguments: &Arguments, map: &HeightMap, probe: &MapProbe) -> Result<Outcome, BadInput> {
    let Arguments { output, .. } = arguments;
    output::prepare(output, &[&arguments.map, &arguments.machine])?;
    let machine = files::read_machine(&arguments.machine)?;
    let axes = axes_of(arguments, &machine)?;
    let zero = zero(arguments, &machine)?;
    let offset = probe.offset.unwrap_or_default();
    let is_corrected = probe.corrected.contains(&true);
    let mut beside = PerAxis::default();
    if !is_corrected {
        (beside[axes[0]], beside[axes[1]]) = (offset[0], offset[1]);
    }
    let touches = map.touches().into_iter().map(|[x, y, height]| {
        let mut at = zero;
        for (k, place) in [x, y].into_iter().enumerate() {
            let beside = if probe.corrected[k] { 0.0 } else { offset[k] };
            at[axes[k]] += place - beside;
        }
        (at, height)
    });
    let touches: Vec<_> = touches.collect();
    if touches.is_empty() {
        return Err(BadInput::new(
            format!(
                "{}: no point of the map was probed",
                arguments.map.display()
            ),
            "probe the bed again, and store the map",
        ));
    }
    within_travel(arguments, &machine, axes, &touches)?;
    let heights = || touches.iter().map(|(_, height)| *height);
    let name = output.file_stem().unwrap_or_default().to_string_lossy();
    let found = observations::of_surface(&name, &machine, axes[2], &beside, &touches);
    output::write(output, observations::write(&found, &machine).as_bytes())?;
    let answer = HeightMapAnswer {
        file: output,
        points: touches.len(),
        lowest_mm: heights().fold(f64::INFINITY, f64::min),
        highest_mm: heights().fold(f64::NEG_INFINITY, f64::max),
        probe_mm: probe.offset,
    };
    let left_out = map.probed.len() - touches.len();
    output::print_answer(arguments.json, &answer, || said(&answer, probe, left_out))?;
    Ok(Outcome::Done)
}

/// The text output.
fn said(answer: &HeightMapAnswer<'_>, probe: &MapProbe, left_out: usize) -> String {
    let left_out = match left_out {
        0 => String::new(),
        count => format!("; left out, as they were not probed: {count}"),
    };
    let beside = match (probe.offset, probe.corrected) {
        (None, _) => "no probe is given (--probe X,Y): the nozzle counts as the probe\n".to_owned(),
        (Some([0.0, 0.0]), _) => String::new(),
        (_, [true, _] | [_, true]) => {
            "[axis_twist_compensation] corrected the readings: they count as those of the nozzle\n"
                .to_owned()
        }
        (Some([x, y]), _) => format!(
            "the probe is {x} and {y} mm beside the nozzle: the axes stood at the places of the map minus that\n\
             roll of X or Y lifts it, too: identify takes that for straightness, unless --update gives the roll (import klipper-twist)\n"
        ),
    };
    format!(
        "{}: {} displacements, heights from {:.3} to {:.3} mm{left_out}\n\
         {beside}the surface counts as flat: what is left of it after its tilt becomes an error of the machine\n",
        answer.file.display(),
        answer.points,
        answer.lowest_mm,
        answer.highest_mm
    )
}

/// Where the machine file has the zero of the firmware.
fn zero(arguments: &Arguments, machine: &Machine) -> Result<PerAxis, BadInput> {
    let mut zero = PerAxis::default();
    if let Some(text) = &arguments.zero {
        for (axis, value) in zero.iter_mut().zip(position("--zero", text, machine)?) {
            *axis = value;
        }
    }
    Ok(zero)
}

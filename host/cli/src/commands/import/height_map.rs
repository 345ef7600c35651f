//! `trueaxis import klipper` and `reprapfirmware`

use crate::commands::files::Text;
use crate::commands::number::{finite, two};
use crate::commands::position_argument::position;
use crate::commands::{Outcome, bad_input::BadInput, files};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis_export::height_map::HeightMap;
use trueaxis_export::klipper::{bed_mesh, kinematics, probe};
use trueaxis_export::reprapfirmware;
use trueaxis_identify::formats::observations;
use trueaxis_model::machine::{MAX_AXES, Machine};

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
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

/// `--probe`, or what `printer.cfg` says of its probe.
pub fn probe_offset(text: &Text, given: &[f64]) -> Result<Option<[f64; 2]>, BadInput> {
    match given {
        [] => probe::offset(&text.text).map_err(|error| text.bad(error)),
        given => two(given, "--probe", "mm").map(Some),
    }
}

/// With the name of a profile, and the place of the probe.
#[derive(Args)]
pub struct OfProfile {
    #[command(flatten)]
    map: Arguments,
    /// Name of the profile, if there are several
    #[arg(long, value_name = "NAME")]
    profile: Option<String>,
    /// x_offset and y_offset of the probe (default: those in FILE; if it has none, the nozzle probed)
    #[arg(long, value_name = "X,Y", value_delimiter = ',', allow_negative_numbers = true, value_parser = finite)]
    probe: Vec<f64>,
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

pub fn klipper(arguments: &OfProfile) -> Result<Outcome, BadInput> {
    let text = Text::read(&arguments.map.map)?;
    kinematics::check(&text.text).map_err(|error| text.bad(error))?;
    let map = bed_mesh::read(&text.text, arguments.profile.as_deref());
    let map = map.map_err(|error| text.bad(error))?;
    let offset = probe_offset(&text, &arguments.probe)?;
    run(&arguments.map, &map, offset)
}

pub fn reprapfirmware(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let text = Text::read(&arguments.map)?;
    let map = reprapfirmware::read(&text.text);
    run(arguments, &map.map_err(|error| text.bad(error))?, None)
}

/// The machine's axes of a map, and Z.
fn axes_of(
    arguments: &Arguments,
    map: &HeightMap,
    machine: &Machine,
) -> Result<[usize; 3], BadInput> {
    let [a, b] = map.axes;
    let index = |letter: char| {
        machine.index(letter).ok_or_else(|| {
            BadInput::new(
                format!(
                    "{}: the map is over {a} and {b}, and the machine has no axis {letter}",
                    arguments.map.display()
                ),
                "give the machine file of this printer",
            )
        })
    };
    Ok([index(a)?, index(b)?, index('Z')?])
}

/// The firmwares write positions (mm) to as much.
const POSITIONS: f64 = 0.01;

/// Refuses a map that the machine cannot have probed, and a zero of Z where it has no travel.
fn within_travel(
    arguments: &Arguments,
    map: &HeightMap,
    machine: &Machine,
    [a, b, z]: [usize; 3],
    zero: [f64; MAX_AXES],
    [dx, dy]: [f64; 2],
) -> Result<(), BadInput> {
    let touches = map.touches();
    let stood = [(a, 0, dx), (b, 1, dy)].map(|(axis, k, offset)| {
        let at = touches.iter().map(|touch| touch[k] - offset + zero[axis]);
        [
            at.clone().fold(f64::INFINITY, f64::min),
            at.fold(f64::NEG_INFINITY, f64::max),
        ]
    });
    for (axis, [from, to]) in [(a, stood[0]), (b, stood[1]), (z, [zero[z]; 2])] {
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

/// `probe` is where the probe is beside the nozzle: the axes stood at the places of the map minus it.
fn run(
    arguments: &Arguments,
    map: &HeightMap,
    probe: Option<[f64; 2]>,
) -> Result<Outcome, BadInput> {
    let Arguments { output, .. } = arguments;
    files::prepare(output, &[&arguments.map, &arguments.machine])?;
    let machine = files::read_machine(&arguments.machine)?;
    let axes = axes_of(arguments, map, &machine)?;
    let zero = zero(arguments, &machine)?;
    within_travel(
        arguments,
        map,
        &machine,
        axes,
        zero,
        probe.unwrap_or_default(),
    )?;
    let [dx, dy] = probe.unwrap_or_default();
    let touches = map.touches().into_iter().map(|touch| {
        let mut at = zero;
        let stood = [touch[0] - dx, touch[1] - dy, touch[2]];
        for (axis, value) in axes.into_iter().zip(stood) {
            at[axis] += value;
        }
        (at, touch[2])
    });
    let touches: Vec<_> = touches.collect();
    let heights = || touches.iter().map(|(_, height)| *height);
    let name = output.file_stem().unwrap_or_default().to_string_lossy();
    let found = observations::of_surface(&name, axes[2], &touches);
    files::write(output, observations::write(&found, &machine).as_bytes())?;
    let answer = HeightMapAnswer {
        file: output,
        points: touches.len(),
        lowest_mm: heights().fold(f64::INFINITY, f64::min),
        highest_mm: heights().fold(f64::NEG_INFINITY, f64::max),
        probe_mm: probe,
    };
    files::print_answer(arguments.json, &answer, || said(&answer))?;
    Ok(Outcome::Done)
}

/// The text output.
fn said(answer: &HeightMapAnswer<'_>) -> String {
    let beside = match answer.probe_mm {
        Some([x, y]) if [x, y] != [0.0; 2] => format!(
            "the probe is {x} and {y} mm beside the nozzle: the axes stood at the places of the map minus that\n"
        ),
        _ => String::new(),
    };
    format!(
        "{}: {} displacements, heights from {:.3} to {:.3} mm\n\
         {beside}the surface counts as flat: what is left of it after its tilt becomes an error of the machine\n",
        answer.file.display(),
        answer.points,
        answer.lowest_mm,
        answer.highest_mm
    )
}

/// Where the machine file has the zero of the firmware.
fn zero(arguments: &Arguments, machine: &Machine) -> Result<[f64; MAX_AXES], BadInput> {
    let mut zero = [0.0; MAX_AXES];
    if let Some(text) = &arguments.zero {
        for (axis, value) in zero.iter_mut().zip(position("--zero", text, machine)?) {
            *axis = value;
        }
    }
    Ok(zero)
}

//! `trueaxis import points`

use crate::commands::files::Text;
use crate::commands::number::{finite, two};
use crate::commands::position_argument::position;
use crate::commands::progress::ProgressBarOnScreen;
use crate::commands::{Outcome, bad_input::BadInput, files, output};
use clap::{Args, ValueEnum};
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis::{Draft, DraftGrid, GridAxis, Notes, SampleFormat};
use trueaxis_export::sampled::{Nodes, SampledGrid};
use trueaxis_export::surface;
use trueaxis_model::machine::Machine;
use trueaxis_model::validate::Runtime;
use trueaxis_tables::compile::AxisBounds;
use trueaxis_tables::compile::extended::{draft, nothing, with_grid};

/// Read the heights of a surface that was probed over X and Y as a compensation of Z
///
/// Z then follows the surface: the compensation adds the height at X and Y to the command of Z, linear in between; beyond the
/// map, the height of its edge. Reads rows of X Y Z (probe_points.txt of QtDragon, logs of LinuxCNC's PROBEOPEN), .probe of
/// bCNC, .map of Candle, .hmap of OpenCNCPilot. The points must be a complete grid with equal steps.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis import points probe_points.txt --machine machine.toml --offset X=120.5,Y=80 -o machine.trax"
)]
pub struct Arguments {
    /// The points
    #[arg(value_name = "FILE")]
    points: PathBuf,
    /// Machine description
    #[arg(long, value_name = "machine.toml")]
    machine: PathBuf,
    /// Machine position of the zero from which X and Y of the points count: the work offset (G54 …) in which they were
    /// probed
    #[arg(long, value_name = "X=0,Y=0", allow_hyphen_values = true)]
    offset: String,
    /// The compensation that was on while the surface was probed, if one was: its corrections are kept
    #[arg(long, value_name = "FILE.trax")]
    add_to: Option<PathBuf>,
    /// Where the height is to be 0, in the coordinates of the points: where Z was set (default: heights as they are)
    #[arg(long, value_name = "X,Y", value_delimiter = ',', allow_hyphen_values = true, value_parser = finite)]
    zero: Vec<f64>,
    /// Unit of the points
    #[arg(long, value_enum, default_value_t = PointsUnit::Mm)]
    unit: PointsUnit,
    /// Where to write the compensation
    #[arg(short, long, value_name = "FILE.trax")]
    output: PathBuf,
    /// Accept heights that need a bound of more than 2 mm
    #[arg(long)]
    allow_large: bool,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum PointsUnit {
    /// Millimetres
    Mm,
    /// Inches
    Inch,
}

#[derive(Serialize)]
struct PointsAnswer<'a> {
    file: &'a Path,
    format: &'static str,
    /// In machine coordinates.
    x: Nodes,
    y: Nodes,
    lowest_mm: f64,
    highest_mm: f64,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let Arguments { points, output, .. } = arguments;
    let inputs = [
        Some(points),
        Some(&arguments.machine),
        arguments.add_to.as_ref(),
    ];
    let inputs: Vec<&Path> = inputs.into_iter().flatten().map(PathBuf::as_path).collect();
    output::prepare(output, &inputs)?;
    let machine = files::read_machine(&arguments.machine)?;
    let [x, y, z] = axes(&machine)?;
    let text = Text::read(points)?;
    let (map, format) = surface::read(&text.text).map_err(|error| text.bad(error))?;
    let grid = arguments.in_machine(&map.grid, &machine, [x, y])?;
    let added = draft_grid(&grid, [x, y, z]);
    let base = arguments.base(&machine, &added)?;
    let bar = ProgressBarOnScreen::new();
    let (blob, bounds) = with_grid(&machine, base, added, &bar)?;
    drop(bar);
    arguments.permits(&bounds[z], &text.name)?;
    output::write(output, &blob)?;
    let heights = || grid.values.iter().map(|[value]| *value);
    let answer = PointsAnswer {
        file: output,
        format: format.name(),
        x: grid.nodes[0],
        y: grid.nodes[1],
        lowest_mm: heights().fold(f64::INFINITY, f64::min),
        highest_mm: heights().fold(f64::NEG_INFINITY, f64::max),
    };
    output::print_answer(arguments.json, &answer, || said(&answer))?;
    Ok(Outcome::Done)
}

/// The map as a table of corrections of Z.
fn draft_grid(grid: &SampledGrid<1>, [x, y, z]: [usize; 3]) -> DraftGrid {
    let axis = |input: usize, nodes: Nodes| GridAxis {
        input: input as u8,
        start: nodes.start as f32,
        step: nodes.step as f32,
        points: nodes.count as u32,
        modulo: false,
    };
    DraftGrid {
        // The last input varies fastest, in the map the first one.
        axes: vec![axis(y, grid.nodes[1]), axis(x, grid.nodes[0])],
        outputs: vec![z as u8],
        format: SampleFormat::F32,
        values: grid.values.iter().map(|[value]| *value as f32).collect(),
    }
}

/// The axes X, Y and Z.
fn axes(machine: &Machine) -> Result<[usize; 3], BadInput> {
    match ['X', 'Y', 'Z'].map(|letter| machine.index(letter)) {
        [Some(x), Some(y), Some(z)] => Ok([x, y, z]),
        _ => Err(BadInput::new(
            format!(
                "{}: a map of Z over X and Y needs these three axes",
                machine.name
            ),
            "give the machine file of the machine that was probed with",
        )),
    }
}

fn said(answer: &PointsAnswer<'_>) -> String {
    let range = |nodes: Nodes| {
        let last = nodes.at(nodes.count - 1);
        format!(
            "{:.3} to {last:.3} in {} steps",
            nodes.start,
            nodes.count - 1
        )
    };
    format!(
        "{}: Z follows {:+.3} to {:+.3} mm, from {}\nin machine coordinates: X {}, Y {}; beyond, the height of the edge\n",
        answer.file.display(),
        answer.lowest_mm,
        answer.highest_mm,
        answer.format,
        range(answer.x),
        range(answer.y)
    )
}

impl Arguments {
    /// Refuses heights whose bound is larger than usual, unless they are meant.
    fn permits(&self, bound: &AxisBounds, name: &str) -> Result<(), BadInput> {
        if bound.value_bound <= bound.most() || self.allow_large {
            return Ok(());
        }
        Err(BadInput::new(
            format!(
                "{name}: heights up to {:.3} mm need a bound of more than {} mm",
                bound.largest,
                bound.most()
            ),
            "give --zero X,Y, the place where Z was set; if it is meant, give --allow-large",
        ))
    }

    /// The map in mm and machine coordinates.
    fn in_machine(
        &self,
        map: &SampledGrid<1>,
        machine: &Machine,
        axes: [usize; 2],
    ) -> Result<SampledGrid<1>, BadInput> {
        let offset = position("--offset", &self.offset, machine)?;
        let mm = match self.unit {
            PointsUnit::Mm => 1.0,
            PointsUnit::Inch => 25.4,
        };
        let level = self.level(map)?;
        let nodes = [0, 1].map(|k| Nodes {
            start: map.nodes[k].start * mm + offset[axes[k]],
            step: map.nodes[k].step * mm,
            count: map.nodes[k].count,
        });
        for (axis, nodes) in axes.into_iter().zip(nodes) {
            let axis = &machine.axes[axis];
            let [low, high] = axis.travel;
            let (first, last) = (nodes.start, nodes.at(nodes.count - 1));
            if first < low || last > high {
                return Err(BadInput::new(
                    format!(
                        "the points reach from {first:.3} to {last:.3} of {}, whose travel is {low} to {high}",
                        axis.letter
                    ),
                    "give --offset the machine position of the zero of the points, and --unit their unit",
                ));
            }
        }
        Ok(SampledGrid {
            nodes: nodes.to_vec(),
            values: (map.values.iter())
                .map(|[value]| [(value - level) * mm])
                .collect(),
        })
    }

    /// The height that counts as zero, in the unit of the points.
    fn level(&self, map: &SampledGrid<1>) -> Result<f64, BadInput> {
        if self.zero.is_empty() {
            return Ok(0.0);
        }
        let at = two(&self.zero, "--zero", "the unit of the points")?;
        let is_inside = |k: usize| {
            let nodes = map.nodes[k];
            (nodes.start..=nodes.at(nodes.count - 1)).contains(&at[k])
        };
        if is_inside(0) && is_inside(1) {
            return Ok(map.at(&at)[0]);
        }
        Err(BadInput::new(
            format!("--zero: {}, {} is outside of the points", at[0], at[1]),
            "give a place that was probed around, in the coordinates of the points",
        ))
    }

    /// What the map is added to.
    fn base(&self, machine: &Machine, added: &DraftGrid) -> Result<Option<Draft>, BadInput> {
        let Some(path) = &self.add_to else {
            return Ok(None);
        };
        let blob = files::read_blob(path)?;
        let runtime = Runtime::load(&blob).map_err(|error| BadInput::in_blob(error, path))?;
        let base = draft(&runtime, Notes::of(&blob).unwrap_or_default());
        let fresh = nothing(machine);
        let is_same = |a: &trueaxis::Axis, b: &trueaxis::Axis| {
            (a.name, a.travel, a.period) == (b.name, b.travel, b.period)
        };
        let axes = base.axes.iter().zip(&fresh.axes);
        if base.machine != fresh.machine
            || base.axes.len() != fresh.axes.len()
            || !axes.into_iter().all(|(a, b)| is_same(a, b))
        {
            return Err(BadInput::new(
                format!(
                    "{}: it was not made for {} with these axes",
                    path.display(),
                    machine.name
                ),
                "give the compensation and the machine file of the same machine",
            ));
        }
        let inputs = |grid: &DraftGrid| grid.axes.iter().map(|axis| axis.input).collect::<Vec<_>>();
        let is_map =
            |grid: &DraftGrid| grid.outputs == added.outputs && inputs(grid) == inputs(added);
        if base.grids.iter().any(is_map) {
            return Err(BadInput::new(
                format!("{}: it has a map of Z already", path.display()),
                "give the compensation without map: the new one replaces the old one",
            ));
        }
        Ok(Some(base))
    }
}

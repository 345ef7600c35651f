//! Three-dimensional error compensation of a Fanuc Series 30i: a grid over three linear axes.
//!
//! Between the eight points around a position, the control interpolates in each of the three axes (Fanuc A-79351E); a
//! value is a whole number times the magnification of its axis times the detection unit. A control holds 25 points along
//! an axis, 15 625 in all (the source document, section 4.3). Values from −128 to 127 and the order of the points, the first
//! axis fastest, are from practice; how a control reads them from a file is not public. So the values are written as plain CSV
//! with the parameters in its header, which says so. No control has run it.

use crate::NotExported;
use crate::difference::{Difference, differences};
use crate::positions::{letters, random_of, travel, xyz};
use crate::sampled::{Nodes, OtherAxes, SampledGrid, without_direction};
use crate::text_lines::{TextLine, lines};
use std::fmt::Write;
use trueaxis::Axis;
use trueaxis_model::machine::MAX_AXES;
use trueaxis_model::source::FileError;
use trueaxis_model::validate::{Command, Runtime};

/// Largest number of points along an axis.
pub const MOST_ALONG: usize = 25;
/// Range of a value.
const LEAST: f64 = -128.0;
const MOST: f64 = 127.0;
/// Largest magnification.
const MOST_MAGNIFICATION: u32 = 100;

/// How a grid is made.
#[derive(Clone, Debug, PartialEq)]
pub struct FanucOptions {
    /// Points along X, Y and Z.
    pub points: [usize; 3],
    /// Detection unit of the control (mm).
    pub unit: f64,
    /// Positions (mm, deg) at which further axes stay, by their letter.
    pub at: Vec<(char, f64)>,
    /// Random positions for the comparison, and their seed.
    pub positions: usize,
    /// See there.
    pub seed: u64,
}

/// A grid as the control has it.
#[derive(Clone, Debug, PartialEq)]
pub struct FanucTable {
    /// Points along each axis.
    pub nodes: [Nodes; 3],
    /// Magnification of each axis.
    pub magnification: [u32; 3],
    /// Detection unit (mm).
    pub unit: f64,
    /// Whole numbers of each point.
    pub values: Vec<[i32; 3]>,
}

/// Makes a grid of a compensation, reads its text again, and compares both. Further axes stay where `at` says; otherwise
/// the grid has the middle of what is needed over their travel.
///
/// # Errors
/// [`NotExported`]: other axes, a value that is too large.
pub fn export(
    runtime: &Runtime<'_>,
    options: &FanucOptions,
) -> Result<(FanucTable, String, Vec<Difference>), NotExported> {
    let axes = runtime.compensation().axes();
    let inputs = xyz(axes).ok_or_else(|| {
        NotExported::new(
            format!(
                "the compensation is for the axes {}, and the grid is over X, Y and Z",
                letters(axes)
            ),
            "compile a machine with X, Y and Z",
        )
    })?;
    let held = held(axes, inputs, &options.at)?;
    let hold = |command: &mut Command| {
        for (axis, position) in &held {
            command.axes[*axis] = *position;
        }
    };
    let mut commands = random_of(runtime.compensation(), options.positions, options.seed);
    commands.iter_mut().for_each(hold);
    let rest = OtherAxes::new(axes, &inputs, &commands);
    let nodes: [Nodes; 3] =
        std::array::from_fn(|k| Nodes::over(travel(&axes[inputs[k]]), options.points[k]));
    let grid = SampledGrid::of(&nodes, |position| {
        let set = |command: &mut Command| {
            *command = without_direction(command);
            hold(command);
            for (axis, p) in inputs.into_iter().zip(position) {
                command.axes[axis] = *p as f32;
            }
        };
        rest.middle(set, |command| {
            let found = runtime.evaluate(command);
            inputs.map(|axis| f64::from(found[axis]))
        })
    });
    let table = rounded(&grid, nodes, options.unit, axes, inputs)?;
    let text = print(&table, &options.at);
    let read = read(&text).map_err(NotExported::unread)?;
    let again = read.grid();
    let found = differences(runtime, &commands, |command| {
        correction(&again, command, inputs)
    });
    Ok((read, text, found))
}

/// What the control adds to a command.
fn correction(grid: &SampledGrid<3>, command: &Command, inputs: [usize; 3]) -> [f64; MAX_AXES] {
    let position = inputs.map(|axis| f64::from(command.axes[axis]));
    let mut correction = [0.0; MAX_AXES];
    for (axis, value) in inputs.into_iter().zip(grid.at(&position)) {
        correction[axis] = value;
    }
    correction
}

/// Further axes, by their index, with the positions where they stay.
fn held(
    axes: &[Axis],
    inputs: [usize; 3],
    at: &[(char, f64)],
) -> Result<Vec<(usize, f32)>, NotExported> {
    let index = |letter: char| {
        let axis = axes.iter().position(|a| char::from(a.name) == letter);
        axis.filter(|axis| !inputs.contains(axis))
    };
    let held = |(k, (letter, position)): (usize, &(char, f64))| {
        if at[..k].iter().any(|(other, _)| other == letter) {
            return Err(NotExported::new(
                format!("--at has {letter} twice"),
                "give one position of each axis",
            ));
        }
        let axis = index(*letter).ok_or_else(|| {
            NotExported::new(
                format!("{letter} is not an axis of the compensation besides X, Y and Z"),
                "write --at with the letters of the rotary axes, like A=0,C=0",
            )
        })?;
        let [low, high] = travel(&axes[axis]);
        if !(low..=high).contains(position) {
            return Err(NotExported::new(
                format!("{letter}={position} is outside of the travel, {low} to {high} deg"),
                "give a position of --at within the travel",
            ));
        }
        Ok((axis, *position as f32))
    };
    at.iter().enumerate().map(held).collect()
}

/// Whole numbers, with the smallest magnifications that hold them.
fn rounded(
    grid: &SampledGrid<3>,
    nodes: [Nodes; 3],
    unit: f64,
    axes: &[Axis],
    inputs: [usize; 3],
) -> Result<FanucTable, NotExported> {
    let mut magnification = [1; 3];
    for (k, magnification) in magnification.iter_mut().enumerate() {
        let largest = grid.values.iter().map(|v| v[k].abs()).fold(0.0, f64::max);
        let needed = (largest / unit / MOST).ceil().max(1.0);
        if needed > f64::from(MOST_MAGNIFICATION) {
            let axis = char::from(axes[inputs[k]].name);
            return Err(NotExported::new(
                format!(
                    "a correction of {axis} of {largest:.3} mm is more than 127 × {MOST_MAGNIFICATION} detection units"
                ),
                "give the detection unit of the control with --unit",
            ));
        }
        *magnification = needed as u32;
    }
    let whole = |value: &[f64; 3]| {
        std::array::from_fn(|k| {
            let step = unit * f64::from(magnification[k]);
            (value[k] / step).round().clamp(LEAST, MOST) as i32
        })
    };
    Ok(FanucTable {
        nodes,
        magnification,
        unit,
        values: grid.values.iter().map(whole).collect(),
    })
}

impl FanucTable {
    /// What the control interpolates (mm).
    fn grid(&self) -> SampledGrid<3> {
        let step = self.magnification.map(|m| f64::from(m) * self.unit);
        let values = self.values.iter();
        SampledGrid {
            nodes: self.nodes.to_vec(),
            values: values
                .map(|v| std::array::from_fn(|k| f64::from(v[k]) * step[k]))
                .collect(),
        }
    }
}

/// Words at the head, before the numbers of X, Y and Z.
const HEAD: [&str; 4] = [
    "number of points",
    "first point (mm, machine coordinates)",
    "interval (mm)",
    "magnification",
];

/// The text of a grid, which is for positions `at` of further axes.
fn print(table: &FanucTable, at: &[(char, f64)]) -> String {
    let at: String = at
        .iter()
        .map(|(letter, position)| format!(" {letter}{position}"))
        .collect();
    let only = match at.is_empty() {
        true => at,
        false => format!(", only for{at}"),
    };
    let mut text = format!(
        "# trueaxis: three-dimensional error compensation of a Fanuc 30i, corrections{only}\n\
         # plain CSV: how the control reads such values from a file is not public, so enter or convert them\n\
         # detection unit (mm), {}\n",
        table.unit
    );
    let nodes = table.nodes;
    let rows = [
        nodes.map(|n| n.count.to_string()),
        nodes.map(|n| format!("{:.6}", n.start)),
        nodes.map(|n| format!("{:.6}", n.step)),
        table.magnification.map(|m| m.to_string()),
    ];
    for (words, row) in HEAD.iter().zip(rows) {
        let _ = writeln!(text, "# {words}, {}", row.join(", "));
    }
    text += "point,X,Y,Z\n";
    for (number, [x, y, z]) in table.values.iter().enumerate() {
        let _ = writeln!(text, "{},{x},{y},{z}", number + 1);
    }
    text
}

/// Reads what [`export`] writes.
fn read(text: &str) -> Result<FanucTable, FileError> {
    let all = lines(text);
    let short = || FileError::whole("the file ends too early", "give it whole");
    let line = |number: usize| all.get(number).ok_or_else(short);
    let numbers = |line: &TextLine<'_>, words: &str| {
        let rest = line.text.strip_prefix(&format!("# {words},"));
        let rest =
            rest.ok_or_else(|| line.bad(format!("no {words}"), "give the file as it was written"))?;
        rest.split(',')
            .map(|word| line.number(word.trim()))
            .collect::<Result<Vec<f64>, _>>()
    };
    let three = |number: usize| {
        let line = line(3 + number)?;
        let found = numbers(line, HEAD[number])?;
        <[f64; 3]>::try_from(found)
            .map_err(|_| line.bad("not three numbers", "give the file as it was written"))
    };
    let unit = numbers(line(2)?, "detection unit (mm)")?[0];
    let (count, start, step, magnification) = (three(0)?, three(1)?, three(2)?, three(3)?);
    let nodes: [Nodes; 3] = std::array::from_fn(|k| Nodes {
        start: start[k],
        step: step[k],
        count: count[k] as usize,
    });
    let mut values = Vec::new();
    for (number, line) in all.iter().skip(HEAD.len() + 4).enumerate() {
        values.push(point(line, number + 1)?);
    }
    match values.len() == nodes.iter().map(|n| n.count).product::<usize>() {
        true => Ok(FanucTable {
            nodes,
            magnification: magnification.map(|m| m as u32),
            unit,
            values,
        }),
        false => Err(short()),
    }
}

/// The numbers of a point, which must be the next one.
fn point(line: &TextLine<'_>, number: usize) -> Result<[i32; 3], FileError> {
    let row = line.numbers()?;
    let is_next = row.len() == 4 && row[0] == number as f64;
    let is_whole = |v: &f64| v.fract() == 0.0 && (LEAST..=MOST).contains(v);
    if !is_next || !row.iter().skip(1).all(is_whole) {
        return Err(line.bad(
            "not the next point with three whole numbers from -128 to 127",
            "give the file as it was written",
        ));
    }
    Ok([row[1] as i32, row[2] as i32, row[3] as i32])
}

#[cfg(test)]
mod tests;

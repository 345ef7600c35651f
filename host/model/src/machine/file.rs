//! `machine.toml`.

mod solids;
mod warnings;

use super::{
    Axis, Branch, CorrectionLimits, Letter, MAX_AXES, Machine, MachineError, MachineProblem,
};
use crate::source::{Exactly, FileError, FileKind, right_case};
use serde::Deserialize;
use std::ops::Range;
use toml::Spanned;
use trueaxis_kinematics::Htm;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MachineFile {
    name: Spanned<String>,
    topology: Option<Spanned<String>>,
    servo_period_ms: Option<Spanned<f64>>,
    axis: Vec<Spanned<MachineAxisEntry>>,
    spindle: Option<Spanned<SpindleEntry>>,
    tool: Option<ToolEntry>,
    #[serde(default)]
    workpiece: FrameEntry,
    #[serde(default)]
    solid: Vec<solids::SolidEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MachineAxisEntry {
    name: Spanned<String>,
    branch: Spanned<String>,
    range: Spanned<Exactly<2>>,
    #[serde(default)]
    modulo: Option<Spanned<bool>>,
    #[serde(default)]
    reversed: bool,
    origin_mm: Option<Spanned<Exactly<3>>>,
    orientation_deg: Option<Spanned<Exactly<3>>>,
    max_speed: Option<Spanned<f64>>,
    max_acceleration: Option<Spanned<f64>>,
    max_reversal_acceleration: Option<Spanned<f64>>,
    reversal_threshold: Option<Spanned<f64>>,
    max_correction_speed: Option<Spanned<f64>>,
    max_correction_acceleration: Option<Spanned<f64>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct FrameEntry {
    origin_mm: Option<Spanned<Exactly<3>>>,
    orientation_deg: Option<Spanned<Exactly<3>>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SpindleEntry {
    origin_mm: Option<Spanned<Exactly<3>>>,
    orientation_deg: Option<Spanned<Exactly<3>>>,
    axis: Option<Spanned<String>>,
    #[serde(default)]
    can_be_oriented: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ToolEntry {
    tip_mm: Spanned<Exactly<3>>,
    length_range_mm: Option<Spanned<Exactly<2>>>,
}

impl Machine {
    /// Reads and validates a machine description.
    ///
    /// # Errors
    /// [`FileError`] with place, cause and remedy: syntax, unknown keys and letters, an axis that is named twice, a
    /// topology that does not match the axes, an empty travel, a value that is not finite, a missing tool axis, and
    /// whatever [`check`](trueaxis_kinematics::Machine::check) refuses.
    pub fn from_toml(text: &str) -> Result<Self, FileError> {
        let file: MachineFile = toml::from_str(text).map_err(|error| {
            FileError::swapped(text, FileKind::Errors)
                .unwrap_or_else(|| FileError::syntax(&error, text))
        })?;
        let axes = file.axes()?;
        let tool = file.tool()?;
        let spindle = file.spindle(tool)?;
        let tool_axis = tool_axis(spindle)?;
        let spindle = spindle.get_ref();
        let tip = finite(&tool.tip_mm)?;
        let machine = Machine {
            name: file.name()?,
            length_range: tool.length_range(tip[tool_axis])?,
            can_orient: spindle.can_be_oriented,
            correction_limits: file.correction_limits()?,
            servo_period: file.servo_period()?,
            solids: solids::read(&file.solid, &axes)?,
            machine: trueaxis_kinematics::Machine {
                axes: axes.into_iter().collect(),
                spindle: frame(&spindle.origin_mm, &spindle.orientation_deg)?,
                tool_axis,
                tip,
                workpiece: frame(&file.workpiece.origin_mm, &file.workpiece.orientation_deg)?,
            },
        };
        if let Some(topology) = &file.topology {
            check_topology(topology, &machine)?;
        }
        machine
            .check()
            .map_err(|error| file.refused(&machine, &error))?;
        Ok(machine)
    }

    /// The place of a limit of an axis in the text of the file: of its speed, or else of its acceleration.
    #[must_use]
    pub fn correction_limit_place(
        text: &str,
        axis: usize,
        of_acceleration: bool,
    ) -> Option<Range<usize>> {
        let file: MachineFile = toml::from_str(text).ok()?;
        let entry = file.axis.get(axis)?.get_ref();
        let limit = match of_acceleration {
            true => &entry.max_correction_acceleration,
            false => &entry.max_correction_speed,
        };
        limit.as_ref().map(Spanned::span)
    }
}

impl MachineFile {
    /// Three to six axes with different letters.
    fn axes(&self) -> Result<Vec<Axis>, FileError> {
        let mut axes: Vec<Axis> = Vec::new();
        for entry in &self.axis {
            let axis = read_axis(entry.get_ref())?;
            if axes.iter().any(|a| a.letter == axis.letter) {
                return Err(FileError::at(
                    entry.get_ref().name.span(),
                    format!("axis {} is described twice", axis.letter),
                    "second description",
                    "give each axis its own letter (X Y Z U V W, A B C), once",
                ));
            }
            axes.push(axis);
        }
        if !(3..=MAX_AXES).contains(&axes.len()) {
            let last = self.axis.last().map(|a| a.get_ref().name.span());
            return Err(FileError::at(
                last.unwrap_or(self.name.span()),
                format!("the machine has {} axes", axes.len()),
                "the last of them",
                "describe three to six [[axis]] entries",
            ));
        }
        Ok(axes)
    }

    fn correction_limits(&self) -> Result<Vec<CorrectionLimits>, FileError> {
        let limit = |value: &Option<Spanned<f64>>| match value {
            Some(_) => positive(value, 0.0).map(Some),
            None => Ok(None),
        };
        let entries = self.axis.iter().map(Spanned::get_ref);
        let limits = entries.map(|entry| {
            Ok(CorrectionLimits {
                speed: limit(&entry.max_correction_speed)?,
                acceleration: limit(&entry.max_correction_acceleration)?,
                of_axis: limit(&entry.max_acceleration)?,
                reversal: limit(&entry.max_reversal_acceleration)?,
            })
        });
        limits.collect()
    }

    /// The servo period, in s: what a servo of the runtime takes.
    fn servo_period(&self) -> Result<f64, FileError> {
        let Some(period) = &self.servo_period_ms else {
            return Ok(Machine::SERVO_PERIOD);
        };
        let ms = *period.get_ref();
        if (1e-3..=10.0).contains(&ms) {
            return Ok(ms * 1e-3);
        }
        Err(FileError::here(
            period.span(),
            format!("a servo period of {ms} ms is not between 0.001 and 10 ms"),
            "write the period of the controller's servo loop in ms",
        ))
    }

    fn tool(&self) -> Result<&ToolEntry, FileError> {
        self.tool.as_ref().ok_or_else(|| {
            FileError::at(
                self.name.span(),
                "the machine has no [tool]",
                "this machine",
                "add [tool] with tip_mm = [x, y, z], the tool tip in the spindle frame",
            )
        })
    }

    fn spindle(&self, tool: &ToolEntry) -> Result<&Spanned<SpindleEntry>, FileError> {
        self.spindle.as_ref().ok_or_else(|| {
            FileError::at(
                self.name.span(),
                "the machine has no [spindle]",
                "this machine",
                format!(
                    "add [spindle] with axis = \"{}\": the tool axis in the spindle frame, along which the tip is",
                    along(tool.tip_mm.get_ref().0)
                ),
            )
        })
    }

    /// The machine's name, at most 64 bytes, which fits every blob and every hello message.
    fn name(&self) -> Result<String, FileError> {
        let name = self.name.get_ref();
        if name.is_empty() || name.len() > 64 {
            return Err(FileError::here(
                self.name.span(),
                "the machine's name is empty or longer than 64 bytes",
                "give a short name: error files and blobs refer to it",
            ));
        }
        Ok(name.clone())
    }

    /// Why the kinematic chain is refused, at the axis responsible.
    fn refused(&self, machine: &Machine, error: &MachineError) -> FileError {
        let name = |i: usize| self.axis[i].get_ref().name.span();
        let (span, label) = match error.axis {
            Some(i) => (name(i), "this axis".to_owned()),
            // No single axis is responsible: point to the first of the kind.
            None => {
                let rotary = matches!(error.problem, MachineProblem::DependentRotaryAxes { .. });
                let mut axes = machine.axes.iter();
                let first = axes.position(|a| a.letter.is_rotary() == rotary);
                let kind = if rotary { "rotary" } else { "linear" };
                let label = format!("the first of the {kind} axes");
                (name(first.unwrap_or(0)), label)
            }
        };
        FileError::at(
            span,
            error.problem.to_string(),
            label,
            error.problem.remedy(),
        )
    }
}

impl ToolEntry {
    /// The range of the tool length, if it is an input; `along` is the tip's coordinate on the tool axis.
    fn length_range(&self, along: f64) -> Result<Option<[f64; 2]>, FileError> {
        let Some(range) = &self.length_range_mm else {
            return Ok(None);
        };
        let [low, high] = finite(range)?;
        if low < 0.0 || low >= high {
            return Err(FileError::here(
                range.span(),
                "the range of the tool length is empty or negative",
                "write [shortest, longest] in mm, measured along the tool axis from the spindle frame",
            ));
        }
        if along == 0.0 {
            return Err(FileError::at(
                self.tip_mm.span(),
                "the tip is in the plane of the spindle's face, so the side to which the tool extends is undefined",
                "0 along the tool axis",
                "give tip_mm a length along the tool axis: its sign is the side",
            ));
        }
        Ok(Some([low, high]))
    }
}

/// The axis of the spindle frame that is the tool axis: 0 to 2.
fn tool_axis(spindle: &Spanned<SpindleEntry>) -> Result<usize, FileError> {
    let Some(axis) = &spindle.get_ref().axis else {
        return Err(FileError::at(
            spindle.span(),
            "the spindle does not say which of its axes is the tool axis",
            "no axis here",
            "add axis = \"z\" (or x, y) to [spindle]",
        ));
    };
    let name = axis.get_ref().as_str();
    let found = ["x", "y", "z"].iter().position(|known| *known == name);
    found.ok_or_else(|| {
        FileError::at(
            axis.span(),
            format!("`{name}` is not an axis of the spindle frame"),
            "the tool axis",
            "write x, y or z",
        )
    })
}

/// True for the name of an axis.
fn is_letter(name: &str) -> bool {
    let mut letters = name.chars();
    letters.next().and_then(Letter::new).is_some() && letters.next().is_none()
}

fn letter(name: &Spanned<String>) -> Result<Letter, FileError> {
    let span = name.span();
    let name = name.get_ref();
    let mut letters = name.chars();
    match (letters.next().and_then(Letter::new), letters.next()) {
        (Some(letter), None) => Ok(letter),
        _ => Err(FileError::at(
            span,
            format!("`{name}` is not an axis letter"),
            "unknown axis",
            match right_case(name, is_letter) {
                Some(right) => format!("write \"{right}\": axes have capital letters"),
                None => "write one of X Y Z U V W (linear) or A B C (rotary)".to_owned(),
            },
        )),
    }
}

fn travel(range: &Spanned<Exactly<2>>, letter: Letter) -> Result<[f64; 2], FileError> {
    let travel = finite(range)?;
    if travel[0] >= travel[1] {
        return Err(FileError::at(
            range.span(),
            format!("the travel of axis {letter} is empty"),
            "lower limit not below upper limit",
            "write range = [lower, upper] in mm or degrees",
        ));
    }
    if travel.iter().any(|t| t.abs() > 1e5) {
        return Err(FileError::at(
            range.span(),
            format!("the travel of axis {letter} exceeds 100 m or 100000 degrees"),
            "too large",
            "travels are in mm and degrees",
        ));
    }
    Ok(travel)
}

fn is_modulo(
    entry: &MachineAxisEntry,
    letter: Letter,
    travel: [f64; 2],
) -> Result<bool, FileError> {
    let Some(flag) = entry.modulo.as_ref().filter(|flag| *flag.get_ref()) else {
        return Ok(false);
    };
    if !letter.is_rotary() {
        return Err(FileError::here(
            flag.span(),
            format!("axis {letter} is linear and cannot be modulo"),
            "remove modulo, or set it to false",
        ));
    }
    if (travel[1] - travel[0] - 360.0).abs() > 1e-9 {
        return Err(FileError::at(
            entry.range.span(),
            format!("axis {letter} is modulo, but its range is not one turn"),
            "not 360 degrees",
            "write range = [0.0, 360.0] or [-180.0, 180.0]",
        ));
    }
    Ok(true)
}

fn read_axis(entry: &MachineAxisEntry) -> Result<Axis, FileError> {
    let letter = letter(&entry.name)?;
    let branch = match entry.branch.get_ref().as_str() {
        "workpiece" => Branch::Workpiece,
        "tool" => Branch::Tool,
        other => {
            return Err(FileError::at(
                entry.branch.span(),
                format!("`{other}` is not a branch"),
                "unknown branch",
                "write \"workpiece\" or \"tool\"",
            ));
        }
    };
    let travel = travel(&entry.range, letter)?;
    let modulo = is_modulo(entry, letter, travel)?;
    let default = Axis::new(letter, branch, travel);
    Ok(Axis {
        frame: frame(&entry.origin_mm, &entry.orientation_deg)?,
        modulo,
        reversed: entry.reversed,
        max_speed: positive(&entry.max_speed, default.max_speed)?,
        reversal_threshold: positive(&entry.reversal_threshold, default.reversal_threshold)?,
        ..default
    })
}

/// The axis of the spindle frame along which a tip lies: `x`, `y` or `z`.
fn along([x, y, z]: [f64; 3]) -> char {
    match (x.abs(), y.abs(), z.abs()) {
        (x, y, z) if x > y && x > z => 'x',
        (_, y, z) if y > z => 'y',
        _ => 'z',
    }
}

fn positive(value: &Option<Spanned<f64>>, default: f64) -> Result<f64, FileError> {
    match value {
        None => Ok(default),
        Some(v) if v.get_ref().is_finite() && *v.get_ref() > 0.0 && *v.get_ref() < 1e6 => {
            Ok(*v.get_ref())
        }
        Some(v) => Err(FileError::here(
            v.span(),
            "this must be a positive number",
            "write a finite value above 0 (mm or deg, per s or s²)",
        )),
    }
}

fn finite<const N: usize>(value: &Spanned<Exactly<N>>) -> Result<[f64; N], FileError> {
    let Exactly(numbers) = *value.get_ref();
    if numbers.iter().all(|v| v.is_finite()) {
        Ok(numbers)
    } else {
        Err(FileError::at(
            value.span(),
            "a value here is not a finite number",
            "nan or inf",
            "write plain numbers in mm or degrees",
        ))
    }
}

fn frame(
    origin: &Option<Spanned<Exactly<3>>>,
    orientation: &Option<Spanned<Exactly<3>>>,
) -> Result<Htm, FileError> {
    let o = origin.as_ref().map_or(Ok([0.0; 3]), finite)?;
    let d = orientation.as_ref().map_or(Ok([0.0; 3]), finite)?;
    Ok(Htm::from_xyz_abc([
        o[0],
        o[1],
        o[2],
        d[0].to_radians(),
        d[1].to_radians(),
        d[2].to_radians(),
    ]))
}

fn check_topology(topology: &Spanned<String>, machine: &Machine) -> Result<(), FileError> {
    // Both `f` and `F` occur in print; the S of the spindle may be omitted.
    let plain = |s: &str| s.replace('f', "F").replace("St", "t");
    let expected = machine.topology();
    if plain(topology.get_ref()) == plain(&expected) {
        return Ok(());
    }
    let span: Range<usize> = topology.span();
    Err(FileError::at(
        span,
        format!(
            "the topology `{}` does not match the axes",
            topology.get_ref()
        ),
        format!("the axes below make {expected}"),
        "order the [[axis]] entries of each branch from the foundation outwards, or correct the topology: workpiece axes go to the left of F, the outermost first",
    ))
}

//! A first description of a machine, from its configuration.

use crate::check::SLOPE;
use crate::configuration::{Configuration, JointAxis};
use crate::kinematics::ModuleShape;
use std::fmt::{Display, Write};
use trueaxis_tables::compile::REVERSAL;

/// An axis in the description.
pub(crate) struct DescribedAxis {
    pub joint: JointAxis,
    branch: &'static str,
    pub reversed: bool,
    /// Origin (mm), if the module defines it.
    origin: Option<[f64; 3]>,
    remark: &'static str,
}

/// Joints with an axis of a machine, each letter once.
fn axes(configuration: &Configuration) -> Vec<JointAxis> {
    let mut found: Vec<JointAxis> = Vec::new();
    for joint in configuration.axes() {
        if found.iter().all(|j| j.letter != joint.letter) {
            found.push(joint);
        }
    }
    found
}

/// The axes of the machine, and the position of the tool tip along the tool axis.
pub(crate) fn entries(configuration: &Configuration) -> (Vec<DescribedAxis>, f64) {
    let axes = axes(configuration);
    match ModuleShape::of(&configuration.module.name) {
        Some(shape) if shape.tool.is_empty() => table(configuration, &axes, shape),
        Some(shape) => head(configuration, &axes, shape),
        None => plain(&axes),
    }
}

pub(crate) fn machine(
    configuration: &Configuration,
    name: &str,
    entries: &[DescribedAxis],
    tip: f64,
    unsure: Option<String>,
) -> String {
    let quoted = toml::Value::from(name);
    let mut text = format!(
        "# A first description, made from the INI file: CHECK marks what that does not tell. See the page on machine\n\
         # files in the manual, and compare `trueaxis pose` with the machine.\n\
         name = {quoted}\n\n\
         # CHECK the order: each branch from the foundation outwards.\n"
    );
    for entry in entries {
        text += &axis(configuration, entry);
    }
    let _ = write!(
        text,
        "\n[spindle]\naxis = \"z\"\n\n[tool]\n# CHECK: from the spindle frame to the tip of the tool.\n{}tip_mm = [0.0, 0.0, {tip:?}]\n",
        unsure.map_or(String::new(), |unsure| format!("# CHECK: {unsure}.\n"))
    );
    text
}

/// The lines of an axis.
struct AxisLines(String);

impl AxisLines {
    fn add(&mut self, key: &str, value: impl Display, remark: &str) {
        let _ = match remark {
            "" => writeln!(self.0, "{key} = {value}"),
            _ => writeln!(self.0, "{key} = {value}  # {remark}"),
        };
    }

    /// The travel, with a margin, so that the soft limits are inside by the largest correction.
    fn add_range(&mut self, range: Option<(f64, f64)>, endless: bool, rotary: bool) {
        if endless {
            self.add("range", "[-180.0, 180.0]", "an axis without end");
            self.add("modulo", "true", "");
        } else if let Some((low, high)) = range {
            let (margin, unit) = (margin(rotary), if rotary { "deg" } else { "mm" });
            let ends = [rounded(low - margin), rounded(high + margin)];
            let remark =
                format!("the soft limits and {margin:?} {unit} on either side, for the correction");
            self.add("range", format!("{ends:?}"), &remark);
        }
    }

    /// The largest speed and accelerations. Joints of one axis move together, as the slowest of them can.
    fn add_speeds(&mut self, configuration: &Configuration, joint: JointAxis, unit: &str) {
        let joints = configuration.axes();
        let positive = |key| {
            let joints = joints.iter().filter(|other| other.letter == joint.letter);
            let values = joints.filter_map(|joint| configuration.number(joint.number, key));
            let least = values.filter(|value| *value > 0.0).reduce(f64::min);
            least.map(|value| value * configuration.unit(joint))
        };
        let shown = |value: f64| format!("{:?}", rounded(value));
        if let Some(speed) = positive("MAX_VELOCITY") {
            self.add("max_speed", shown(speed), &format!("{unit}/s"));
        }
        let Some(acceleration) = positive("MAX_ACCELERATION") else {
            return;
        };
        self.add(
            "max_acceleration",
            shown(acceleration),
            &format!("{unit}/s²"),
        );
        // What the step generator can do in addition.
        let room = positive("STEPGEN_MAXACCEL").map(|most| most - (1.0 + SLOPE) * acceleration);
        if let Some(room) = room.filter(|room| *room < REVERSAL * acceleration) {
            let remark = format!("{unit}/s²: the rest of STEPGEN_MAXACCEL");
            self.add(
                "max_reversal_acceleration",
                shown(room.max(LEAST_REVERSAL)),
                &remark,
            );
        }
    }
}

fn axis(configuration: &Configuration, entry: &DescribedAxis) -> String {
    let JointAxis { number, letter } = entry.joint;
    let rotary = "ABC".contains(letter);
    let (unit, usual) = if rotary {
        ("deg", 360.0)
    } else {
        ("mm", 1000.0)
    };
    let mut lines = AxisLines("\n[[axis]]\n".to_owned());
    lines.add("name", format!("\"{letter}\""), &format!("joint {number}"));
    lines.add("branch", format!("{:?}", entry.branch), entry.remark);
    if let Some(origin) = entry.origin {
        lines.add("origin_mm", format!("{origin:?}"), "");
    }
    let range = range(configuration, entry.joint);
    lines.add_range(range, configuration.is_endless(entry.joint), rotary);
    if entry.reversed {
        let remark = "a positive command moves the carriage the negative way";
        lines.add("reversed", "true", remark);
    }
    lines.add_speeds(configuration, entry.joint, unit);
    // Commands have no noise but the rounding of f32, to 1.2e-7 of their size or less.
    let largest = range.map_or(usual, |(low, high)| low.abs().max(high.abs()));
    let least = f64::from(f32::EPSILON) * largest;
    let least = (least * 1e5).ceil() / 1e5;
    lines.add("reversal_threshold", format!("{least:?}"), unit);
    lines.0
}

/// The least acceleration (mm/s², deg/s²) that the file takes; a ramp of the corrections is faster.
const LEAST_REVERSAL: f64 = 0.001;

/// The soft limits, mm or degrees, if they are a travel.
fn range(configuration: &Configuration, joint: JointAxis) -> Option<(f64, f64)> {
    let unit = configuration.unit(joint);
    let limit = |key: &str| {
        let limit = configuration.limit(joint, key);
        limit.map(|(value, _)| rounded(value * unit))
    };
    let range = limit("MIN_LIMIT").zip(limit("MAX_LIMIT"));
    range.filter(|(low, high)| low < high)
}

/// Margin (mm, deg) of a travel beyond the soft limits: more than corrections usually are.
fn margin(rotary: bool) -> f64 {
    if rotary { 0.1 } else { 0.5 }
}

pub(crate) fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

/// Puts the linear axes with these letters below the table, and the others on the side of the spindle.
pub(crate) fn divide(entries: &mut [DescribedAxis], table: &str) {
    for entry in entries.iter_mut() {
        if !entry.joint.is_rotary() {
            let is_table = table.contains(entry.joint.letter);
            entry.branch = if is_table { "workpiece" } else { "tool" };
            entry.reversed = is_table;
            entry.remark = "";
        }
    }
    // A knee carries the other axes of the table, and these the rotary ones; the rest is in order.
    entries.sort_by_key(|entry| match (entry.branch, entry.joint.letter) {
        ("workpiece", 'Z' | 'W') => 0,
        ("workpiece", 'A'..='C') => 2,
        ("workpiece", _) => 1,
        _ => 3,
    });
}

/// Three or more axes without further information: the usual mill.
fn plain(axes: &[JointAxis]) -> (Vec<DescribedAxis>, f64) {
    let entries = ordered(axes, "YXABCUV", "ZW").map(|(joint, table)| DescribedAxis {
        joint,
        branch: if table { "workpiece" } else { "tool" },
        reversed: table && !"ABC".contains(joint.letter),
        origin: "ABC".contains(joint.letter).then_some([0.0; 3]),
        remark: match (table, "ABC".contains(joint.letter)) {
            (true, true) => "CHECK: what carries it, origin_mm of its axis, which way it turns",
            (true, false) => "CHECK: does it move the table (then reversed), or the spindle?",
            (false, _) => "CHECK: does it move the spindle?",
        },
    });
    (entries.collect(), -100.0)
}

/// A trunnion or similar table, with the points of the module.
fn table(
    configuration: &Configuration,
    axes: &[JointAxis],
    shape: ModuleShape,
) -> (Vec<DescribedAxis>, f64) {
    let module = &configuration.module.name;
    let mm = configuration.mm.unwrap_or(1.0);
    let value = |name: &str| {
        let found = configuration.hal.value(&format!("{module}.{name}"));
        found.map_or(0.0, |(value, _)| value)
    };
    let table = ["x-rot-point", "y-rot-point", "z-rot-point"].map(|p| rounded(value(p) * mm));
    let mut cradle = table;
    for (i, offset) in shape.offsets {
        cradle[i] = rounded(cradle[i] + value(offset) * mm);
    }
    let conventional = value("conventional-directions") != 0.0;
    let order = format!("YX{}", shape.workpiece);
    let entries = ordered(axes, &order, "Z").map(|(joint, is_table)| {
        let rotary = "ABC".contains(joint.letter);
        DescribedAxis {
            joint,
            branch: if is_table { "workpiece" } else { "tool" },
            reversed: is_table && (!rotary || conventional),
            origin: rotary.then_some(if joint.letter == 'C' { table } else { cradle }),
            remark: match (is_table, rotary) {
                (true, true) => "origin_mm as the pins of the kinematics say",
                (true, false) => "CHECK: does it move the table (then reversed), or the spindle?",
                (false, _) => "CHECK: does it move the spindle?",
            },
        }
    });
    let offset = value("tool-offset") * mm;
    let tip = match offset > 0.0 {
        true => rounded(-offset),
        false => -100.0,
    };
    (entries.collect(), tip)
}

/// A fork head.
fn head(
    configuration: &Configuration,
    axes: &[JointAxis],
    shape: ModuleShape,
) -> (Vec<DescribedAxis>, f64) {
    let order = format!("XYZ{}", shape.tool);
    let entries = ordered(axes, "", &order).map(|(joint, _)| DescribedAxis {
        joint,
        branch: "tool",
        reversed: joint.letter == 'B',
        origin: "ABC".contains(joint.letter).then_some([0.0; 3]),
        remark: match joint.letter {
            'B' => "the module turns it against the right hand",
            'C' => "",
            _ => "CHECK: does it move the spindle, or the table (then \"workpiece\", reversed)?",
        },
    });
    let mm = configuration.mm.unwrap_or(1.0);
    let pivot = configuration.hal.value(PIVOT);
    let pivot = pivot.map_or(DEFAULT_PIVOT, |(value, _)| value);
    (entries.collect(), rounded(-pivot * mm))
}

/// The pin with the pivot length of a head, in machine units.
const PIVOT: &str = "5axiskins.pivot-length";
/// Value if nothing sets it.
const DEFAULT_PIVOT: f64 = 250.0;

/// Why the pivot length of a head is not known from its HAL files, if that is so.
#[must_use]
pub fn unknown_pivot(configuration: &Configuration) -> Option<String> {
    let hal = &configuration.hal;
    if configuration.module.name != "5axiskins" || hal.value(PIVOT).is_some() {
        return None;
    }
    let default = format!("{DEFAULT_PIVOT} machine units are only the module's default");
    Some(match hal.signal(PIVOT) {
        Some(signal) => {
            format!("{PIVOT} comes from the signal {signal}, whose value is not visible: {default}")
        }
        None => format!("no HAL file sets {PIVOT}: {default}"),
    })
}

/// Axes in the order of the letters of the two branches, and whether each is in the first.
fn ordered<'a>(
    axes: &'a [JointAxis],
    workpiece: &str,
    tool: &str,
) -> impl Iterator<Item = (JointAxis, bool)> + use<'a> {
    let both = [(workpiece, true), (tool, false)];
    let letters: Vec<(char, bool)> = both
        .iter()
        .flat_map(|(letters, table)| letters.chars().map(|l| (l, *table)))
        .collect();
    letters.into_iter().filter_map(|(letter, table)| {
        let joint = axes.iter().find(|j| j.letter == letter)?;
        Some((*joint, table))
    })
}

//! HAL lines that install the component in a configuration, and a first description of the machine.

use super::check::{Finding, SLOPE};
use super::configuration::{Configuration, JointAxis};
use super::imported::{self, AxisMotion, Import};
use super::install::PANEL;
use super::kinematics::ModuleShape;
use std::fmt::Write;
use trueaxis_tables::compile::REVERSAL;

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
    let length = hal.signal("motion.tooloffset.z");
    let _ = match length {
        Some(signal) => writeln!(text, "net {signal} => trueaxis.tool-length"),
        None => writeln!(
            text,
            "net trueaxis-tool-length motion.tooloffset.z => trueaxis.tool-length"
        ),
    };
    for (number, pin) in known.temperatures.iter().enumerate() {
        let ours = format!("trueaxis.temperature-{number}");
        let _ = match hal.signal(pin) {
            Some(signal) => writeln!(text, "net {signal} => {ours}"),
            None => writeln!(text, "net trueaxis-temperature-{number} {pin} => {ours}"),
        };
    }
    text += match known.enabled {
        false => {
            "\n# The operator switches the corrections on: from a panel, or with `trueaxis control --hal enable`.\n\
             # They come in slowly, once the axes are homed.\nsetp trueaxis.enable 0\n"
        }
        true => {
            "\n# The corrections come in slowly whenever the axes are homed; the panel and `trueaxis control --hal disable`\n\
             # switch them off.\nsetp trueaxis.enable 1\n"
        }
    };
    text
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
        let _ = match hal.signal(&theirs(from)) {
            Some(signal) => writeln!(text, "net {signal} => {}", ours(to)),
            None => writeln!(
                text,
                "net trueaxis-{number}-{from} {} => {}",
                theirs(from),
                ours(to)
            ),
        };
    }
    let (command, feedback) = (theirs("motor-pos-cmd"), theirs("motor-pos-fb"));
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

/// An axis in the description.
struct DescribedAxis {
    joint: JointAxis,
    branch: &'static str,
    reversed: bool,
    /// Origin (mm), if the module defines it.
    origin: Option<[f64; 3]>,
    remark: &'static str,
}

/// The axes of the machine, and the position of the tool tip along the tool axis.
fn entries(configuration: &Configuration) -> (Vec<DescribedAxis>, f64) {
    let axes = axes(configuration);
    match ModuleShape::of(&configuration.module.name) {
        Some(shape) if shape.tool.is_empty() => table(configuration, &axes, shape),
        Some(shape) => head(configuration, &axes, shape),
        None => plain(&axes),
    }
}

fn machine(
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

fn axis(configuration: &Configuration, entry: &DescribedAxis) -> String {
    let JointAxis { number, letter } = entry.joint;
    let rotary = "ABC".contains(letter);
    let unit = configuration.unit(entry.joint);
    let (unit_name, usual) = if rotary {
        ("deg", 360.0)
    } else {
        ("mm", 1000.0)
    };
    let mut text = String::from("\n[[axis]]\n");
    let mut line = |key: &str, value: String, remark: &str| {
        let remark = if remark.is_empty() {
            String::new()
        } else {
            format!("  # {remark}")
        };
        let _ = writeln!(text, "{key} = {value}{remark}");
    };
    line("name", format!("\"{letter}\""), &format!("joint {number}"));
    line("branch", format!("{:?}", entry.branch), entry.remark);
    if let Some(origin) = entry.origin {
        line("origin_mm", format!("{origin:?}"), "");
    }
    match range(configuration, entry.joint) {
        _ if configuration.is_endless(entry.joint) => {
            line("range", "[-180.0, 180.0]".to_owned(), "an axis without end");
            line("modulo", "true".to_owned(), "");
        }
        // With a margin, so that the soft limits are inside by the largest correction.
        Some((low, high)) => line(
            "range",
            format!(
                "[{:?}, {:?}]",
                rounded(low - margin(rotary)),
                rounded(high + margin(rotary))
            ),
            &format!(
                "the soft limits and {:?} {unit_name} on either side, for the correction",
                margin(rotary)
            ),
        ),
        // Refused before.
        None => {}
    }
    if entry.reversed {
        line(
            "reversed",
            "true".to_owned(),
            "a positive command moves the carriage the negative way",
        );
    }
    // Joints of one axis move together, as the slowest of them can.
    let joints = configuration.axes();
    let positive = |key| {
        let joints = joints.iter().filter(|joint| joint.letter == letter);
        let values = joints.filter_map(|joint| configuration.number(joint.number, key));
        let least = values.filter(|value| *value > 0.0).reduce(f64::min);
        least.map(|value| value * unit)
    };
    if let Some(speed) = positive("MAX_VELOCITY") {
        line(
            "max_speed",
            format!("{:?}", rounded(speed)),
            &format!("{unit_name}/s"),
        );
    }
    if let Some(acceleration) = positive("MAX_ACCELERATION") {
        let unit = format!("{unit_name}/s²");
        line(
            "max_acceleration",
            format!("{:?}", rounded(acceleration)),
            &unit,
        );
        // What the step generator can do in addition.
        let room = positive("STEPGEN_MAXACCEL").map(|most| most - (1.0 + SLOPE) * acceleration);
        if let Some(room) = room.filter(|room| *room < REVERSAL * acceleration) {
            line(
                "max_reversal_acceleration",
                format!("{:?}", rounded(room.max(LEAST_REVERSAL))),
                &format!("{unit}: the rest of STEPGEN_MAXACCEL"),
            );
        }
    }
    // Commands have no noise but the rounding of f32, to 1.2e-7 of their size or less.
    let largest =
        range(configuration, entry.joint).map_or(usual, |(low, high)| low.abs().max(high.abs()));
    let least = f64::from(f32::EPSILON) * largest;
    line(
        "reversal_threshold",
        format!("{:?}", (least * 1e5).ceil() / 1e5),
        unit_name,
    );
    text
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

fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

/// Puts the linear axes with these letters below the table, and the others on the side of the spindle.
fn divide(entries: &mut [DescribedAxis], table: &str) {
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

//! Checks a configuration for which there is no compensation yet.

use super::{Finding, Severity};
use crate::configuration::{
    BASIC_SIM, Configuration, JointAxis, is_degree, millimetres, saved_commands,
};
use crate::formats::ini::{FileLocation, IniEntry, Remark};

/// What [`check`](super::check) would report of the INI file with any compensation of all its axes. What LinuxCNC
/// compensates itself is a warning, because it is imported.
#[must_use]
pub fn beforehand(configuration: &Configuration) -> Vec<Finding> {
    let unsuited = unsuited(configuration);
    if !unsuited.is_empty() {
        return unsuited;
    }
    let mut found = Beforehand(readable(configuration));
    for joint in configuration.axes() {
        found.twice(configuration, joint);
        found.0.extend(wrong_kind(configuration, joint));
        found.limits(configuration, joint);
        found.headroom(configuration, joint);
        found.connected(configuration, joint);
    }
    found.0
}

/// Why no compensation can correct this kind of machine. Changing it is not the remedy, so nothing else need be reported.
#[must_use]
pub fn unfit(configuration: &Configuration) -> Vec<Finding> {
    let mut found = Beforehand(Vec::new());
    let module = &configuration.module;
    let lathe = configuration.ini.get("DISPLAY", "LATHE");
    if let Some(lathe) = lathe.filter(|entry| is_true(&entry.value)) {
        found.refuse(
            &lathe.place,
            "this is a lathe: only machines with axes along X, Y and Z can be compensated"
                .to_owned(),
            "nothing: COMP_FILE and BACKLASH of LinuxCNC itself correct each joint".to_owned(),
        );
    } else if !module.joints_are_axes() {
        let write = match module.name.as_str() {
            "corexykins" => "nothing here: correct programs instead, with trueaxis gcode",
            _ => "nothing: only machines in which each joint is an axis can be compensated",
        };
        found.refuse(
            &module.place,
            format!(
                "under {} joints need not be axes of the machine: the component would add corrections of axes to joints",
                module.name
            ),
            write.to_owned(),
        );
    } else {
        let letters: String = configuration.axes().iter().map(|j| j.letter).collect();
        let spans = ["XU", "YV", "ZW"].map(|axes| letters.contains(|l| axes.contains(l)));
        if spans != [true; 3] {
            found.refuse(
                &module.place,
                format!("the axes {letters} do not move along X, Y and Z: a lathe or a plotter cannot be compensated"),
                "nothing: COMP_FILE and BACKLASH of LinuxCNC itself correct each joint".to_owned(),
            );
        }
    }
    found.0
}

/// Why no compensation can correct this machine as it is configured, or none can be judged.
#[must_use]
pub fn unsuited(configuration: &Configuration) -> Vec<Finding> {
    let mut found = Beforehand(unfit(configuration));
    if !found.0.is_empty() {
        return found.0;
    }
    for (name, place) in &configuration.hal.programs {
        let write = match name.ends_with(BASIC_SIM) {
            true => format!(
                "nothing: start LinuxCNC once with this INI file, so that the program leaves its commands in {}, then try again",
                saved_commands(&configuration.start)
            ),
            false => "nothing: start LinuxCNC with this INI file, and give --running, which reads the HAL that runs".to_owned(),
        };
        found.refuse(
            place,
            format!("{name} is a program: its text does not show what it loads and connects"),
            write,
        );
    }
    found.units(configuration);
    found.0
}

/// Whether a screen of LinuxCNC may take a value for true.
fn is_true(value: &str) -> bool {
    let word = value.split_whitespace().next().unwrap_or("");
    let is_number = word.parse::<f64>().is_ok_and(|value| value != 0.0);
    is_number || ["true", "yes", "on"].contains(&word.to_ascii_lowercase().as_str())
}

/// Keys whose values are numbers, on which checks rest.
const NUMBERS: [&str; 9] = [
    "MIN_LIMIT",
    "MAX_LIMIT",
    "MAX_VELOCITY",
    "MAX_ACCELERATION",
    "STEPGEN_MAXVEL",
    "STEPGEN_MAXACCEL",
    "BACKLASH",
    "COMP_FILE_TYPE",
    "HOME",
];

/// Lines that LinuxCNC does not read, or not in every version, and numbers that are none.
pub(super) fn readable(configuration: &Configuration) -> Vec<Finding> {
    let mut found = Beforehand(Vec::new());
    let remarks = configuration.ini.remarks.iter();
    for Remark {
        place,
        reason,
        write,
    } in remarks.chain(&configuration.hal.remarks)
    {
        found.warn(place, reason.clone(), write.clone());
    }
    for entry in numbers(configuration) {
        let IniEntry {
            section,
            key,
            value,
            place,
        } = entry;
        match entry.number() {
            Some((_, "")) => {}
            Some((number, after)) => found.warn(
                place,
                format!("[{section}]{key} is read as {number}, as LinuxCNC 2.10 does, which ignores `{after}`; LinuxCNC 2.9 refuses the line"),
                format!("{key} = {number}"),
            ),
            None if value.is_empty() && *key == "BACKLASH" => {}
            None => found.refuse(
                place,
                format!("[{section}]{key} is `{value}`, no number"),
                format!("{key} = a number"),
            ),
        }
    }
    for joint in configuration.axes() {
        found.wrapped(configuration, joint);
    }
    found.0
}

/// Entries that are numbers, each once.
fn numbers(configuration: &Configuration) -> Vec<&IniEntry> {
    let joints = configuration.axes();
    let of_joint = joints.iter().flat_map(|joint| {
        NUMBERS.iter().flat_map(|key| {
            [
                configuration.of_joint(joint.number, key),
                configuration.of_axis(*joint, key),
            ]
        })
    });
    let count = configuration.ini.get("KINS", "JOINTS");
    let mut found: Vec<&IniEntry> = Vec::new();
    for entry in of_joint.chain([count]).flatten() {
        if !found.iter().any(|known| std::ptr::eq(*known, entry)) {
            found.push(entry);
        }
    }
    found
}

/// A joint that is linear with a rotary axis, or the other way round.
pub(super) fn wrong_kind(configuration: &Configuration, joint: JointAxis) -> Option<Finding> {
    let JointAxis { number, letter } = joint;
    let expected = if joint.is_rotary() {
        "ANGULAR"
    } else {
        "LINEAR"
    };
    let kind = configuration.of_joint(number, "TYPE")?;
    let is_expected = |word: &str| word.eq_ignore_ascii_case(expected);
    (!is_expected(&kind.value)).then(|| {
        let wrong = || {
            format!(
                "joint {number} has the axis {letter}, which is not {}: a compensation of {letter} is for a joint that is {expected}",
                kind.value
            )
        };
        let reason = with_text(kind, is_expected).unwrap_or_else(wrong);
        Finding::at(
            Severity::Refused,
            &kind.place,
            reason,
            format!("TYPE = {expected}"),
        )
    })
}

/// What is wrong with a word that is right but for text after it, on the same line.
fn with_text(entry: &IniEntry, is_right: impl Fn(&str) -> bool) -> Option<String> {
    let IniEntry {
        section,
        key,
        value,
        ..
    } = entry;
    let (word, text) = value.split_once(char::is_whitespace)?;
    is_right(word).then(|| {
        let text = text.trim_start();
        format!("[{section}]{key} is `{value}`: LinuxCNC takes `{text}` as part of the value")
    })
}

/// What is wrong with a limit that counts as none; nothing if it is no number, which [`readable`] reports.
pub(super) fn missing(limit: Option<&IniEntry>) -> Option<String> {
    let Some(limit) = limit else {
        return Some("is missing".to_owned());
    };
    limit.number()?;
    Some(format!("is {}, farther than any machine goes", limit.value))
}

struct Beforehand(Vec<Finding>);

impl Beforehand {
    fn refuse(&mut self, place: &FileLocation, reason: String, write: String) {
        self.0
            .push(Finding::at(Severity::Refused, place, reason, write));
    }

    fn warn(&mut self, place: &FileLocation, reason: String, write: String) {
        self.0
            .push(Finding::at(Severity::Warning, place, reason, write));
    }

    fn units(&mut self, configuration: &Configuration) {
        if configuration.mm.is_none() {
            let entry = configuration.ini.get("TRAJ", "LINEAR_UNITS");
            let place = entry.map_or(configuration.section("TRAJ"), |e| &e.place);
            let reason = entry.and_then(|e| with_text(e, |word| millimetres(word).is_some()));
            let neither = || "[TRAJ]LINEAR_UNITS says neither mm nor inch".to_owned();
            self.refuse(
                place,
                reason.unwrap_or_else(neither),
                "LINEAR_UNITS = mm or inch".to_owned(),
            );
        }
        let rotary = configuration.axes().iter().any(|joint| joint.is_rotary());
        if let Some(entry) = configuration.ini.get("TRAJ", "ANGULAR_UNITS")
            && rotary
            && !configuration.in_degrees()
        {
            let other = || {
                format!(
                    "rotary joints are in {}, corrections in degrees",
                    entry.value
                )
            };
            self.refuse(
                &entry.place,
                with_text(entry, is_degree).unwrap_or_else(other),
                "ANGULAR_UNITS = degree".to_owned(),
            );
        }
    }

    /// A joint whose drive is not found gets no correction.
    fn connected(&mut self, configuration: &Configuration, joint: JointAxis) {
        for pin in ["motor-pos-cmd", "motor-pos-fb"] {
            let pin = format!("joint.{}.{pin}", joint.number);
            if configuration.hal.signal(&pin).is_none() {
                self.refuse(
                    &configuration.start,
                    format!(
                        "{pin} is not connected by any HAL file: the drive of {} is unknown",
                        joint.letter
                    ),
                    format!("net SIGNAL {pin}, with the drive, in a HAL file"),
                );
            }
        }
    }

    /// Both are applied beside any compensation.
    fn twice(&mut self, configuration: &Configuration, joint: JointAxis) {
        let JointAxis { number, letter } = joint;
        let kept = configuration.kept(letter);
        if !kept.is_empty() {
            for (_, entry) in kept.iter().filter(|(of, _)| *of == joint) {
                self.warn(
                    &entry.place,
                    format!("{} of joint {number} stays with LinuxCNC: the joints of {letter} differ, and a compensation has one correction for all", entry.key),
                    format!("nothing: measure {letter} with it"),
                );
            }
            return;
        }
        if let Some(file) = configuration.compensated(number, "COMP_FILE") {
            self.warn(
                &file.place,
                format!("joint {number} would be compensated twice: by COMP_FILE, and by the compensation of {letter}"),
                format!("# COMP_FILE = {}", file.value),
            );
        }
        if let Some(backlash) = configuration.compensated(number, "BACKLASH") {
            self.warn(
                &backlash.place,
                format!("joint {number} would be compensated twice: by BACKLASH, and by a compensation with E{letter}{letter}b"),
                "BACKLASH = 0".to_owned(),
            );
        }
    }

    /// A rotary axis whose words mean angles in one version of LinuxCNC and positions in another, or in none what is written.
    fn wrapped(&mut self, configuration: &Configuration, joint: JointAxis) {
        let entry = configuration.of_axis(joint, "WRAPPED_ROTARY");
        let Some(IniEntry {
            section,
            value,
            place,
            ..
        }) = entry.filter(|_| joint.is_rotary())
        else {
            return;
        };
        // 2.9 reads a whole number, 2.10 a word; for both, the value ends with the line.
        let number = value.parse::<i32>().ok().map(|number| number != 0);
        let word = match value.to_ascii_lowercase().as_str() {
            "true" | "yes" | "1" | "on" => Some(true),
            "false" | "no" | "0" | "off" => Some(false),
            _ => None,
        };
        let [old, new] = [number, word].map(Option::unwrap_or_default);
        if old != new || (number, word) == (None, None) {
            self.warn(
                place,
                format!("[{section}]WRAPPED_ROTARY is `{value}`: LinuxCNC 2.9 reads it as {old}, 2.10 as {new}"),
                "WRAPPED_ROTARY = 1, or 0".to_owned(),
            );
        }
    }

    /// Without limits the tables have no ends.
    fn limits(&mut self, configuration: &Configuration, joint: JointAxis) {
        if configuration.is_endless(joint) {
            return;
        }
        let JointAxis { number, letter } = joint;
        let section = format!("JOINT_{number}");
        let limit = |key| configuration.limit(joint, key);
        for key in ["MIN_LIMIT", "MAX_LIMIT"] {
            if limit(key).is_some() {
                continue;
            }
            let entry = configuration.of_joint(number, key);
            let Some(is) = missing(entry) else { continue };
            self.refuse(
                entry.map_or(configuration.section(&section), |e| &e.place),
                format!(
                    "{key} of joint {number} {is}, and a compensation of {letter} covers its travel"
                ),
                format!("{key} = the end of the travel of {letter}"),
            );
        }
        if let (Some((low, _)), Some((high, entry))) = (limit("MIN_LIMIT"), limit("MAX_LIMIT"))
            && low >= high
        {
            self.refuse(
                &entry.place,
                format!("joint {number} has no travel: MIN_LIMIT is {low}, MAX_LIMIT {high}"),
                format!("MAX_LIMIT above {low}"),
            );
        }
    }

    /// Corrections come on top of the motion that is planned.
    fn headroom(&mut self, configuration: &Configuration, joint: JointAxis) {
        for (key, of) in [
            ("STEPGEN_MAXVEL", "MAX_VELOCITY"),
            ("STEPGEN_MAXACCEL", "MAX_ACCELERATION"),
        ] {
            let number = |key| configuration.number(joint.number, key);
            if let (Some(most), Some(planned)) = (number(key), number(of))
                && most <= planned
                && let Some(entry) = configuration.of_joint(joint.number, key)
            {
                self.refuse(
                    &entry.place,
                    format!("{key} of joint {} leaves nothing above {of}, {planned}: corrections come on top", joint.number),
                    format!("{key} = {}", planned * ROOM),
                );
            }
        }
    }
}

/// Usual headroom of step generators; what a compensation needs is known when it is compiled.
const ROOM: f64 = 1.25;

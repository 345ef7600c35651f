//! Checks a configuration for which there is no compensation yet.

use super::{Finding, Severity};
use crate::formats::ini::FileLocation;
use crate::linuxcnc::configuration::{Configuration, Joint};

/// What [`check`](super::check) would report of the INI file with any compensation of all its axes.
#[must_use]
pub fn beforehand(configuration: &Configuration) -> Vec<Finding> {
    let mut found = Found(Vec::new());
    found.units(configuration);
    for joint in configuration.axes() {
        found.twice(configuration, joint);
        found.kind(configuration, joint);
        found.limits(configuration, joint);
        found.headroom(configuration, joint);
    }
    found.0
}

struct Found(Vec<Finding>);

impl Found {
    fn refuse(&mut self, place: &FileLocation, reason: String, write: String) {
        self.0
            .push(Finding::at(Severity::Refused, place, reason, write));
    }

    fn units(&mut self, configuration: &Configuration) {
        if configuration.mm.is_none() {
            let entry = configuration.ini.get("TRAJ", "LINEAR_UNITS");
            let place = entry.map_or(configuration.section("TRAJ"), |e| &e.place);
            self.refuse(
                place,
                "[TRAJ]LINEAR_UNITS says neither mm nor inch".to_owned(),
                "LINEAR_UNITS = mm".to_owned(),
            );
        }
        let rotary = configuration.axes().iter().any(|joint| joint.is_rotary());
        if let Some(entry) = configuration.ini.get("TRAJ", "ANGULAR_UNITS")
            && rotary
            && !entry.value.to_ascii_lowercase().starts_with("deg")
        {
            self.refuse(
                &entry.place,
                format!(
                    "rotary joints are in {}, corrections in degrees",
                    entry.value
                ),
                "ANGULAR_UNITS = degree".to_owned(),
            );
        }
    }

    /// Both are applied beside any compensation.
    fn twice(&mut self, configuration: &Configuration, joint: Joint) {
        let Joint { number, letter } = joint;
        if let Some(file) = configuration.compensated(number, "COMP_FILE") {
            self.refuse(
                &file.place,
                format!("joint {number} would be compensated twice: by COMP_FILE, and by the compensation of {letter}"),
                format!("# COMP_FILE = {}", file.value),
            );
        }
        if let Some(backlash) = configuration.compensated(number, "BACKLASH") {
            self.refuse(
                &backlash.place,
                format!("joint {number} would be compensated twice: by BACKLASH, and by a compensation with E{letter}{letter}b"),
                "BACKLASH = 0".to_owned(),
            );
        }
    }

    fn kind(&mut self, configuration: &Configuration, joint: Joint) {
        let expected = if joint.is_rotary() {
            "ANGULAR"
        } else {
            "LINEAR"
        };
        if let Some(kind) = configuration.of_joint(joint.number, "TYPE")
            && !kind.value.eq_ignore_ascii_case(expected)
        {
            let Joint { number, letter } = joint;
            self.refuse(
                &kind.place,
                format!(
                    "joint {number} has the axis {letter}, which is not {}",
                    kind.value
                ),
                format!("TYPE = {expected}"),
            );
        }
    }

    /// Without limits the tables have no ends.
    fn limits(&mut self, configuration: &Configuration, joint: Joint) {
        let Joint { number, letter } = joint;
        let section = format!("JOINT_{number}");
        for (key, example) in [("MIN_LIMIT", -100), ("MAX_LIMIT", 100)] {
            if configuration.number(number, key).is_some() {
                continue;
            }
            let entry = configuration.of_joint(number, key);
            let is = match entry {
                Some(entry) => format!("is `{}`, no number", entry.value),
                None => "is missing".to_owned(),
            };
            self.refuse(
                entry.map_or(configuration.section(&section), |e| &e.place),
                format!(
                    "{key} of joint {number} {is}, and a compensation of {letter} covers its travel"
                ),
                format!("{key} = {example}, the end of the travel"),
            );
        }
        let limit = |key| configuration.number(number, key);
        if let (Some(low), Some(high)) = (limit("MIN_LIMIT"), limit("MAX_LIMIT"))
            && low >= high
            && let Some(entry) = configuration.of_joint(number, "MAX_LIMIT")
        {
            self.refuse(
                &entry.place,
                format!("joint {number} has no travel: MIN_LIMIT is {low}, MAX_LIMIT {high}"),
                format!("MAX_LIMIT above {low}"),
            );
        }
    }

    /// Corrections come on top of the motion that is planned.
    fn headroom(&mut self, configuration: &Configuration, joint: Joint) {
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

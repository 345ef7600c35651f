//! Checks a compensation against the configuration of a machine.

mod beforehand;
mod connections;
mod functions;
mod joints;
mod topology;

pub use beforehand::{beforehand, unfit, unsuited};

use crate::configuration::{Configuration, JointAxis, word};
use crate::formats::hal::HalCommand;
use crate::formats::ini::FileLocation;
use serde::Serialize;
use std::fmt::{self, Display, Formatter};
use trueaxis::Axis;
use trueaxis_model::machine::Machine;
use trueaxis_model::validate::Runtime;
use trueaxis_tables::reversal::{Reversal, reversals};

/// Part of an acceleration that the slope of a correction adds to it, at most, on usual machines.
pub(crate) const SLOPE: f64 = 0.02;

/// Severity of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// The machine must not be run in this state.
    Refused,
    /// To be checked by the user.
    Warning,
}

/// One finding.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// Severity of the finding.
    pub severity: Severity,
    /// The file to change.
    pub file: String,
    /// The line concerned.
    pub line: usize,
    /// What is wrong.
    pub reason: String,
    /// What to write there.
    pub write: String,
}

impl Finding {
    fn at(severity: Severity, place: &FileLocation, reason: String, write: String) -> Self {
        Self {
            severity,
            file: place.source.name.clone(),
            line: place.line(),
            reason,
            write,
        }
    }
}

impl Display for Finding {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let severity = match self.severity {
            Severity::Refused => "refused",
            Severity::Warning => "warning",
        };
        let Self {
            file,
            line,
            reason,
            write,
            ..
        } = self;
        write!(
            f,
            "{severity}: {file}, line {line}: {reason}\n  write: {write}"
        )
    }
}

/// What a configuration is checked against.
#[derive(Clone, Copy)]
pub struct Against<'a> {
    /// The compensation.
    pub runtime: &'a Runtime<'a>,
    /// Whether a path in the configuration leads to it; `None` if unknown.
    pub is_file: &'a dyn Fn(&str) -> Option<bool>,
    /// The machine description, if available.
    pub machine: Option<&'a Machine>,
}

/// State of the checks.
struct CheckState<'a> {
    configuration: &'a Configuration,
    against: Against<'a>,
    /// The line that loads the component.
    component: Option<&'a HalCommand>,
    /// How axes with backlash make it up.
    reversals: Vec<Reversal>,
    findings: Vec<Finding>,
}

/// All findings, in the order of the checks.
#[must_use]
pub fn check(configuration: &Configuration, against: Against<'_>) -> Vec<Finding> {
    let mut checked = CheckState {
        configuration,
        against,
        component: configuration.hal.load("trueaxis"),
        reversals: reversals(against.runtime),
        findings: Vec::new(),
    };
    checked.findings = unsuited(configuration);
    if !checked.findings.is_empty() {
        return checked.findings;
    }
    checked.findings = beforehand::readable(configuration);
    let joints = checked.component();
    checked.units();
    checked.topology();
    for joint in &joints {
        checked.joint(*joint);
    }
    if checked.component.is_some() {
        checked.functions();
        for joint in &joints {
            checked.connections(*joint);
        }
        checked.inputs();
    }
    checked.findings
}

impl<'a> CheckState<'a> {
    fn add(&mut self, severity: Severity, place: &FileLocation, reason: String, write: String) {
        self.findings
            .push(Finding::at(severity, place, reason, write));
    }

    fn refuse(&mut self, place: &FileLocation, reason: String, write: String) {
        self.add(Severity::Refused, place, reason, write);
    }

    fn warn(&mut self, place: &FileLocation, reason: String, write: String) {
        self.add(Severity::Warning, place, reason, write);
    }

    fn axis(&self, letter: char) -> Option<(usize, &'a Axis)> {
        let axes = self.against.runtime.compensation().axes();
        let index = axes.iter().position(|a| char::from(a.name) == letter)?;
        Some((index, &axes[index]))
    }

    /// Letters of the compensation's axes.
    fn letters(&self) -> String {
        let axes = self.against.runtime.compensation().axes().iter();
        axes.map(|a| char::from(a.name)).collect()
    }

    /// Checks the line that loads the component; returns the joints with an axis of the compensation.
    fn component(&mut self) -> Vec<JointAxis> {
        let configuration = self.configuration;
        let known = configuration.module.letters.clone();
        let Some(loaded) = self.component else {
            let units = configuration.unit_word();
            self.refuse(
                &configuration.section("HAL").clone(),
                "the component trueaxis is not loaded".to_owned(),
                format!("loadrt trueaxis file=FILE.trax axes={known} units={units}"),
            );
            return self.covered(&known);
        };
        let place = loaded.place.clone();
        let given = loaded.parameter("axes").unwrap_or("").to_owned();
        let letters = self.letters();
        if let Some(none) = letters.chars().find(|l| !given.contains(*l)) {
            self.refuse(
                &place,
                format!("axes={given} has no joint for the axis {none} of the compensation, whose axes are {letters}"),
                format!("axes={known}"),
            );
        }
        self.joints_named(&given, &known, &letters, &place);
        let file = loaded.parameter("file").unwrap_or("");
        if (self.against.is_file)(file) == Some(false) {
            self.warn(
                &place,
                format!("file={file} is another file than the one that is checked"),
                "file= with the path of that".to_owned(),
            );
        }
        self.covered(&given)
    }

    /// The letters of axes= against those of the module (`known`) and of the compensation (`letters`).
    fn joints_named(&mut self, given: &str, known: &str, letters: &str, place: &FileLocation) {
        let configuration = self.configuration;
        for (number, letter) in given.chars().enumerate() {
            let expected = known.chars().nth(number);
            if letter != '-' && !letters.contains(letter) {
                self.refuse(
                    place,
                    format!("joint {number} has the axis {letter} in axes={given}, which the compensation does not have: its axes are {letters}"),
                    "axes= with - for this joint, if it is not to be corrected".to_owned(),
                );
            } else if letter != '-' && expected.is_some_and(|e| e != letter) {
                let expected = expected.unwrap_or(' ');
                self.refuse(
                    place,
                    format!("joint {number} has the axis {letter} in axes={given}, but {expected} in {}", configuration.module.name),
                    format!("axes={known}"),
                );
            } else if number >= configuration.joints {
                self.refuse(
                    place,
                    format!(
                        "axes={given} names more joints than [KINS]JOINTS, {}",
                        configuration.joints
                    ),
                    format!("axes={known}"),
                );
                break;
            }
        }
    }

    /// Joints with an axis of the compensation.
    fn covered(&self, letters: &str) -> Vec<JointAxis> {
        let joints = letters.chars().enumerate().take(self.configuration.joints);
        let joints = joints.map(|(number, letter)| JointAxis { number, letter });
        joints.filter(|j| self.axis(j.letter).is_some()).collect()
    }

    fn units(&mut self) {
        let configuration = self.configuration;
        if let Some(loaded) = self.component {
            let said = loaded.parameter("units").and_then(word);
            if said.is_none() || configuration.mm.is_some_and(|mm| Some(mm) != said) {
                self.refuse(
                    &loaded.place.clone(),
                    "units= is not what [TRAJ]LINEAR_UNITS says".to_owned(),
                    format!("units={}", configuration.unit_word()),
                );
            }
        }
    }
}

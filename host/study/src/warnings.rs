//! What to check before the parameters are trusted.

use crate::{StudyOutcome, runs};
use serde::{Deserialize, Serialize};
use std::fmt;
use trueaxis_identify::formats::observations::Observation;
use trueaxis_identify::{
    Contradicted, Lacking, Model, Stated, VarianceComponent, contradicted, lacks, repeated,
};
use trueaxis_model::errors::{Parameter, ParameterKind};

/// Something to check.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StudyWarning {
    /// What it is about.
    pub kind: WarningKind,
    /// Cause and remedy.
    pub message: String,
}

/// What a warning is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WarningKind {
    /// Rows that do not fit the others.
    Outliers,
    /// What runs show besides their motions.
    Runs,
    /// An error motion that the model lacks.
    LacksMotion,
    /// Location errors that the model lacks.
    LacksLocations,
    /// Rows that fit badly one by one.
    FitBadly,
    /// A stated place or length of a set-up that the other measurements contradict.
    Contradicted,
    /// Readings that were copied, or are all the same.
    Repeated,
    /// Residuals that the stated uncertainty does not explain.
    Misstated,
    /// The stylus is not quite where it is stated to be, or takes up errors of the machine.
    Stylus,
    /// A ball with a single row.
    ProbedOnce,
    /// A bar of which a ball was not probed.
    BarNotProbed,
    /// A bar whose length does not fit.
    BarLength,
    /// Residuals that follow time, temperature, runs or directions.
    Trend,
    /// Residuals larger than the repeatability.
    Repeatability,
}

impl fmt::Display for StudyWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

/// Do not print more names than fit on a command line.
const NAMES: usize = 40;

/// A stylus found farther than this (mm) from its stated place may show an error of the machine: it is measured, in the
/// spindle or on a presetter, to a few micrometres.
const AS_STATED: f64 = 5e-3;

impl StudyOutcome<'_> {
    /// All warnings, the gravest first.
    #[must_use]
    pub fn warnings(&self) -> Vec<StudyWarning> {
        use WarningKind as Kind;
        let mut all = Vec::new();
        let mut warn = |kind: Kind, messages: Vec<String>| {
            let one = |message| StudyWarning { kind, message };
            all.extend(messages.into_iter().map(one));
        };
        let outliers = self.outliers.iter();
        let identified = &self.identified;
        warn(
            Kind::Outliers,
            outliers.map(|(_, sentence)| sentence.clone()).collect(),
        );
        let kept = self.kept.as_ref();
        warn(
            Kind::Runs,
            kept.map_or(Vec::new(), |kept| runs::doubts(self.runs, kept)),
        );
        let lacking = self.lacking.iter();
        warn(
            Kind::LacksMotion,
            lacking.map(|one| self.bends(one)).collect(),
        );
        if !self.missing.is_empty() {
            let looked_for = &identified.looked_for;
            let lacks = lacks(self.machine, looked_for, &self.missing);
            warn(Kind::LacksLocations, vec![lacks]);
        }
        warn(Kind::FitBadly, self.probings_that_fit_badly());
        let wrong = contradicted(identified);
        warn(
            Kind::Contradicted,
            wrong.iter().map(Contradicted::sentence).collect(),
        );
        let copies = repeated(&self.observations, identified);
        let copies = copies.iter().map(|one| one.sentence(&self.observations));
        warn(Kind::Repeated, copies.collect());
        warn(Kind::Repeated, self.always_the_same());
        // Wrong readings make the residuals of a whole source larger.
        if self.outliers.is_empty() {
            let wrong = (identified.components.iter()).filter(|one| one.is_misstated());
            warn(Kind::Misstated, wrong.map(misstated).collect());
        }
        warn(Kind::FitBadly, self.observations_that_fit_badly());
        warn(Kind::Stylus, self.stylus());
        warn(Kind::ProbedOnce, self.probed_once());
        warn(Kind::BarNotProbed, self.bars_not_probed());
        warn(Kind::BarLength, self.bars_of_other_length());
        let checks = self.honesty.checks.iter();
        warn(
            Kind::Trend,
            checks.filter_map(|check| check.warning()).collect(),
        );
        warn(
            Kind::Trend,
            self.honesty.alike_warning().into_iter().collect(),
        );
        if let Some(repeats) = self.honesty.repeats.filter(|repeats| repeats.is_less) {
            let message = format!(
                "the residuals are {:.1} times the repeatability: the machine does something that the model lacks; try --model auto, or a model with more parameters",
                repeats.ratio
            );
            warn(Kind::Repeatability, vec![message]);
        }
        all
    }

    /// A sentence about a motion that the model lacks.
    fn bends(&self, one: &Lacking) -> String {
        let explains = format!(
            "the model lacks a motion: {one}, which explains {:.0} % of the residuals (squares)",
            one.explains * 1e2
        );
        if !one.others.is_empty() {
            let others: Vec<String> = one.others.iter().map(motion).collect();
            return format!(
                "{explains}; so would {}: these measurements do not tell which it is, so measure them directly with runs",
                others.join(", ")
            );
        }
        let seen = self.identified.parameters.iter().map(|e| e.parameter);
        let all: Vec<Parameter> = seen.chain(one.parameters.iter().copied()).collect();
        let add: Vec<String> = one.parameters.iter().map(Parameter::to_string).collect();
        let how = match all.len() <= NAMES {
            true => format!("give --model {}", Model::Named(all)),
            false => format!("add {} to the model", add.join(",")),
        };
        format!("{explains}; {how}, or measure it directly with runs")
    }

    fn probings_that_fit_badly(&self) -> Vec<String> {
        let rows = &self.probings.rows;
        let untrusted: Vec<String> = (rows.iter().zip(&self.identified.rows).enumerate())
            .filter(|(number, (_, found))| !found.is_trusted && !self.is_outlier(*number))
            .map(|(_, (row, _))| row.line.to_string())
            .collect();
        if untrusted.is_empty() || self.is_explained() {
            return Vec::new();
        }
        vec![format!(
            "{} of {} rows fit badly (lines {}): look at their readings, leave them out (--without), or let them count less (--robust)",
            untrusted.len(),
            rows.len(),
            untrusted.join(", ")
        )]
    }

    fn observations_that_fit_badly(&self) -> Vec<String> {
        let outliers = |number: usize| {
            let mut all = self.outliers.iter();
            all.any(|(outlier, _)| outlier.observations.contains(&number))
        };
        let all = &self.observations;
        let rows = all.rows.iter().zip(&self.identified.observed).enumerate();
        let untrusted = rows.filter(|(number, (_, after))| !after.is_trusted && !outliers(*number));
        let untrusted: Vec<String> = untrusted
            .map(|(_, (row, _))| format!("{} line {}", all.files[row.file], row.line))
            .collect();
        if untrusted.is_empty() || self.is_explained() {
            return Vec::new();
        }
        vec![format!(
            "{} of {} observations fit badly ({}): look at their readings, leave them out (--without), or let them count less (--robust)",
            untrusted.len(),
            all.rows.len(),
            untrusted.join(", ")
        )]
    }

    /// Set-ups of several positions with one and the same reading.
    fn always_the_same(&self) -> Vec<String> {
        let all = &self.observations;
        let same = all.setups.iter().enumerate().filter_map(|(index, setup)| {
            let own = all.rows.iter().filter(|row| row.setup == index);
            let own: Vec<&Observation> = own.collect();
            let first = own.first()?;
            let is_same = own.iter().all(|row| row.value == first.value);
            let moves = own.iter().any(|row| row.position != first.position);
            (is_same && moves && own.len() > 2).then(|| {
                format!(
                    "all {} readings of {} are the same: no machine is as good, look whether the instrument was read",
                    own.len(),
                    setup.name
                )
            })
        });
        same.collect()
    }

    fn stylus(&self) -> Vec<String> {
        let stylus = self.places.iter().find(|one| one.what == "stylus");
        let apart = stylus.and_then(Stated::distance).unwrap_or(0.0);
        if apart <= AS_STATED || self.not_known.hidden.is_empty() {
            return Vec::new();
        }
        let hidden = Model::Named(self.not_known.hidden.clone());
        vec![format!(
            "the stylus was found {:.1} µm from its stated place: these probings cannot tell that from {hidden}, errors of the machine that stay when another tool is used; qualify the probe and give --probe, or state the place of the stylus with its uncertainty in the artefact",
            apart * 1e3
        )]
    }

    fn probed_once(&self) -> Vec<String> {
        let balls = self.probings.balls.iter().enumerate();
        let once = balls.filter_map(|(ball, name)| {
            let rows = self.probings.rows.iter().filter(|row| row.ball == ball);
            let mut lines = rows.map(|row| row.line);
            let (Some(line), None) = (lines.next(), lines.next()) else {
                return None;
            };
            Some(format!(
                "line {line}: ball {name} was probed only once, which shows only where it is: probe it at other rotary positions too; if it is a different ball, correct the name"
            ))
        });
        once.collect()
    }

    fn bars_not_probed(&self) -> Vec<String> {
        let is_probed = |name: &String| self.probings.balls.contains(name);
        let ends = self.artefact.bars.iter();
        let ends = ends.flat_map(|bar| bar.balls.iter().map(move |ball| (bar, ball)));
        ends.filter(|(_, ball)| !is_probed(ball))
            .map(|(bar, ball)| {
                format!(
                    "the bar from {} to {} does not count: ball {ball} was not probed under this name",
                    bar.balls[0], bar.balls[1]
                )
            })
            .collect()
    }

    fn bars_of_other_length(&self) -> Vec<String> {
        let bars = self.identified.bars.iter().filter(|bar| bar.is_doubtful());
        bars.map(|bar| {
            let others = bar.others.map_or(0.0, |others| others.length);
            format!(
                "the bar from {} to {} is {:.4} mm in the artefact, but the machine and the other bars make it {others:.4} mm: look which is wrong, and leave it out",
                bar.balls[0], bar.balls[1], bar.length
            )
        })
        .collect()
    }
}

fn misstated(one: &VarianceComponent) -> String {
    let name = one.source.name();
    let factor = one.of_stated.unwrap_or(1.0);
    let what = format!(
        "the residuals of the {name} are {factor:.2} times the uncertainty that their file states, and chance does not explain that"
    );
    match one.is_refuted {
        true => format!(
            "{what}: either the machine has errors that the model lacks, which are not in the uncertainties of its parameters, or the stated uncertainty is too small. Try --model auto, or correct the uncertainty"
        ),
        false => format!(
            "{what}: correct the uncertainty of the {name}, or leave it out so that it is found from the residuals"
        ),
    }
}

/// The name of an error motion without its degree, or of another parameter.
fn motion(parameter: &Parameter) -> String {
    let name = parameter.to_string();
    match parameter.kind {
        ParameterKind::Inter | ParameterKind::Backlash => name,
        _ => name[..3].to_owned(),
    }
}

//! An identification as programs read it: what `identify --json` prints, and what a report shows.

mod observed;
mod of;
mod probed;

pub use observed::{
    CycleRecord, DriftRecord, NoiseRecord, ObservedRecord, PartStated, ReadingRecord,
    SetupPartRecord, SetupRecord, TemperaturesRecord, ThermalRecord,
};

use crate::StudyWarning;
use serde::{Deserialize, Serialize};
use trueaxis_identify::TrendAlong;

/// The results. Parameters are in mm, rad, and per mm or rad to the power of their degree; other names state their
/// units. Files of older versions lack what has a default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identification {
    /// Name of the machine.
    pub machine: String,
    /// Number of probings.
    pub probings: usize,
    /// The range that each axis covered.
    pub probed: Vec<Probed>,
    /// The balls, where they were found.
    pub balls: Vec<BallRecord>,
    /// The tip in the spindle frame.
    #[serde(default)]
    pub stylus_mm: [f64; 3],
    /// The parameters found.
    pub parameters: Vec<EstimateRecord>,
    /// Pairs of parameters whose correlation is above 0.9.
    pub correlations: Vec<(String, String, f64)>,
    /// Of the parameters, in their order.
    #[serde(default)]
    pub covariance: Vec<Vec<f64>>,
    /// Bars, compared with the machine and the other bars.
    #[serde(default)]
    pub bars: Vec<BarRecord>,
    /// Instruments, and drift; nothing if there are only probings that do not drift.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub observed: Option<ObservedRecord>,
    /// What temperatures explain, if any were given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperatures: Option<TemperaturesRecord>,
    /// Comparison with the errors before a compensation.
    #[serde(default)]
    pub compensated: Option<Compared>,
    /// Unknowns that could not be identified.
    pub unseen: Vec<NotSeen>,
    /// Standard deviation of a coordinate.
    pub noise_um: f64,
    /// The residuals in units of the stated uncertainty, if the file states it for all rows.
    #[serde(default)]
    pub noise_of_stated: Option<f64>,
    /// Standard deviation of a coordinate of the tip by errors that the model lacks, in the probed zone.
    #[serde(default)]
    pub misfit_um: Option<f64>,
    /// Like `misfit_um`, of a component of the tool's direction.
    pub misfit_urad: Option<f64>,
    /// Sources whose residuals exceed what they state, beyond chance.
    #[serde(default)]
    pub refuted: Vec<String>,
    /// Equations in excess of unknowns.
    pub degrees_of_freedom: usize,
    /// Condition number of the scaled problem.
    pub condition: f64,
    /// The models that were tried, for `auto`.
    #[serde(default)]
    pub levels: Vec<LevelRecord>,
    /// For `auto`: the list published for machines of this layout.
    #[serde(default)]
    pub published: Option<PublishedRecord>,
    /// Prediction of balls that were left out.
    pub held_out: Option<HeldOutRecord>,
    /// Why there is no such prediction.
    #[serde(default)]
    pub not_held_out: Option<String>,
    /// Residuals along the axes of the workpiece frame (rms).
    pub left_um: [f64; 3],
    /// Whether the residuals depend on time, temperature, run or direction.
    pub checks: Vec<CheckRecord>,
    /// Repeatability, if anything was measured more than once.
    #[serde(default)]
    pub repeats: Option<RepeatsRecord>,
    /// Balls and stylus, found and as stated.
    #[serde(default)]
    pub places: Vec<PlaceRecord>,
    /// Rows that do not fit the others.
    pub outliers: Vec<StatedOutlier>,
    /// Each probing.
    pub rows: Vec<RowRecord>,
    /// What to check before the parameters are trusted.
    #[serde(default)]
    pub warnings: Vec<StudyWarning>,
}

/// Which positions of an axis were measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Probed {
    /// Letter of the axis.
    pub axis: char,
    /// Smallest and largest position (mm, deg).
    pub range: [f64; 2],
    /// Errors that repeat so that the measured positions hardly show them; `None` in files of older versions, which do not
    /// say.
    #[serde(default)]
    pub hidden: Option<Vec<Hidden>>,
    /// The widest stretch without a position, if it is more than a fifth of the range.
    #[serde(default)]
    pub gap: Option<[f64; 2]>,
}

/// Errors of an axis that its measured positions hardly show.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hidden {
    /// The error motions that were measured at these positions, `EXX`.
    pub motions: Vec<String>,
    /// The longest four distances (mm, deg) within which they may repeat, from a lead of 40 mm or 10° down to 1 mm or 1°.
    pub periods: Vec<f64>,
}

/// A ball.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BallRecord {
    /// Name in the file of probings.
    pub name: String,
    /// Centre in the workpiece frame.
    #[serde(default)]
    pub place_mm: [f64; 3],
    /// Number of probings.
    pub probings: usize,
    /// Residual, rms.
    pub left_um: f64,
    /// Largest residual.
    pub most_um: f64,
}

/// A ball or the stylus.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlaceRecord {
    /// `ball 1`, or `stylus`.
    pub what: String,
    /// Where it was found: balls in the workpiece frame, the stylus in the spindle frame.
    pub found_mm: [f64; 3],
    /// Where it was stated to be, if it was.
    pub stated_mm: Option<[f64; 3]>,
}

/// A parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EstimateRecord {
    /// Name of the parameter.
    pub parameter: String,
    /// In mm, rad, per mm or rad to the power of its degree.
    pub value: f64,
    /// Of the value, in the same unit.
    pub standard_uncertainty: f64,
    /// With k = 2.
    pub expanded_uncertainty: f64,
}

/// A bar, with its length according to the machine and the other bars.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BarRecord {
    /// The balls at the ends.
    pub balls: [String; 2],
    /// The length in the artefact.
    pub length_mm: f64,
    /// As the artefact states it.
    pub standard_uncertainty_mm: f64,
    /// The length by everything else.
    pub others_mm: Option<f64>,
    /// Of the length by everything else.
    pub others_standard_uncertainty_mm: Option<f64>,
    /// The difference in standard deviations.
    pub normalised: Option<f64>,
    /// True if chance does not explain the difference.
    pub is_doubtful: bool,
}

/// An unknown that could not be identified.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NotSeen {
    /// Name of the unknown.
    pub unknown: String,
    /// The reason.
    pub sentence: String,
    /// The errors of other unknowns per unit of this one.
    #[serde(default)]
    pub with: Vec<(String, f64)>,
    /// A probing that would identify it.
    pub add: Option<String>,
}

/// A model that was tried.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LevelRecord {
    /// What was tried.
    pub model: String,
    /// Number of parameters that can be identified.
    pub parameters: Option<usize>,
    /// Number of those that cannot.
    pub unseen: Option<usize>,
    /// Residual where it was fitted.
    pub left_um: Option<f64>,
    /// How far off it is elsewhere.
    pub elsewhere_um: Option<f64>,
    /// Why there is no such model.
    pub error: Option<String>,
}

/// A published list compared with the chosen model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PublishedRecord {
    /// Name of the list.
    pub model: String,
    /// Number of coefficients.
    pub coefficients: usize,
    /// How many of them the measurements show.
    pub seen: Option<usize>,
    /// Residual with the list.
    pub left_um: Option<f64>,
    /// How far off it is elsewhere.
    pub elsewhere_um: Option<f64>,
    /// Why it cannot be identified.
    pub error: Option<String>,
    /// Coefficients that the chosen model has, too.
    pub kept: Vec<String>,
    /// Each with the reason: confounded, idle, constant, degree, form.
    pub missing: Vec<(String, String)>,
    /// Parameters of the chosen model alone.
    pub besides: Vec<String>,
    /// True if both describe the same errors.
    pub is_same: bool,
}

/// Prediction of balls by models that were fitted without them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HeldOutRecord {
    /// Over all balls, rms.
    pub rms_um: f64,
    /// Of each ball.
    #[serde(default)]
    pub balls: Vec<(String, f64)>,
}

/// Whether the residuals depend on something.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CheckRecord {
    /// `time_s`, `order`, `temperature_C`, `run` or `direction`.
    pub along: String,
    /// The axis, for a direction.
    pub axis: Option<char>,
    /// The run, if that is what it depends on.
    pub run: Option<f64>,
    /// Time (s) or temperature (K) over which it changes.
    pub over: Option<f64>,
    /// The change in the workpiece frame.
    pub change_um: Option<[f64; 3]>,
    /// Of the change.
    pub standard_uncertainty_um: Option<[f64; 3]>,
    /// True if it exceeds chance.
    pub is_significant: bool,
}

/// Repeatability.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RepeatsRecord {
    /// Number of places that were probed again.
    #[serde(default)]
    pub places: usize,
    /// Of the standard deviation.
    #[serde(default)]
    pub degrees_of_freedom: usize,
    /// Of a coordinate.
    #[serde(default)]
    pub pooled_standard_deviation_um: f64,
    /// The residuals divided by it.
    #[serde(default)]
    pub ratio: f64,
    /// True if it is smaller than the residuals, beyond chance.
    pub is_less: bool,
}

/// Rows that do not fit the others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StatedOutlier {
    /// Cause and remedy.
    pub sentence: String,
    /// True if it concerns more than one row.
    #[serde(default)]
    pub is_group: bool,
    /// The lines of probings.
    #[serde(default)]
    pub lines: Vec<usize>,
}

/// A probing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RowRecord {
    /// Line in the file.
    pub line: usize,
    /// Number of its run, if the file has runs.
    #[serde(default)]
    pub run: Option<f64>,
    /// When it was measured, if known.
    pub time_s: Option<f64>,
    /// Of the artefact, if known.
    #[serde(rename = "temperature_C", default)]
    pub temperature: Option<f64>,
    /// Vector from ball to tip without errors.
    pub before_um: [f64; 3],
    /// The remainder with the parameters.
    pub after_um: [f64; 3],
    /// False if it fits badly.
    pub is_trusted: bool,
}

/// The effect of a compensation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Compared {
    /// Each parameter that had a value before.
    pub parameters: Vec<ChangeRecord>,
    /// Mean displacement of the tip by all parameters at the probings, before and after.
    pub mean_um: [f64; 2],
    /// Largest displacement.
    pub largest_um: [f64; 2],
}

/// A parameter before and after.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChangeRecord {
    /// Name of the parameter.
    pub parameter: String,
    /// Value before.
    pub before: f64,
    /// Of the value before.
    pub before_standard_uncertainty: f64,
    /// What is left.
    pub after: Option<f64>,
    /// Of what is left.
    pub after_standard_uncertainty: Option<f64>,
    /// 1 if the whole error is removed; nothing if unknown.
    pub compensability: Option<f64>,
    /// Of the compensability.
    pub compensability_standard_uncertainty: Option<f64>,
    /// True if it may have been zero before.
    pub is_small_before: bool,
    /// Mean displacement of the tip, before and after.
    pub effect_um: [f64; 2],
}

impl Identification {
    /// True if something says how large the residuals may be: the file of readings, or places that were measured twice.
    #[must_use]
    pub fn is_judged(&self) -> bool {
        self.noise_of_stated.is_some() || self.repeats.is_some()
    }

    /// False if the residuals show errors that the model lacks: they exceed the stated noise, or the repeatability.
    #[must_use]
    pub fn fits(&self) -> bool {
        self.refuted.is_empty() && !self.repeats.as_ref().is_some_and(|repeats| repeats.is_less)
    }

    /// What was measured, in words: `168 probings of 4 balls and 53 observations with 3 set-ups`.
    #[must_use]
    pub fn counts(&self) -> String {
        let noise = self.observed.iter().flat_map(|observed| &observed.noise);
        let observations: usize = (noise.filter(|one| one.source != "probings"))
            .map(|one| one.rows)
            .sum();
        let setups = (self.observed.as_ref()).map_or(0, |observed| observed.setups.len());
        let probings = format!("{} probings of {} balls", self.probings, self.balls.len());
        let plural = if setups == 1 { "" } else { "s" };
        let observed = format!("{observations} observations with {setups} set-up{plural}");
        match (self.probings, observations) {
            (_, 0) => probings,
            (0, _) => observed,
            _ => format!("{probings} and {observed}"),
        }
    }
}

impl CheckRecord {
    /// What the residuals are compared along, as text.
    #[must_use]
    pub fn words(&self) -> String {
        match (self.along.as_str(), self.over, self.axis, self.run) {
            ("time_s", Some(span), ..) => TrendAlong::Time(span).to_string(),
            ("temperature_C", Some(span), ..) => TrendAlong::Temperature(span).to_string(),
            ("direction", _, Some(axis), _) => TrendAlong::Direction(axis).to_string(),
            ("run", _, _, Some(run)) => TrendAlong::Run(run).to_string(),
            _ => TrendAlong::Order.to_string(),
        }
    }
}

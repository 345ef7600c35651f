//! An identification as programs read it: what `identify --json` prints, and what a report shows.

mod of;

use super::StudyWarning;
use crate::identify::TrendAlong;
use serde::{Deserialize, Serialize};

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

/// The probed range of an axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Probed {
    /// Letter of the axis.
    pub axis: char,
    /// Smallest and largest position (mm, deg).
    pub range: [f64; 2],
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

/// What was read besides probings, and how everything drifted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObservedRecord {
    /// Every kind of reading with its noise.
    pub noise: Vec<NoiseRecord>,
    /// The instruments as they were found to be set up.
    pub setups: Vec<SetupRecord>,
    /// Drift that was found together with the parameters.
    pub drift: Vec<DriftRecord>,
    /// Each reading.
    #[serde(default)]
    pub rows: Vec<ReadingRecord>,
}

/// The noise of a kind of reading.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseRecord {
    /// Name of the kind.
    pub source: String,
    /// Number of rows.
    pub rows: usize,
    /// Standard deviation.
    pub noise: f64,
    /// µm, or µrad for angles.
    pub unit: String,
    /// The residuals divided by the stated uncertainty, if all rows state one.
    pub of_stated: Option<f64>,
    /// Share of the degrees of freedom.
    pub degrees_of_freedom: f64,
    /// True if chance does not explain that factor.
    pub is_misstated: bool,
}

/// An instrument.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SetupRecord {
    /// Name in the file.
    pub name: String,
    /// What it reads.
    pub kind: String,
    /// The unknowns that the readings determine.
    pub parts: Vec<SetupPartRecord>,
}

/// An unknown of a set-up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SetupPartRecord {
    /// Name of the unknown.
    pub what: String,
    /// In mm; rad in addition to the start value.
    pub value: f64,
    /// Of the value.
    pub standard_uncertainty: f64,
    /// What was stated beforehand, in the same unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stated: Option<PartStated>,
}

/// What was stated of an unknown of a set-up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PartStated {
    /// As it was stated.
    pub value: f64,
    /// As it was stated.
    pub standard_uncertainty: f64,
    /// Standard deviations between both; nothing if no other measurement tells anything about it.
    pub z: Option<f64>,
}

/// A component of drift.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DriftRecord {
    /// The set-up, or nothing for the artefact.
    #[serde(default)]
    pub setup: Option<String>,
    /// `x`, `y`, `z`: along; `a`, `b`, `c`: about.
    #[serde(default)]
    pub component: String,
    /// In mm or rad.
    #[serde(default)]
    pub value: f64,
    /// Of the value.
    #[serde(default)]
    pub standard_uncertainty: f64,
    /// From the first to the last row.
    #[serde(default)]
    pub over_s: f64,
    /// If it approached its end exponentially.
    #[serde(default)]
    pub time_constant_s: Option<f64>,
    /// What moved how far.
    pub sentence: String,
}

/// A reading; residuals in µm, or µrad for angles.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReadingRecord {
    /// Name of the file.
    pub file: String,
    /// Line in the file.
    pub line: usize,
    /// Name of the set-up.
    pub setup: String,
    /// What was read.
    pub kind: String,
    /// Without errors.
    pub before: Vec<f64>,
    /// With the parameters.
    pub after: Vec<f64>,
    /// False if it fits badly.
    pub is_trusted: bool,
}

/// What temperatures explain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TemperaturesRecord {
    /// Changes of parameters.
    pub terms: Vec<ThermalRecord>,
    /// What is left of cycles that were predicted from the others, without temperatures (rms of a coordinate).
    pub left_out_without_um: f64,
    /// Like `left_out_without_um`, with them.
    pub left_out_with_um: f64,
    /// Another cycle stays within this (95 % of coordinates).
    pub coverage_95_um: f64,
    /// Each cycle that was left out.
    #[serde(default)]
    pub cycles: Vec<CycleRecord>,
    /// What was not taken, and why.
    #[serde(default)]
    pub dropped: Vec<String>,
}

/// The change of a parameter with a temperature.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ThermalRecord {
    /// Name of the parameter.
    pub parameter: String,
    /// Name of the sensor.
    pub sensor: String,
    /// Time constant between sensor and effect.
    pub lag_s: f64,
    /// Of the time constant.
    #[serde(default)]
    pub lag_standard_uncertainty_s: Option<f64>,
    /// Where the change is zero.
    #[serde(default)]
    pub reference_celsius: f64,
    /// In mm, rad, per mmᵏ or radᵏ.
    pub per_kelvin: f64,
    /// Of the change per kelvin.
    pub standard_uncertainty: f64,
}

/// A cycle that was predicted from the others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CycleRecord {
    /// Number of its equations.
    pub equations: usize,
    /// Residual without temperatures.
    pub without_um: f64,
    /// Residual with them.
    pub with_um: f64,
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

//! What an identification found, and how far it can be trusted.

use trueaxis_direct::{DirectResult, Measurement};
use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_identify::formats::observations::Observations;
use trueaxis_identify::formats::probings::Probings;
use trueaxis_identify::{
    Compensated, HeldOut, Honesty, Identified, IdentifyError, Lacking, Level, NotKnown, Outlier,
    Published, Stated, Warmed, contradicted, error_file,
};
use trueaxis_model::errors::{ErrorModel, Parameter, covariance};
use trueaxis_model::machine::Machine;
use trueaxis_model::source::FileError;
use trueaxis_probing::plan::Remedy;

/// All results. Serialised, they are an [`Identification`](crate::Identification).
#[derive(Clone, Debug)]
pub struct StudyOutcome<'a> {
    /// The nominal machine.
    pub machine: &'a Machine,
    /// What is known about balls, bars and stylus.
    pub artefact: &'a Artefact,
    /// Runs whose motions are kept as tables.
    pub runs: &'a [Measurement],
    /// The probings that count, without the effect of a compensation.
    pub probings: Probings,
    /// The observations that count, with drift and temperatures as found.
    pub observations: Observations,
    /// Parameters with their uncertainties.
    pub identified: Identified,
    /// What temperatures explain.
    pub warmed: Option<Warmed>,
    /// The models that were tried, for `auto`.
    pub levels: Vec<Level>,
    /// Comparison of the chosen model with the published one.
    pub published: Option<Published>,
    /// Comparison with the errors before the compensation that was on.
    pub compared: Option<Compensated>,
    /// Whether the residuals are noise.
    pub honesty: Honesty,
    /// Prediction of balls that were left out, or why it could not be computed.
    pub held_out: Result<HeldOut, IdentifyError>,
    /// Measurements that would identify the missing parameters.
    pub remedies: Vec<Remedy>,
    /// Balls and stylus, found and as stated.
    pub places: Vec<Stated>,
    /// Rows that do not fit the others, with a sentence about each.
    pub outliers: Vec<(Outlier, String)>,
    /// Location errors that the model cannot compensate for.
    pub missing: Vec<Parameter>,
    /// What the measurements do not show.
    pub not_known: NotKnown,
    /// The motions that are kept as tables, if there are runs.
    pub kept: Option<DirectResult>,
    /// The motion that the model lacks, if one explains the residuals.
    pub lacking: Option<Lacking>,
    /// Axes that may count the other way for all that the probings show.
    pub unseen_senses: Option<String>,
}

/// Pairs of parameters whose correlation is above this are listed.
const CORRELATED: f64 = 0.9;
/// A result is doubtful if a larger part of the rows is suspicious.
const MOST_OUTLIERS: f64 = 0.1;
/// A motion explains rows that fit badly if this part of the squared residuals goes with it.
const MOST: f64 = 0.3;

impl StudyOutcome<'_> {
    /// True if a probing (by index) does not fit the others.
    #[must_use]
    pub(crate) fn is_outlier(&self, row: usize) -> bool {
        let mut outliers = self.outliers.iter();
        outliers.any(|(outlier, _)| outlier.rows.contains(&row))
    }

    /// True if the parameters should not be trusted: too many rows, or a whole group, do not fit the others.
    #[must_use]
    pub fn is_doubtful(&self) -> bool {
        let mut outliers = self.outliers.iter();
        let is_group = outliers.any(|(outlier, _)| outlier.is_group());
        let rows = self.identified.rows.iter().chain(&self.identified.observed);
        let most = MOST_OUTLIERS * rows.clone().count() as f64;
        let untrusted = rows.filter(|row| !row.is_trusted);
        !contradicted(&self.identified).is_empty()
            || is_group
            || untrusted.count() as f64 > most
            || self.outliers.len() as f64 > most
    }

    /// True if a motion that the model lacks is why rows fit badly.
    pub(crate) fn is_explained(&self) -> bool {
        self.lacking.as_ref().is_some_and(|one| one.explains > MOST)
    }

    /// Pairs of parameters (by index) whose correlation is above 0.9.
    #[must_use]
    pub fn correlated(&self) -> Vec<(usize, usize, f64)> {
        let covariance = &self.identified.covariance;
        let count = self.identified.parameters.len();
        let all = (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j)));
        let of = |i: usize, j: usize| {
            covariance[(i, j)] / (covariance[(i, i)] * covariance[(j, j)]).sqrt()
        };
        all.map(|(i, j)| (i, j, of(i, j)))
            .filter(|(_, _, r)| r.abs() > CORRELATED)
            .collect()
    }

    /// The error file, which refers to a file of covariances by its name.
    #[must_use]
    pub fn error_file(&self, covariances: &str) -> String {
        error_file(
            self.machine,
            &self.probings,
            &self.observations,
            &self.identified,
            &self.not_known,
            covariances,
        )
    }

    /// The content of the file of covariances.
    #[must_use]
    pub fn covariances(&self) -> String {
        covariance::write(&self.identified.known)
    }

    /// The machine's errors as the error file has them, with what is not known of them.
    ///
    /// # Errors
    /// [`FileError`] if the file could not be read.
    pub fn errors(&self) -> Result<ErrorModel, FileError> {
        let read = |_: &str| Ok(self.covariances());
        ErrorModel::with_files(&self.error_file("covariance.csv"), self.machine, &read)
    }
}

//! The errors of a machine, the effect of a compensation, and how well both are known: figures for programs
//! ([`ReportFigures`]), and a page for people ([`page()`]).
//!
//! A report is data first. It contains every figure that the page shows, with the unit as part of the name, and the
//! page is made only from it and from the [`PageModel`] behind the interactive drawings.
//!
//! Builds on `trueaxis-model`, `trueaxis-tables` and `trueaxis-study`.
#![forbid(unsafe_code)]

mod budget;
pub mod certificate;
mod compare;
mod document;
mod figures;
mod headline;
mod model;
mod motions;
mod observed;
mod page;
pub mod picture;
mod reach;
pub mod scheme_comparison;
mod tables;
mod tested;
mod verdict;
mod volumetric;
mod words;
mod worst;

use budget::Depth;
pub use budget::{ErrorBudget, Share};
pub use compare::{FigureChange, ParameterChange, ReportChanges, changes};
pub use document::{DescribedFile, Document};
pub use model::PageModel;
pub use motions::{AxisMotions, MotionShown};
pub use page::{certificate_page, page, pictures};
use serde::{Deserialize, Serialize};
pub use tables::{AxisUse, Class, CorrectionAlong, Formula, TableCurve, TablesShown};
pub use tested::{CircleFound, CircularTest, Diagonal, Positioning, PositioningFound, Tests};
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::kinematics::{NotConverged, Policy};
use trueaxis_model::machine::Machine;
use trueaxis_model::policy::of_blob;
use trueaxis_model::uncertainty::OverTravel;
use trueaxis_model::validate::{DrawError, Runtime};
use trueaxis_study::EstimateRecord;
pub use trueaxis_study::Identification;
use trueaxis_study::validation::Validation;
use trueaxis_tables::compile::{CompileError, Proof};
use trueaxis_tables::schemes::{self, SchemeError};
pub use volumetric::{ErrorKnowledge, Volumetric};
pub use words::{figure, parameter_in_words, unit};
pub use worst::{ErrorAt, Worst};

/// Version of the JSON format; increased when the meaning of a name changes.
pub const FORMAT: u32 = 1;

/// A compensation and its verification.
#[derive(Clone, Copy)]
pub struct ReportedCompensation<'a> {
    /// Tables.
    pub runtime: &'a Runtime<'a>,
    /// The comparison with the exact model.
    pub verification: &'a Proof,
    /// The error that uncertain parameters leave, if an uncertainty is known.
    pub uncertainty: Option<&'a OverTravel>,
    /// The position (mm, deg, one per axis) whose correction the tables subtract.
    pub zero_at: Option<&'a [f64]>,
    /// The tolerance (µm) that it is judged by.
    pub tolerance_um: f64,
}

/// All figures of a report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReportFigures {
    /// [`FORMAT`].
    pub format: u32,
    /// The error before and with the tables, and what that rests on.
    #[serde(default)]
    pub headline: String,
    /// The summary, one sentence each.
    pub verdict: Vec<String>,
    /// Metadata.
    pub document: Document,
    /// What could not be computed, and why.
    pub remarks: Vec<String>,
    /// The volumetric error before and after.
    pub volumetric: Volumetric,
    /// Where the error of the tip is largest.
    pub worst: Worst,
    /// The effect of each parameter alone.
    pub budget: ErrorBudget,
    /// Errors that no table corrects, and why, one sentence each.
    pub beyond: Vec<String>,
    /// The tables, if any.
    pub tables: Option<TablesShown>,
    /// Predicted results of machine tests.
    pub tests: Tests,
    /// The error motions of its axes.
    pub axes: Vec<AxisMotions>,
    /// How the errors were found, if known.
    pub identification: Option<Identification>,
    /// What was measured without and with the compensation, if it was. The computed figures do not depend on it.
    pub validation: Option<Validation>,
    /// Changes since an older report, if one was given.
    pub changes: Option<ReportChanges>,
}

/// Why there is no report.
#[derive(Clone, Debug, thiserror::Error)]
pub enum ReportError {
    /// The position whose correction is subtracted is invalid.
    #[error(transparent)]
    Zero(#[from] SchemeError),
    /// Random positions cannot be drawn.
    #[error(transparent)]
    Draw(#[from] DrawError),
    /// The bounds of the tables cannot be found.
    #[error(transparent)]
    Bounds(#[from] CompileError),
}

impl ReportError {
    /// What to do about the error.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Zero(error) => error.remedy(),
            Self::Draw(error) => CompileError::from(*error).remedy(),
            Self::Bounds(error) => error.remedy(),
        }
    }
}

impl From<NotConverged> for ReportError {
    fn from(error: NotConverged) -> Self {
        Self::Draw(error.into())
    }
}

/// Computes all figures of a machine with its errors, without and, if given, with a compensation.
///
/// # Errors
/// [`ReportError`] if positions cannot be drawn, or the position whose correction is subtracted is wrong. A
/// kinematic correction that fails somewhere is not an error; the report mentions it.
pub fn report(
    machine: &Machine,
    errors: &ErrorModel,
    compensation: Option<ReportedCompensation<'_>>,
    identification: Option<Identification>,
    document: Document,
) -> Result<ReportFigures, ReportError> {
    let subject = Subject::new(machine, errors, compensation, document.seed);
    let mut remarks = Vec::new();
    let mut volumetric = volumetric::volumetric(&subject, &mut remarks)?;
    let worst = worst::worst(&subject, &mut volumetric)?;
    let budget = budget::budget(&subject, Depth::Everything)?;
    let tables = compensation.map(|c| tables::tables(&subject, c.runtime));
    let tests = tested::tests(&subject, &mut remarks);
    let identification =
        identification.and_then(|found| shown(found, machine, errors, &mut remarks));
    let probed = identification.as_ref().map(|found| &found.probed[..]);
    let axes = motions::motions(&subject, probed.unwrap_or_default());
    let mut beyond = reach::beyond(&subject, &volumetric, &budget);
    beyond.extend(reach::never_probed(&axes));
    let mut report = ReportFigures {
        format: FORMAT,
        headline: headline::headline(&volumetric, errors),
        verdict: Vec::new(),
        document,
        remarks,
        beyond,
        volumetric,
        worst,
        budget,
        tables: tables.transpose()?,
        tests,
        axes,
        identification,
        validation: None,
        changes: None,
    };
    report.verdict = summary(&subject, &report.volumetric, &report.budget.shares);
    Ok(report)
}

/// The first sentences of a report.
fn summary(subject: &Subject<'_>, volumetric: &Volumetric, shares: &[Share]) -> Vec<String> {
    let why = reach::why(subject);
    let mut sentences = verdict::sentences(volumetric, shares, subject.errors, why);
    sentences.extend(verdict::thermal(subject.errors));
    sentences
}

/// What a page shows of an identification, which must be one of this machine: not its covariance and rows, which are
/// most of it.
fn shown(
    mut found: Identification,
    machine: &Machine,
    errors: &ErrorModel,
    remarks: &mut Vec<String>,
) -> Option<Identification> {
    let other = match found.machine == machine.name {
        false => Some(format!("it belongs to the machine `{}`", found.machine)),
        true => found.parameters.iter().find_map(|one| differs(one, errors)),
    };
    if let Some(other) = other {
        remarks.push(format!("{LEFT_OUT}: {other}."));
        return None;
    }
    found.covariance.clear();
    (found.observed.iter_mut()).for_each(|observed| observed.rows.clear());
    Some(found)
}

/// How the remark about an identification begins that is of another machine or of other errors.
pub const LEFT_OUT: &str = "The identification is left out";
/// What an error file rounds of a value.
const ROUNDED: f64 = 1e-5;

/// How an identified value differs from that of the error file, if it does: a report on other errors has other residuals.
fn differs(one: &EstimateRecord, errors: &ErrorModel) -> Option<String> {
    let parameter = Parameter::parse(&one.parameter)?;
    let value = errors.parameters.get(&parameter).copied().unwrap_or(0.0);
    let is_same = (value - one.value).abs() <= ROUNDED * one.value.abs();
    (!is_same).then(|| {
        format!(
            "it has {} = {:.6e}, and the error file {value:.6e}",
            one.parameter, one.value
        )
    })
}

/// The summary, and the parameters with the largest effects.
#[derive(Clone, Debug, PartialEq)]
pub struct ReportVerdict {
    /// The first sentences of a report.
    pub sentences: Vec<String>,
    /// The effect of every parameter; the largest mean at the tip first.
    pub shares: Vec<Share>,
    /// The figures that the sentences are about.
    pub volumetric: Volumetric,
}

/// Computes only the verdict of a report; positions are drawn with `seed`.
///
/// # Errors
/// Those of [`report`].
pub fn verdict(
    machine: &Machine,
    errors: &ErrorModel,
    compensation: Option<ReportedCompensation<'_>>,
    seed: u64,
) -> Result<ReportVerdict, ReportError> {
    let subject = Subject::new(machine, errors, compensation, seed);
    let volumetric = volumetric::volumetric(&subject, &mut Vec::new())?;
    let shares = budget::budget(&subject, Depth::Alone)?.shares;
    Ok(ReportVerdict {
        sentences: summary(&subject, &volumetric, &shares),
        shares,
        volumetric,
    })
}

/// The subject of a report.
#[derive(Clone)]
struct Subject<'a> {
    machine: &'a Machine,
    errors: &'a ErrorModel,
    policy: Policy,
    compensation: Option<ReportedCompensation<'a>>,
    seed: u64,
    /// What the tables subtract.
    subtracted: schemes::Options,
}

impl<'a> Subject<'a> {
    fn new(
        machine: &'a Machine,
        errors: &'a ErrorModel,
        compensation: Option<ReportedCompensation<'a>>,
        seed: u64,
    ) -> Self {
        let policy = compensation.map_or(Policy::default(), |c| {
            of_blob(c.runtime.compensation().policy())
        });
        Self {
            machine,
            errors,
            policy,
            compensation,
            seed,
            subtracted: schemes::Options {
                policy,
                zero_at: compensation.and_then(|c| c.zero_at).map(<[f64]>::to_vec),
                ..schemes::Options::default()
            },
        }
    }
}

//! What a machine's errors are, what a compensation does about them, and how well both are known: figures for
//! programs ([`Report`]), and a page for people ([`page`]).
//!
//! A report is data first: everything that the page shows as a figure is in it, with its unit in its name, and the
//! page is made of nothing else and of the [`Model`] that its drawings move.

mod budget;
mod document;
mod model;
mod motions;
mod page;
mod reach;
mod tables;
mod tested;
mod verdict;
mod volumetric;
mod words;

use crate::compile::{CompileError, Proof};
use crate::errors::ErrorModel;
use crate::kinematics::{NotConverged, Policy};
use crate::machine::Machine;
use crate::policy::of_blob;
use crate::schemes::{self, SchemeError};
use crate::validate::{DrawError, Runtime};
pub use budget::{Budget, Share};
pub use document::{Document, File};
pub use model::Model;
pub use motions::{AxisMotions, Motion};
pub use page::page;
use serde::{Deserialize, Serialize};
pub use tables::{Along, AxisUse, Class, Curve, Formula, Tables};
pub use tested::{CircleFound, CircularTest, Diagonal, Positioning, PositioningFound, Tests};
pub use volumetric::{Known, Volumetric};

/// The version of what is written: it grows when a name changes its meaning.
pub const FORMAT: u32 = 1;

/// A compensation, and what it was found to do.
#[derive(Clone, Copy)]
pub struct Compensation<'a> {
    /// Its tables.
    pub runtime: &'a Runtime<'a>,
    /// The comparison with the exact model.
    pub proof: &'a Proof,
    /// The position (mm, deg, one per axis) whose correction the tables leave out.
    pub zero_at: Option<&'a [f64]>,
    /// The tolerance (µm) that it is held to.
    pub tolerance_um: f64,
}

/// All figures of a report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// [`FORMAT`].
    pub format: u32,
    /// What there is to say first, a sentence each.
    pub verdict: Vec<String>,
    /// What it is about.
    pub document: Document,
    /// What could not be shown, and why.
    pub remarks: Vec<String>,
    /// The volumetric error before and after.
    pub volumetric: Volumetric,
    /// What each parameter does by itself.
    pub budget: Budget,
    /// What no table corrects, and why, a sentence each.
    pub beyond: Vec<String>,
    /// The tables, if there are some.
    pub tables: Option<Tables>,
    /// What tests of the machine would find.
    pub tests: Tests,
    /// The error motions of its axes.
    pub axes: Vec<AxisMotions>,
}

/// Why there is no report.
#[derive(Clone, Debug, thiserror::Error)]
pub enum ReportError {
    /// The position that is left out is none.
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
    /// What to do about it.
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

/// Everything about a machine with its errors, as it is and with a compensation, if there is one.
///
/// # Errors
/// [`ReportError`] where positions cannot be drawn, or the one that is left out is wrong. A kinematic correction
/// that fails somewhere is no error, but said in the report.
pub fn report(
    machine: &Machine,
    errors: &ErrorModel,
    compensation: Option<Compensation<'_>>,
    document: Document,
) -> Result<Report, ReportError> {
    let policy = compensation.map_or(Policy::default(), |c| {
        of_blob(c.runtime.compensation().policy())
    });
    let subject = Subject {
        machine,
        errors,
        policy,
        compensation,
        seed: document.seed,
        subtracted: schemes::Options {
            policy,
            zero_at: compensation.and_then(|c| c.zero_at).map(<[f64]>::to_vec),
            ..schemes::Options::default()
        },
    };
    let mut remarks = Vec::new();
    let volumetric = volumetric::volumetric(&subject, &mut remarks)?;
    let budget = budget::budget(&subject)?;
    let tables = compensation.map(|c| tables::tables(&subject, c.runtime));
    let tests = tested::tests(&subject, &mut remarks);
    let mut report = Report {
        format: FORMAT,
        verdict: Vec::new(),
        document,
        remarks,
        beyond: reach::beyond(&subject, &volumetric, &budget),
        volumetric,
        budget,
        tables: tables.transpose()?,
        tests,
        axes: motions::motions(&subject),
    };
    report.verdict = verdict::sentences(&report);
    Ok(report)
}

/// What a report is about.
struct Subject<'a> {
    machine: &'a Machine,
    errors: &'a ErrorModel,
    policy: Policy,
    compensation: Option<Compensation<'a>>,
    seed: u64,
    /// What the tables leave out.
    subtracted: schemes::Options,
}

//! One compensation, made for the tolerance that was asked for or the finest one that fits, verified, and judged: what
//! may be written, and what is to be said of it.

use crate::compile::{
    AxisBounds, Best, CompileError, Options, Progress, Proof, Refusal, Size, Warning, best,
    over_bounds, worse,
};
use crate::reversal::{Reversal, reversals};
use crate::target::Shortage;
use serde::Serialize;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_model::uncertainty::{OverTravel, over_travel};
use trueaxis_model::validate::Runtime;

/// What was made.
pub enum Made {
    /// The target lacks the capacity.
    NoRoom(Vec<Shortage>),
    /// It fits and has been verified.
    Verified(Box<Whole>),
}

/// A compensation and everything known about it.
pub struct Whole {
    /// The bytes, and the tolerance that they are judged by.
    pub best: Best,
    /// The 95 % interval of the error that uncertain parameters leave.
    pub uncertainty: Option<OverTravel>,
    /// What happens where axes reverse.
    pub reversals: Vec<Reversal>,
    /// What to look at although it may be written.
    pub warnings: Vec<Warning>,
    /// Reasons not to write it.
    pub refusals: Vec<Refusal>,
    /// Limits missed by a scheme that guarantees none.
    pub missed: Vec<Refusal>,
}

/// What a verified compensation is for programs: its part of what `trueaxis compile --json` prints.
#[derive(Serialize)]
pub struct VerifiedFigures<'a> {
    /// Counts and sizes.
    #[serde(flatten)]
    pub size: Size,
    /// Bounds of each axis.
    pub axes: &'a [AxisBounds],
    /// What happens where axes reverse.
    pub reversals: &'a [Reversal],
    /// The verification.
    #[serde(flatten)]
    pub verification: &'a Proof,
    /// 95 % interval of the error that uncertain parameters leave.
    pub uncertainty: Option<&'a OverTravel>,
    /// Remarks of the scheme.
    pub notes: &'a [String],
    /// What to look at although it may be written.
    pub warnings: Vec<Message>,
}

/// A warning with its sentence.
#[derive(Serialize)]
pub struct Message {
    /// The sentence.
    pub message: String,
    #[serde(flatten)]
    warning: Warning,
}

impl<'a> VerifiedFigures<'a> {
    /// The figures of what was made.
    #[must_use]
    pub fn new(made: &'a Whole) -> Self {
        let built = &made.best.built;
        let told = |warning: &Warning| Message {
            message: warning.to_string(),
            warning: warning.clone(),
        };
        Self {
            size: built.size,
            axes: &built.bounds,
            reversals: &made.reversals,
            verification: &made.best.verification,
            uncertainty: made.uncertainty.as_ref(),
            notes: &built.notes,
            warnings: made.warnings.iter().map(told).collect(),
        }
    }
}

impl Made {
    /// For the given tolerance (µm), or else for the one that [`best`] finds.
    ///
    /// # Errors
    /// [`CompileError`] if there are no such tables.
    pub fn new(
        machine: &Machine,
        errors: &ErrorModel,
        options: &Options,
        asked: Option<f64>,
        bar: &dyn Progress,
    ) -> Result<Self, CompileError> {
        // The bytes are verified before writing; writing reads them back and compares.
        let best = match best(machine, errors, options, asked, bar) {
            Ok(best) => best,
            Err(CompileError::NoRoom { shortages, .. }) => return Ok(Self::NoRoom(shortages)),
            Err(error) => return Err(error),
        };
        let runtime = Runtime::load(&best.built.blob)?;
        let uncertainty = over_travel(&runtime.kinematics(machine, errors), options.seed)?;
        let reversals = reversals(&runtime);
        drop(runtime);
        let refusals = best.verification.refusals(best.tolerance);
        let (refusals, missed) = match options.scheme.keeps_tolerance() {
            true => (refusals, Vec::new()),
            false => (Vec::new(), refusals),
        };
        let mut warnings = best.built.warnings.clone();
        warnings.extend(over_bounds(
            &best.built.bounds,
            &best.verification.travel.largest,
        ));
        warnings.extend(worse(&best.verification, best.tolerance));
        Ok(Self::Verified(Box::new(Whole {
            warnings,
            best,
            uncertainty,
            reversals,
            refusals,
            missed,
        })))
    }

    /// The tolerance (µm) that it was judged by; `None` if it does not fit.
    #[must_use]
    pub fn tolerance(&self) -> Option<f64> {
        match self {
            Self::NoRoom(_) => None,
            Self::Verified(made) => Some(made.best.tolerance),
        }
    }

    /// True if there is nothing to refuse.
    #[must_use]
    pub fn is_right(&self) -> bool {
        match self {
            Self::NoRoom(_) => false,
            Self::Verified(made) => made.refusals.is_empty(),
        }
    }

    /// True if it may be written; `best_effort` waives the refusals that allow it.
    #[must_use]
    pub fn may_be_written(&self, best_effort: bool) -> bool {
        match self {
            Self::NoRoom(_) => false,
            Self::Verified(made) => {
                (made.refusals.iter()).all(|refusal| best_effort && refusal.yields_to_best_effort())
            }
        }
    }
}

//! Makes and proves a compensation before anything is written.

use std::path::PathBuf;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_tables::compile::{Best, CompileError, Options, Progress, Refusal, best};
use trueaxis_tables::reversal::{Reversal, reversals};
use trueaxis_tables::target::Shortage;
use trueaxis_tables::uncertainty::{OverTravel, over_travel};
use trueaxis_tables::validate::Runtime;

/// A compensation to make, and its output file.
pub struct Wanted {
    pub output: PathBuf,
    pub options: Options,
}

/// The result.
pub enum Made {
    /// The target lacks the capacity.
    NoRoom(Vec<Shortage>),
    /// It fits and has been proven.
    Proven(Box<Whole>),
}

/// A compensation and everything known about it.
pub struct Whole {
    pub best: Best,
    pub uncertainty: Option<OverTravel>,
    pub reversals: Vec<Reversal>,
    /// Reasons not to write it.
    pub refusals: Vec<Refusal>,
    /// Limits missed by a scheme that guarantees none.
    pub missed: Vec<Refusal>,
}

impl Made {
    /// Makes and proves it for the given tolerance (µm), or else for the one that [`best`] finds.
    pub fn new(
        machine: &Machine,
        errors: &ErrorModel,
        options: &Options,
        asked: Option<f64>,
        bar: &dyn Progress,
    ) -> Result<Self, CompileError> {
        // The bytes are proven before writing; writing reads them back and compares.
        let best = match best(machine, errors, options, asked, bar) {
            Ok(best) => best,
            Err(CompileError::NoRoom { shortages, .. }) => return Ok(Self::NoRoom(shortages)),
            Err(error) => return Err(error),
        };
        let runtime = Runtime::load(&best.built.blob)?;
        let uncertainty = over_travel(&runtime.kinematics(machine, errors), options.seed)?;
        let reversals = reversals(&runtime);
        drop(runtime);
        let refusals = best.proof.refusals(best.tolerance);
        let (refusals, missed) = match options.scheme.keeps_tolerance() {
            true => (refusals, Vec::new()),
            false => (Vec::new(), refusals),
        };
        Ok(Self::Proven(Box::new(Whole {
            best,
            uncertainty,
            reversals,
            refusals,
            missed,
        })))
    }

    /// The tolerance (µm) that it was judged by; `None` if it does not fit.
    pub fn tolerance(&self) -> Option<f64> {
        match self {
            Self::NoRoom(_) => None,
            Self::Proven(made) => Some(made.best.tolerance),
        }
    }

    /// True if there is nothing to refuse.
    pub fn is_right(&self) -> bool {
        match self {
            Self::NoRoom(_) => false,
            Self::Proven(made) => made.refusals.is_empty(),
        }
    }

    /// True if it may be written; `best_effort` waives the refusals that allow it.
    pub fn may_be_written(&self, best_effort: bool) -> bool {
        match self {
            Self::NoRoom(_) => false,
            Self::Proven(made) => {
                (made.refusals.iter()).all(|refusal| best_effort && refusal.yields_to_best_effort())
            }
        }
    }
}

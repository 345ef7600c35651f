//! A compensation that is made and proven, before anything is written.

use std::path::PathBuf;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_tables::compile::{Best, CompileError, Options, Progress, Refusal, best};
use trueaxis_tables::target::Shortage;
use trueaxis_tables::uncertainty::{OverTravel, over_travel};
use trueaxis_tables::validate::Runtime;

/// A compensation to be made, and the file it goes to.
pub struct Wanted {
    pub output: PathBuf,
    pub options: Options,
}

/// What came of it.
pub enum Made {
    /// What the target lacks.
    NoRoom(Vec<Shortage>),
    /// A compensation that fits.
    Proven(Box<Whole>),
}

/// A compensation, and all that is known of it.
pub struct Whole {
    pub best: Best,
    pub uncertainty: Option<OverTravel>,
    /// What speaks against writing it.
    pub refusals: Vec<Refusal>,
    /// What a scheme that promises nothing has missed.
    pub missed: Vec<Refusal>,
}

impl Made {
    /// Makes it and proves it, for the tolerance asked for (µm) or else as [`best`] finds it.
    pub fn new(
        machine: &Machine,
        errors: &ErrorModel,
        options: &Options,
        asked: Option<f64>,
        bar: &dyn Progress,
    ) -> Result<Self, CompileError> {
        // The bytes are proven before they are written; writing reads them back and compares.
        let best = match best(machine, errors, options, asked, bar) {
            Ok(best) => best,
            Err(CompileError::NoRoom { shortages, .. }) => return Ok(Self::NoRoom(shortages)),
            Err(error) => return Err(error),
        };
        let runtime = Runtime::load(&best.built.blob)?;
        let uncertainty = over_travel(&runtime.kinematics(machine, errors), options.seed)?;
        drop(runtime);
        let refusals = best.proof.refusals(best.tolerance);
        let (refusals, missed) = match options.scheme.keeps_tolerance() {
            true => (refusals, Vec::new()),
            false => (Vec::new(), refusals),
        };
        Ok(Self::Proven(Box::new(Whole {
            best,
            uncertainty,
            refusals,
            missed,
        })))
    }

    /// The tolerance it is judged by (µm), if there is something to judge.
    pub fn tolerance(&self) -> Option<f64> {
        match self {
            Self::NoRoom(_) => None,
            Self::Proven(made) => Some(made.best.tolerance),
        }
    }

    /// True if nothing speaks against it.
    pub fn is_right(&self) -> bool {
        match self {
            Self::NoRoom(_) => false,
            Self::Proven(made) => made.refusals.is_empty(),
        }
    }

    /// True if nothing speaks against writing it that does not yield.
    pub fn may_be_written(&self, best_effort: bool) -> bool {
        match self {
            Self::NoRoom(_) => false,
            Self::Proven(made) => {
                (made.refusals.iter()).all(|refusal| best_effort && refusal.yields_to_best_effort())
            }
        }
    }
}

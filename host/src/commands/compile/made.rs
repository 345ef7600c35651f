//! A compensation that is made and proven, before anything is written.

use std::path::PathBuf;
use trueaxis_host::compile::{self, Built, CompileError, Full, Options, Progress, Proof, Refusal};
use trueaxis_host::errors::ErrorModel;
use trueaxis_host::machine::Machine;
use trueaxis_host::target::Shortage;
use trueaxis_host::uncertainty::{OverTravel, over_travel};
use trueaxis_host::validate::Runtime;

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
    pub built: Built,
    pub proof: Proof,
    pub uncertainty: Option<OverTravel>,
    /// What speaks against writing it.
    pub refusals: Vec<Refusal>,
    /// What a scheme that promises nothing has missed.
    pub missed: Vec<Refusal>,
    pub full: Option<Full>,
}

impl Made {
    /// Makes it and proves it; `tolerance` in µm.
    pub fn new(
        machine: &Machine,
        errors: &ErrorModel,
        options: &Options,
        tolerance: f64,
        bar: &dyn Progress,
    ) -> Result<Self, CompileError> {
        let built = match compile::build(machine, errors, options, bar) {
            Ok(built) => built,
            Err(CompileError::NoRoom { shortages, .. }) => return Ok(Self::NoRoom(shortages)),
            Err(error) => return Err(error),
        };
        let zero = options.tables.zero(machine, errors)?;
        // The bytes are proven before they are written; writing reads them back and compares.
        let runtime = Runtime::load(&built.blob)?;
        let proof = compile::prove_held(
            machine,
            errors,
            &runtime,
            &zero,
            &options.scheme.held(machine),
            options.random,
            options.seed,
            bar,
        )?;
        let uncertainty = over_travel(&runtime.kinematics(machine, errors), options.seed)?;
        drop(runtime);
        let refusals = proof.refusals(tolerance);
        let (refusals, missed) = match options.scheme.keeps_tolerance() {
            true => (refusals, Vec::new()),
            false => (Vec::new(), refusals),
        };
        Ok(Self::Proven(Box::new(Whole {
            full: Full::of(&built, &proof, options),
            built,
            proof,
            uncertainty,
            refusals,
            missed,
        })))
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

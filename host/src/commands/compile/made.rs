//! A compensation that is made and proven, before anything is written.

use std::path::PathBuf;
use trueaxis_host::compile::{self, Built, CompileError, Full, Options, Progress, Proof, Refusal};
use trueaxis_host::errors::ErrorModel;
use trueaxis_host::machine::Machine;
use trueaxis_host::policy::tolerance_urad;
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
    /// The tolerance it is judged by (µm).
    pub tolerance: f64,
    /// If that is missed, a coarser one that was met (µm).
    pub fits_um: Option<f64>,
}

/// Tolerances (µm) that are tried where a finer one is missed.
const TOLERANCES: [f64; 8] = [0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0];
/// The coarsest of them that is taken without being asked for.
const COARSEST_DEFAULT: f64 = 1.0;
/// The finest: what is tried first without being asked for.
pub const FINEST: f64 = TOLERANCES[0];

impl Whole {
    /// Makes it for the tolerance of `options` and proves it.
    fn new(
        machine: &Machine,
        errors: &ErrorModel,
        options: &Options,
        bar: &dyn Progress,
    ) -> Result<Self, CompileError> {
        let built = compile::build(machine, errors, options, bar)?;
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
        Ok(Self {
            built,
            proof,
            uncertainty,
            refusals: Vec::new(),
            missed: Vec::new(),
            full: None,
            tolerance: FINEST,
            fits_um: None,
        })
    }

    /// The finest tolerance that it meets (µm), by its largest deviations: what candidates for any tolerance
    /// are compared by.
    fn finest(&self) -> f64 {
        let inside = self.proof.inside();
        // What every tolerance allows does not count.
        match inside.difference_urad <= tolerance_urad(inside.policy, 0.0) {
            true => inside.difference_um,
            false => inside.difference_um.max(inside.difference_urad),
        }
    }

    fn does_harm(&self, tolerance: f64) -> bool {
        let refusals = self.proof.refusals(tolerance);
        refusals
            .iter()
            .any(|refusal| !refusal.yields_to_best_effort())
    }

    /// Judges it by a tolerance (µm).
    fn judged(mut self, tolerance: f64, options: &Options) -> Self {
        let refusals = self.proof.refusals(tolerance);
        (self.refusals, self.missed) = match options.scheme.keeps_tolerance() {
            true => (refusals, Vec::new()),
            false => (Vec::new(), refusals),
        };
        self.full = Full::of(&self.built, &self.proof, &of(options, tolerance));
        self.tolerance = tolerance;
        self
    }
}

/// The same options for another tolerance (µm).
fn of(options: &Options, tolerance: f64) -> Options {
    let mut options = options.clone();
    options.tables.tolerance = tolerance * 1e-3;
    options
}

impl Made {
    /// Makes it and proves it, for the tolerance asked for (µm), or else for the finest of 0.05, 0.1, 0.2, 0.5
    /// and 1 µm that is met. Where none is met, coarser ones are tried until one is, and what deviates least is
    /// taken: so a finer tolerance never leaves more than a coarser one of these.
    pub fn new(
        machine: &Machine,
        errors: &ErrorModel,
        options: &Options,
        asked: Option<f64>,
        bar: &dyn Progress,
    ) -> Result<Self, CompileError> {
        let first = asked.unwrap_or(FINEST);
        let steps: Vec<f64> = match options.scheme.keeps_tolerance() {
            true => {
                let coarser = TOLERANCES.into_iter().filter(|t| *t > first);
                [first].into_iter().chain(coarser).collect()
            }
            false => vec![first],
        };
        // What is taken if it is met; if nothing is, what is missed.
        let coarsest = match (asked, options.scheme.keeps_tolerance()) {
            (None, true) => COARSEST_DEFAULT,
            _ => first,
        };
        let mut candidates: Vec<Whole> = Vec::new();
        let mut fits_um = None;
        let mut is_full = false;
        for tolerance in steps {
            match Whole::new(machine, errors, &of(options, tolerance), bar) {
                Ok(whole) => candidates.push(whole),
                // Even a coarse one does not fit, or a coarser one is no better: what there is stays.
                Err(_) if !candidates.is_empty() => continue,
                Err(CompileError::NoRoom { shortages, .. }) => {
                    return Ok(Self::NoRoom(shortages));
                }
                Err(error) => return Err(error),
            }
            if tolerance <= coarsest {
                is_full |= candidates.last().is_some_and(|c| c.built.is_full);
            }
            let met = candidates
                .iter()
                .any(|c| c.proof.refusals(tolerance).is_empty());
            if met && tolerance <= coarsest {
                return Ok(Self::Proven(Box::new(
                    least(candidates, tolerance).judged(tolerance, options),
                )));
            }
            // Only what its own run meets is met again when it is asked for.
            let last = candidates.last();
            if last.is_some_and(|c| c.proof.refusals(tolerance).is_empty()) {
                fits_um = Some(tolerance);
                break;
            }
        }
        let mut best = least(candidates, coarsest);
        if options.scheme.keeps_tolerance() {
            best.built.is_full = is_full;
            best.built.meets = fits_um.map(|um| um * 1e-3).or(best.built.meets);
            best.fits_um = fits_um;
        }
        Ok(Self::Proven(Box::new(best.judged(coarsest, options))))
    }

    /// The tolerance it is judged by (µm), if there is something to judge.
    pub fn tolerance(&self) -> Option<f64> {
        match self {
            Self::NoRoom(_) => None,
            Self::Proven(made) => Some(made.tolerance),
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

/// What deviates least, of at least one candidate, and does no harm by a tolerance (µm) if there is such.
fn least(candidates: Vec<Whole>, tolerance: f64) -> Whole {
    let key = |c: &Whole| (c.does_harm(tolerance), c.finest());
    let better = |a: Whole, b: Whole| match key(&b) < key(&a) {
        true => b,
        false => a,
    };
    let least = candidates.into_iter().reduce(better);
    least.expect("the first candidate is there, or its error was returned")
}

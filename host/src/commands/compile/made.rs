//! A compensation that is made and proven, before anything is written.

use std::path::PathBuf;
use trueaxis_host::compile::{
    self, Built, CompileError, Compiled, Full, Options, Progress, Proof, Refusal,
};
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

/// A compensation for some tolerance.
struct Candidate {
    built: Built,
    proof: Proof,
}

impl Candidate {
    /// Makes it for the tolerance of `options` and proves it.
    fn new(
        machine: &Machine,
        errors: &ErrorModel,
        options: &Options,
        bar: &dyn Progress,
    ) -> Result<Self, CompileError> {
        // The bytes are proven before they are written; writing reads them back and compares.
        let Compiled { built, proof } = compile::compile(machine, errors, options, bar)?;
        Ok(Self { built, proof })
    }

    fn meets(&self, tolerance: f64) -> bool {
        self.proof.refusals(tolerance).is_empty()
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
}

/// The same options for another tolerance (µm).
fn of(options: &Options, tolerance: f64) -> Options {
    let mut options = options.clone();
    options.tables.tolerance = tolerance * 1e-3;
    options
}

impl Whole {
    /// A candidate judged by a tolerance (µm).
    fn judged(
        Candidate { built, proof }: Candidate,
        machine: &Machine,
        errors: &ErrorModel,
        options: &Options,
        tolerance: f64,
    ) -> Result<Self, CompileError> {
        let runtime = Runtime::load(&built.blob)?;
        let uncertainty = over_travel(&runtime.kinematics(machine, errors), options.seed)?;
        drop(runtime);
        let refusals = proof.refusals(tolerance);
        let (refusals, missed) = match options.scheme.keeps_tolerance() {
            true => (refusals, Vec::new()),
            false => (Vec::new(), refusals),
        };
        Ok(Self {
            full: Full::of(&built, &proof, &of(options, tolerance)),
            built,
            proof,
            uncertainty,
            refusals,
            missed,
            tolerance,
            fits_um: None,
        })
    }
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
        let keeps = options.scheme.keeps_tolerance();
        let first = asked.unwrap_or(FINEST);
        let coarser = TOLERANCES.into_iter().filter(|t| keeps && *t > first);
        // What is taken if it is met; if nothing is, what is missed.
        let coarsest = match asked {
            None if keeps => COARSEST_DEFAULT,
            _ => first,
        };
        let judged =
            |candidate, tolerance| Whole::judged(candidate, machine, errors, options, tolerance);
        let mut candidates: Vec<Candidate> = Vec::new();
        let mut fits_um = None;
        let mut is_full = false;
        for tolerance in [first].into_iter().chain(coarser) {
            let candidate = match Candidate::new(machine, errors, &of(options, tolerance), bar) {
                Ok(candidate) => candidate,
                Err(CompileError::NoRoom { .. }) if !candidates.is_empty() => continue,
                Err(CompileError::NoRoom { shortages, .. }) => {
                    return Ok(Self::NoRoom(shortages));
                }
                Err(error) => return Err(error),
            };
            is_full |= tolerance <= coarsest && candidate.built.is_full;
            // Only what its own run meets is met again when it is asked for.
            let is_own = candidate.meets(tolerance);
            candidates.push(candidate);
            if tolerance <= coarsest && candidates.iter().any(|c| c.meets(tolerance)) {
                let whole = judged(least(candidates, tolerance), tolerance)?;
                return Ok(Self::Proven(Box::new(whole)));
            }
            if is_own {
                fits_um = Some(tolerance);
                break;
            }
        }
        let mut best = least(candidates, coarsest);
        if keeps {
            best.built.is_full = is_full;
            best.built.meets = fits_um.map(|um| um * 1e-3).or(best.built.meets);
        }
        let mut whole = judged(best, coarsest)?;
        whole.fits_um = fits_um.filter(|_| keeps);
        Ok(Self::Proven(Box::new(whole)))
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
fn least(candidates: Vec<Candidate>, tolerance: f64) -> Candidate {
    let key = |c: &Candidate| (c.does_harm(tolerance), c.finest());
    let better = |a: Candidate, b: Candidate| match key(&b) < key(&a) {
        true => b,
        false => a,
    };
    let least = candidates.into_iter().reduce(better);
    least.expect("the first candidate is there, or its error was returned")
}

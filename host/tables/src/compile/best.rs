//! The best compensation that a target has room for: several tolerances are tried, and one is taken.

use super::{Built, CompileError, Compiled, Full, Options, Progress, Proof, compile};
use crate::policy::tolerance_urad;
use crate::size::Size;
use crate::target::Target;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;

/// Tolerances (µm) that are tried where a finer one is missed.
pub const TOLERANCES: [f64; 8] = [0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0];
/// The coarsest of them that is taken without being asked for.
const COARSEST_DEFAULT: f64 = 1.0;
/// The finest: what is tried first without being asked for.
pub const FINEST: f64 = TOLERANCES[0];

/// A compensation, and the tolerance it is judged by.
#[derive(Clone, Debug)]
pub struct Best {
    /// The blob and what is known about it.
    pub built: Built,
    /// What it does to the volumetric error.
    pub proof: Proof,
    /// The tolerance it is judged by (µm).
    pub tolerance: f64,
    /// If that is missed, a coarser one that was met (µm).
    pub fits_um: Option<f64>,
    /// Why it is missed, if that is because the target is full.
    pub full: Option<Full>,
}

impl Compiled {
    fn meets(&self, tolerance: f64) -> bool {
        self.proof.refusals(tolerance).is_empty()
    }

    fn does_harm(&self, tolerance: f64) -> bool {
        let refusals = self.proof.refusals(tolerance);
        refusals
            .iter()
            .any(|refusal| !refusal.yields_to_best_effort())
    }
}

impl Proof {
    /// The finest tolerance that is met (µm), by the largest deviations: what compensations for any tolerance are
    /// compared by.
    #[must_use]
    pub fn finest(&self) -> f64 {
        let inside = self.inside();
        // What every tolerance allows does not count.
        match inside.difference_urad <= tolerance_urad(inside.policy, 0.0) {
            true => inside.difference_um,
            false => inside.difference_um.max(inside.difference_urad),
        }
    }
}

/// The same options for another tolerance (µm).
fn of(options: &Options, tolerance: f64) -> Options {
    let mut options = options.clone();
    options.tables.tolerance = tolerance * 1e-3;
    options
}

/// Makes a compensation and proves it, for the tolerance asked for (µm), or else for the finest of 0.05, 0.1, 0.2,
/// 0.5 and 1 µm that is met. Where none is met, coarser ones up to 10 µm are tried until one is, and what deviates
/// least is taken: so what a finer tolerance leaves is at most what a coarser one of these leaves, or the finest of
/// them that is met. The tolerance of `options` does not count.
///
/// # Errors
/// [`CompileError`]; of targets that hold too little only where none of the tolerances fits.
pub fn best(
    machine: &Machine,
    errors: &ErrorModel,
    options: &Options,
    asked: Option<f64>,
    progress: &dyn Progress,
) -> Result<Best, CompileError> {
    let keeps = options.scheme.keeps_tolerance();
    let first = asked.unwrap_or(FINEST);
    let coarser = TOLERANCES.into_iter().filter(|t| keeps && *t > first);
    // What is taken if it is met; if nothing is, what is missed.
    let coarsest = match asked {
        None if keeps => COARSEST_DEFAULT,
        _ => first,
    };
    let mut candidates: Vec<Compiled> = Vec::new();
    let mut fits_um = None;
    let mut is_full = false;
    for tolerance in [first].into_iter().chain(coarser) {
        let candidate = match compile(machine, errors, &of(options, tolerance), progress) {
            Ok(candidate) => candidate,
            Err(CompileError::NoRoom { .. }) if !candidates.is_empty() => continue,
            Err(error) => return Err(error),
        };
        is_full |= tolerance <= coarsest && candidate.built.is_full;
        // Only what its own run meets is met again when it is asked for.
        let is_own = candidate.meets(tolerance);
        candidates.push(candidate);
        if tolerance <= coarsest && candidates.iter().any(|c| c.meets(tolerance)) {
            return Ok(judged(least(candidates, tolerance), tolerance, options));
        }
        if is_own {
            fits_um = Some(tolerance);
            break;
        }
    }
    let mut chosen = least(candidates, coarsest);
    if keeps {
        chosen.built.is_full = is_full;
        chosen.built.meets = fits_um.map(|um| um * 1e-3).or(chosen.built.meets);
    }
    let mut best = judged(chosen, coarsest, options);
    best.fits_um = fits_um.filter(|_| keeps);
    if let Some(full) = &mut best.full {
        full.unlimited = unlimited(machine, errors, &of(options, coarsest), progress)?;
    }
    Ok(best)
}

/// A candidate judged by a tolerance (µm).
fn judged(Compiled { built, proof }: Compiled, tolerance: f64, options: &Options) -> Best {
    Best {
        full: Full::of(&built, &proof, &of(options, tolerance)),
        built,
        proof,
        tolerance,
        fits_um: None,
    }
}

/// What deviates least, of at least one candidate, and does no harm by a tolerance (µm) if there is such.
fn least(candidates: Vec<Compiled>, tolerance: f64) -> Compiled {
    let key = |c: &Compiled| (c.does_harm(tolerance), c.proof.finest());
    let better = |a: Compiled, b: Compiled| match key(&b) < key(&a) {
        true => b,
        false => a,
    };
    let least = candidates.into_iter().reduce(better);
    least.expect("the first candidate is there, or its error was returned")
}

/// What a compensation that meets the tolerance of `options` takes, where the target may hold all that a blob can;
/// `None` if that does not meet it either.
fn unlimited(
    machine: &Machine,
    errors: &ErrorModel,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Option<Size>, CompileError> {
    let mut options = options.clone();
    options.tables.target = Target {
        samples: options.tables.target.samples,
        ..Target::desktop()
    };
    match compile(machine, errors, &options, progress) {
        Ok(found) if found.meets(1e3 * options.tables.tolerance) => Ok(Some(found.built.size)),
        Ok(_) | Err(CompileError::NoRoom { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

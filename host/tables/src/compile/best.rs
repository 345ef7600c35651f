//! Finds the best compensation that fits into a target, by trying several tolerances.

use super::{Built, CompileError, Compiled, Full, Options, Progress, Proof, compile_with};
use crate::schemes::{Effort, Finder};
use crate::size::Size;
use crate::target::Target;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_model::policy::tolerance_urad;

/// Tolerances (µm), tried in order until one is met.
pub const TOLERANCES: [f64; 8] = [0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0];
/// The coarsest tolerance accepted by default.
const COARSEST_DEFAULT: f64 = 1.0;
/// The finest tolerance, tried first by default.
pub const FINEST: f64 = TOLERANCES[0];

/// A compensation, and the tolerance it is judged by.
#[derive(Clone, Debug)]
pub struct Best {
    /// The blob and what is known about it.
    pub built: Built,
    /// What it does to the volumetric error.
    pub verification: Proof,
    /// The tolerance it is judged by (µm).
    pub tolerance: f64,
    /// A coarser tolerance (µm) that is met, if `tolerance` is missed.
    pub fits_um: Option<f64>,
    /// How the target is full, if that is why the tolerance is missed.
    pub full: Option<Full>,
}

/// The largest error at the positions of a verification has been up to a tenth above that at those of a search.
const A_LITTLE_FINER: f64 = 0.8;

impl Compiled {
    fn meets(&self, tolerance: f64) -> bool {
        self.verification.refusals(tolerance).is_empty()
    }

    /// True if it misses the tolerance, and what was made for one that is [`A_LITTLE_FINER`] would not miss it as much.
    fn nearly_meets(&self, tolerance: f64) -> bool {
        !self.meets(tolerance) && A_LITTLE_FINER * self.verification.finest() <= tolerance
    }

    fn does_harm(&self, tolerance: f64) -> bool {
        let refusals = self.verification.refusals(tolerance);
        refusals
            .iter()
            .any(|refusal| !refusal.yields_to_best_effort())
    }
}

impl Proof {
    /// The finest tolerance (µm) that is met, according to the largest deviations. It ranks compensations made for
    /// different tolerances.
    #[must_use]
    pub fn finest(&self) -> f64 {
        let inside = self.inside();
        // Ignore what every tolerance allows.
        match inside.difference_urad <= tolerance_urad(inside.policy, 0.0) {
            true => inside.difference_um,
            false => inside.difference_um.max(inside.difference_urad),
        }
    }
}

/// These options with another tolerance (µm).
fn of(options: &Options, tolerance: f64) -> Options {
    let mut options = options.clone();
    options.tables.tolerance = tolerance * 1e-3;
    options
}

/// Makes and proves a compensation for the requested tolerance (µm), or else for the finest of 0.05, 0.1, 0.2, 0.5
/// and 1 µm that is met. If none is met, tries coarser ones up to 10 µm until one is, and returns the result that
/// deviates least. So the result for a finer tolerance never deviates more than that for a coarser one of these, or
/// for the finest of them that is met. The tolerance in `options` is ignored.
///
/// [`CompileError`]; if the target is too small, only when none of the tolerances fits.
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
    let last = coarser.clone().next_back().unwrap_or(first);
    // The coarsest tolerance to accept; if none is met, the result is judged by it.
    let coarsest = match asked {
        None if keeps => COARSEST_DEFAULT,
        _ => first,
    };
    let mut finder = Finder::new(machine, errors, &options.scheme);
    let mut candidates: Vec<Compiled> = Vec::new();
    let mut fits_um = None;
    let mut is_full = false;
    for tolerance in [first].into_iter().chain(coarser) {
        let effort = match tolerance == last {
            true => Effort::Best,
            // The next one is accepted, too.
            false if asked.is_none() && tolerance < coarsest => Effort::IfNearlyMet,
            false => Effort::IfWithinReach,
        };
        let made_for = |finder: &mut Finder<'_>, tolerance: f64, effort: Effort| {
            let options = of(options, tolerance);
            compile_with(finder, machine, errors, &options, effort, progress)
        };
        let options = &of(options, tolerance);
        let candidate = match made_for(&mut finder, tolerance, effort) {
            // The verification sees other positions than the search, and may find a little more there.
            Ok(Some(missed))
                if keeps && asked == Some(tolerance) && missed.nearly_meets(tolerance) =>
            {
                match made_for(&mut finder, A_LITTLE_FINER * tolerance, effort) {
                    Ok(Some(finer)) if finer.meets(tolerance) => finer,
                    // What the target has no room for is no worse than what was missed.
                    Ok(_) | Err(CompileError::NoRoom { .. }) => missed,
                    Err(error) => return Err(error),
                }
            }
            Ok(Some(candidate)) => candidate,
            Ok(None) => {
                // Finer ones may have been left out for other reasons.
                is_full |= tolerance == coarsest;
                continue;
            }
            Err(CompileError::NoRoom { .. }) if !candidates.is_empty() => continue,
            Err(error) => return Err(error),
        };
        is_full |= tolerance <= coarsest && candidate.built.is_full;
        // A tolerance only counts as met if its own run meets it, because only that run repeats when a user requests
        // it.
        let is_own = candidate.meets(tolerance);
        if is_own && tolerance <= coarsest {
            // Made for this tolerance: what was made for a finer one deviates less, but costs more.
            return Ok(judged(candidate, tolerance, options));
        }
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
        full.unlimited = unlimited(
            &mut finder,
            machine,
            errors,
            &of(options, coarsest),
            progress,
        )?;
    }
    Ok(best)
}

/// A candidate, judged by a tolerance (µm).
fn judged(
    Compiled {
        built,
        verification,
    }: Compiled,
    tolerance: f64,
    options: &Options,
) -> Best {
    Best {
        full: Full::of(&built, &verification, &of(options, tolerance)),
        built,
        verification,
        tolerance,
        fits_um: None,
    }
}

/// The candidate that deviates least, preferring those that do no harm by a tolerance (µm). Needs at least one
/// candidate.
fn least(candidates: Vec<Compiled>, tolerance: f64) -> Compiled {
    let key = |c: &Compiled| (c.does_harm(tolerance), c.verification.finest());
    let better = |a: Compiled, b: Compiled| match key(&b) < key(&a) {
        true => b,
        false => a,
    };
    let least = candidates.into_iter().reduce(better);
    least.expect("the first candidate is there, or its error was returned")
}

/// The size of a compensation that meets the tolerance of `options` without limits of the target; `None` if that
/// does not meet it either, or not without joint effects of motions.
fn unlimited(
    finder: &mut Finder<'_>,
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
    let effort = Effort::IfItFits;
    match compile_with(finder, machine, errors, &options, effort, progress) {
        Ok(Some(found)) if found.meets(1e3 * options.tables.tolerance) => {
            Ok(Some(found.built.size))
        }
        Ok(_) | Err(CompileError::NoRoom { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

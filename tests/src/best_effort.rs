//! Whatever the requested tolerance: the result leaves no larger error than the result for a coarser one. Tested with a
//! target that is too small for most machines.

use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_tables::compile::{Best, Options, TOLERANCES, best};
use trueaxis_tables::target::Target;

/// The remaining error (µm or µrad) for a tolerance, and whether the tolerance is met.
fn left(machine: &Machine, errors: &ErrorModel, target: &Target, tolerance: f64) -> (f64, bool) {
    let mut options = Options {
        random: 1000,
        ..Options::default()
    };
    options.tables.target = target.clone();
    let found = best(machine, errors, &options, Some(tolerance), &());
    let Best { verification, .. } =
        found.unwrap_or_else(|error| panic!("{}: {error}", machine.name));
    (verification.finest(), verification.meets(tolerance))
}

/// Takes finer tolerances first. If a finer and a coarser one are both missed, the finer one leaves at most the error
/// of the coarser one. If the coarser one is met, the finer one meets it as well; how far below it stays is chance.
/// Returns whether the finer one is missed.
///
/// # Panics
/// If that does not hold.
#[must_use]
pub fn is_finer_missed(name: &str, machine: &Machine, errors: &ErrorModel) -> bool {
    let target = Target {
        tables: 8,
        terms: 12,
        ..Target::stm32f405()
    };
    let tried = [TOLERANCES[0], TOLERANCES[4]];
    let [(finer, is_finer_met), (coarser, is_coarser_met)] =
        tried.map(|tolerance| left(machine, errors, &target, tolerance));
    let most = if is_coarser_met { tried[1] } else { coarser };
    assert!(is_finer_met || finer <= most, "{name}: {finer} > {most}");
    !is_finer_met
}

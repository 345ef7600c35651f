//! Whatever the tolerance asked for: what is made leaves no more than what is made for a coarser one. Shown
//! with a target that is too small for most machines.

use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_tables::compile::{Best, Options, TOLERANCES, best};
use trueaxis_tables::target::Target;

/// What is left (µm, µrad alike) for a tolerance, and whether that is met.
fn left(machine: &Machine, errors: &ErrorModel, target: &Target, tolerance: f64) -> (f64, bool) {
    let mut options = Options {
        random: 1000,
        ..Options::default()
    };
    options.tables.target = target.clone();
    let found = best(machine, errors, &options, Some(tolerance), &());
    let Best { proof, .. } = found.unwrap_or_else(|error| panic!("{}: {error}", machine.name));
    (proof.finest(), proof.meets(tolerance))
}

/// Finer tolerances first. What a finer one leaves that is missed is at most what a coarser one leaves that is
/// missed, and meets a coarser one that is met: how much less than that is left then is chance. Returns whether
/// the finer one is missed.
///
/// # Panics
/// Where that does not hold.
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

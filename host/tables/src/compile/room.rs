//! Reports that a target is too small for the tolerance.

use super::verdict::wanted;
use super::{Built, Options, Proof};
use crate::size::Size;
use crate::target::Usage;
use serde::Serialize;
use trueaxis_model::kinematics::Policy;
use trueaxis_model::policy::tolerance_urad;

/// A target that is full before the tolerance is met.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[error(
    "the target {target} is too small for {}; the best that fits takes {}{}{}",
    wanted(*.policy, *.tolerance_um), list(.used), or(.fits_um), or_unlimited(.unlimited)
)]
pub struct Full {
    /// Name of the target.
    pub target: String,
    /// Requested tolerance of linear axes, or at the tip (µm).
    pub tolerance_um: f64,
    /// Requested tolerance of rotary axes, or of the tool direction (µrad).
    pub tolerance_urad: f64,
    /// What the rotary axes correct.
    #[serde(skip)]
    pub policy: Policy,
    /// Capacity used by the best result.
    pub used: Vec<Usage>,
    /// A coarser tolerance (µm) that fits, if the scheme has found one. A run for that tolerance is not guaranteed
    /// to reach it again.
    pub fits_um: Option<f64>,
    /// Size of a compensation that meets the tolerance without limits of the target, if one was tried and found.
    pub unlimited: Option<Size>,
}

impl Full {
    /// Describes the full target, if that is why the tolerance is missed.
    #[must_use]
    pub fn of(built: &Built, verification: &Proof, options: &Options) -> Option<Self> {
        let tables = &options.tables;
        let tolerance_um = short(1e3 * tables.tolerance);
        if verification.meets(tolerance_um) || !built.is_full {
            return None;
        }
        Some(Self {
            target: tables.target.name.clone(),
            tolerance_um,
            tolerance_urad: tolerance_urad(tables.policy, tolerance_um),
            policy: tables.policy,
            used: tables.target.usage(&built.size),
            // The scheme has measured at its own positions; those of the verification decide.
            fits_um: built
                .meets
                .map(|mm| short(1e3 * mm))
                .filter(|um| verification.meets(*um)),
            unlimited: None,
        })
    }
}

fn list(used: &[Usage]) -> String {
    let texts: Vec<String> = used.iter().map(Usage::to_string).collect();
    texts.join(", ")
}

fn or(fits_um: &Option<f64>) -> String {
    fits_um.map_or_else(String::new, |um| format!("; with --tolerance {um} it fits"))
}

fn or_unlimited(unlimited: &Option<Size>) -> String {
    unlimited.map_or_else(String::new, |size| {
        format!(
            "; with room for all of it, {} banks, {} tables, {} terms and {} bytes meet it",
            size.banks, size.tables, size.terms, size.bytes
        )
    })
}

/// Rounded to four digits, so that the tolerance that was met is the one printed, which a user will type.
fn short(tolerance: f64) -> f64 {
    format!("{tolerance:.3e}").parse().unwrap_or(tolerance)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tolerances_to_type_are_short() {
        for factor in [1.0, 2.0, 5.0, 1e5] {
            let tolerance = short(1e3 * (0.05e-3 * factor));
            assert!(tolerance.to_string().len() <= 5, "{tolerance}");
        }
        assert_eq!(short(2.0 * (1.0 / 3.0)), 0.6667);
    }

    #[test]
    fn what_is_full_is_told_with_what_fits() {
        let usage = |what, used, held| Usage { what, used, held };
        let mut full = Full {
            target: "small".to_owned(),
            tolerance_um: 0.05,
            tolerance_urad: 0.05,
            policy: Policy::Orientation,
            used: vec![usage("tables", 9, 9), usage("terms", 11, 12)],
            fits_um: Some(0.5),
            unlimited: None,
        };
        let text = "the target small is too small for 0.05 µm and µrad; the best that fits takes 9 of 9 tables, 11 of 12 terms";
        let fits = "; with --tolerance 0.5 it fits";
        assert_eq!(full.to_string(), text.to_owned() + fits);
        full.fits_um = None;
        assert_eq!(full.to_string(), text);
        // From 1 µm on the two numbers are equal, but still do not apply to axes.
        full.policy = Policy::default();
        full.tolerance_um = 2.0;
        let tool = "2 µm at the tip and 2 µrad of the tool's direction";
        assert!(full.to_string().contains(tool), "{full}");
    }
}

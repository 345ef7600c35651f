//! Detects positions in metres or inches by known lengths.

use crate::estimate::Estimate;
use crate::rows::Problem;
use crate::{IdentifyError, bars};

/// Size of each unit in mm.
pub(crate) const UNITS: [(&str, f64); 2] = [("metres", 1000.0), ("inches", 25.4)];
/// Relative tolerance of nominal lengths.
const NEARLY: f64 = 0.1;

/// Refuses positions that are too small by the size of a unit wherever a length is known: bars, distances of balls,
/// the stylus if it can be identified. Also refuses bars whose length is far from that in the probings. `setup` is
/// the fit of the nominal machine.
pub(crate) fn are_mm(problem: &Problem<'_>, setup: &Estimate) -> Result<(), IdentifyError> {
    let known = problem.lengths(setup);
    for (unit, factor) in UNITS {
        let is_unit = |(_, known, found): &(String, f64, f64)| {
            (known / (found * factor) - 1.0).abs() < NEARLY
        };
        if let Some((what, length, found)) = known.first()
            && known.iter().all(is_unit)
        {
            return Err(IdentifyError::OtherUnit {
                what: what.clone(),
                known: *length,
                found: *found,
                unit,
            });
        }
    }
    bars::are_likely(problem, setup)
}

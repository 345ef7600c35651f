//! What is stated beforehand about a set-up, beside what is found.

/// What was stated beforehand about a part of a set-up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// The stated value (mm; 0 for a rotation, which is counted from the stated orientation).
    pub value: f64,
    /// Standard uncertainty (mm or rad).
    pub sigma: f64,
    /// How far the value found is from the stated one, in standard deviations that chance would give; `None` if no other
    /// measurement tells anything about it. This is Baarda's w of the equation of the prior.
    pub z: Option<f64>,
}

/// A prior counts as checked if the other measurements know its value to within a hundred of its standard uncertainties.
const LEAST_CHECKED: f64 = 1e-4;

impl Prior {
    /// From the stated value, its uncertainty as it was used, and what was found with which uncertainty.
    pub(crate) fn new(value: f64, sigma: f64, used: f64, found: f64, uncertainty: f64) -> Self {
        // A residual of least squares has the variance of its equation less that of its fit.
        let variance = used * used - uncertainty * uncertainty;
        let is_checked = variance > LEAST_CHECKED * used * used;
        Self {
            value,
            sigma,
            z: is_checked.then(|| (found - value) / variance.sqrt()),
        }
    }
}

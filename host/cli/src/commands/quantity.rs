//! How parameters, uncertainties and numbers of things are shown.

pub use trueaxis_report::unit;

/// Coverage factor of expanded uncertainties: 95 %.
pub const EXPANDED: f64 = 2.0;

/// A number of things.
pub fn count(number: usize, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}

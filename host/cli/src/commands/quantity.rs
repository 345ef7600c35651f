//! Formats parameters, uncertainties and counts.

use trueaxis_model::errors::Parameter;
pub use trueaxis_report::unit;

/// Coverage factor of expanded uncertainties: 95 %.
pub const EXPANDED: f64 = 2.0;

/// A formatter for values of a parameter, and their unit.
pub fn shown(parameter: Parameter) -> (impl Fn(f64) -> String, &'static str) {
    let (factor, unit) = unit(parameter);
    let show = move |value: f64| match factor {
        Some(factor) => format!("{:.2}", value * factor),
        None => format!("{value:.2e}"),
    };
    (show, unit)
}

/// A count with its noun, in the plural if needed.
pub fn count(number: usize, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}

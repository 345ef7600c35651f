//! How parameters, uncertainties and numbers of things are shown.

use trueaxis_host::errors::{Parameter, ParameterKind};

/// Coverage factor of expanded uncertainties: 95 %.
pub const EXPANDED: f64 = 2.0;

/// A number of things.
pub fn count(number: usize, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}

/// In what a parameter is shown.
pub fn unit(parameter: Parameter) -> (Option<f64>, &'static str) {
    match (parameter.kind, parameter.is_angular()) {
        (ParameterKind::Degree(1), false) if "XYZUVW".contains(parameter.axis) => {
            (Some(1e6), "µm/m")
        }
        (ParameterKind::Degree(k), angular) if k > 0 => (
            None,
            if angular {
                "rad per mm or rad to the degree"
            } else {
                "mm per mm or rad to the degree"
            },
        ),
        (_, true) => (Some(1e6), "µrad"),
        (_, false) => (Some(1e3), "µm"),
    }
}

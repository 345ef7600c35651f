//! Units of instrument readings.

/// Size of a unit in mm or rad.
///
/// # Errors
/// Cause and remedy, if it is not a unit of length, or of angle if `is_angular`.
pub fn factor(unit: &str, is_angular: bool) -> Result<f64, (String, String)> {
    match (unit, is_angular) {
        ("mm", false) | ("rad", true) => Ok(1.0),
        ("um" | "µm" | "μm", false) => Ok(1e-3),
        ("in" | "inch", false) => Ok(25.4),
        ("deg", true) => Ok(1.0_f64.to_radians()),
        ("mrad", true) => Ok(1e-3),
        ("urad" | "µrad" | "μrad", true) => Ok(1e-6),
        ("arcsec", true) => Ok((1.0_f64 / 3600.0).to_radians()),
        (other, _) => {
            let (what, units) = match is_angular {
                true => ("angle", "rad, mrad, urad, arcsec or deg"),
                false => ("length", "mm, um or in"),
            };
            let message = format!("`{other}` is not a unit of {what}");
            Err((message, format!("write {units}")))
        }
    }
}

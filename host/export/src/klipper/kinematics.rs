//! The kinematics of a printer, as `printer.cfg` has them.

use super::config::sections;
use trueaxis_model::source::FileError;

/// Kinematics whose carriages do not move along X, Y and Z one by one, nor in a frame of such rails as those of CoreXY do.
const OTHERS: [&str; 5] = ["delta", "deltesian", "polar", "rotary_delta", "winch"];

/// Whether a map over X and Y can show errors of axes along X, Y and Z. A file without `[printer]` does not tell.
///
/// # Errors
/// [`FileError`] that names the kinematics.
pub fn check(text: &str) -> Result<(), FileError> {
    for section in sections(text) {
        let found = section.given("kinematics");
        let Some(found) = found.filter(|_| section.name == "printer") else {
            continue;
        };
        let kinematics = found.value();
        if OTHERS.contains(&kinematics.as_str()) {
            return Err(found.line.bad(
                format!(
                    "kinematics: {kinematics}: heights over X and Y are not errors of axes along X, Y and Z"
                ),
                "let Klipper's own bed_mesh correct this printer",
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn printers_without_axes_along_x_and_y_are_refused_by_name() {
        for (name, is_fine) in [
            ("cartesian", true),
            ("corexy", true),
            ("delta", false),
            ("polar", false),
        ] {
            let text = format!("[mcu]\nkinematics: delta\n[printer]\nkinematics: {name} # own\n");
            match check(&text) {
                Ok(()) => assert!(is_fine),
                Err(error) => {
                    assert!(!is_fine && error.message.contains(name));
                    assert_eq!(error.line(&text), Some(4));
                }
            }
        }
        assert!(check("[bed_mesh default]\n").is_ok());
        assert!(check("[printer]\n  max_velocity: 300\n  kinematics: delta\n").is_err());
    }
}

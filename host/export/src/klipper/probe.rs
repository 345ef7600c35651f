//! The place of a probe beside the nozzle, as `printer.cfg` has it.

use super::config::sections;
use trueaxis_model::source::FileError;

/// `x_offset` and `y_offset` (mm) of the probe of a file, if it has one: of `[probe]`, `[bltouch]` and every other section
/// that gives both.
///
/// # Errors
/// [`FileError`]: two sections that differ, or no number.
pub fn offset(text: &str) -> Result<Option<[f64; 2]>, FileError> {
    let mut found: Option<[f64; 2]> = None;
    for section in sections(text) {
        let (Some(x), Some(y)) = (section.given("x_offset"), section.given("y_offset")) else {
            continue;
        };
        let offset = [x.line.number(x.value)?, y.line.number(y.value)?];
        match found {
            Some(other) if other != offset => {
                return Err(x.line.bad(
                    format!("[{}] is a second probe at another place", section.name),
                    "say with --probe X,Y which of them has measured",
                ));
            }
            _ => found = Some(offset),
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_probe_of_a_file_is_found_whatever_its_section_is_called() {
        let text = "[bltouch]\nx_offset: -24.0\ny_offset: -13 # mm\n[bed_mesh]\nmesh_min: 30, 30\n";
        assert_eq!(offset(text).unwrap(), Some([-24.0, -13.0]));
        assert_eq!(offset("[bed_mesh]\nmesh_min: 30, 30\n").unwrap(), None);
        let two = format!("{text}[probe_eddy_current btt]\nx_offset: 0\ny_offset: 20\n");
        let error = offset(&two).unwrap_err();
        assert_eq!(error.line(&two), Some(7), "{error:?}");
    }
}

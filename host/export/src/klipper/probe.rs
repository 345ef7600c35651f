//! The place of a probe beside the nozzle, as `printer.cfg` has it.

use super::config::{ConfigEntry, sections};
use trueaxis_model::source::FileError;

/// Sections whose `x_offset` is not that of a probe, whatever follows the word.
const NOT_A_PROBE: &str = "display";

/// `x_offset` and `y_offset` (mm) of the probe of a file, if it gives either; a missing one is 0, as in Klipper.
///
/// # Errors
/// [`FileError`]: two sections that differ, no number, or no offset in a file that includes others.
pub fn offset(text: &str) -> Result<Option<[f64; 2]>, FileError> {
    let mut found: Option<[f64; 2]> = None;
    let sections = sections(text);
    for section in &sections {
        let given = ["x_offset", "y_offset"].map(|key| section.given(key));
        let first = given.into_iter().flatten().next();
        let Some(first) = first.filter(|_| !section.name.starts_with(NOT_A_PROBE)) else {
            continue;
        };
        let mut offset = [0.0; 2];
        for (to, given) in offset.iter_mut().zip(given) {
            *to = given.map_or(Ok(0.0), ConfigEntry::number)?;
        }
        match found {
            Some(other) if other != offset => {
                return Err(first.line.bad(
                    format!("[{}] is a second probe at another place", section.name),
                    "say with --probe X,Y which of them has measured",
                ));
            }
            _ => found = Some(offset),
        }
    }
    match sections.iter().find(|section| section.is_include()) {
        Some(include) if found.is_none() => Err(include.line.bad(
            "the probe may be in the file that is included here, which is not read",
            "give --probe X,Y: x_offset and y_offset of the probe, or 0,0 for the nozzle",
        )),
        _ => Ok(found),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_probe_of_a_file_is_found_whatever_its_section_is_called() {
        let text = "[bltouch]\nx_offset: -24.0\ny_offset: -13 # mm\n[bed_mesh]\nmesh_min: 30, 30\n";
        assert_eq!(offset(text).unwrap(), Some([-24.0, -13.0]));
        assert_eq!(offset("[bed_mesh]\nmesh_min: 30, 30\n").unwrap(), None);
        // As Klipper reads them: a missing one is 0, letters of any case, the last one counts.
        assert_eq!(
            offset("[probe]\nx_offset: -28\n").unwrap(),
            Some([-28.0, 0.0])
        );
        let again = "[probe]\nX_Offset: 1\ny_offset: 2\nx_offset: 3\n";
        assert_eq!(offset(again).unwrap(), Some([3.0, 2.0]));
        assert_eq!(
            offset("[display]\nx_offset: 2\n[bed_mesh]\n").unwrap(),
            None
        );
        assert_eq!(offset("[display]\nx_offset: 2\n[probe]\n").unwrap(), None);
        for name in [
            "beacon",
            "cartographer",
            "dockable_probe",
            "load_cell_probe",
        ] {
            let text = format!("[{name}]\n  y_offset: 25\n");
            assert_eq!(offset(&text).unwrap(), Some([0.0, 25.0]));
        }
        let elsewhere = "[include bltouch.cfg]\n[bed_mesh]\n";
        assert_eq!(offset(elsewhere).unwrap_err().line(elsewhere), Some(1));
        assert_eq!(
            offset(&format!("{elsewhere}{again}")).unwrap(),
            Some([3.0, 2.0])
        );
        let two = format!("{text}[probe_eddy_current btt]\nx_offset: 0\ny_offset: 20\n");
        let error = offset(&two).unwrap_err();
        assert_eq!(error.line(&two), Some(7), "{error:?}");
    }
}

//! The place of a probe beside the nozzle, as `printer.cfg` has it.

use super::config::sections;
use trueaxis_model::source::FileError;

/// Sections of probes, whatever follows the word. Others have offsets, too: `[display]` that of its picture.
const PROBES: [&str; 3] = ["probe", "bltouch", "smart_effector"];

/// `x_offset` and `y_offset` (mm) of the probe of a file, if it has one: of the sections of probes, in which a missing one is
/// 0, as in Klipper, and of every other section that gives both.
///
/// # Errors
/// [`FileError`]: two sections that differ, no number, or no probe in a file that includes others.
pub fn offset(text: &str) -> Result<Option<[f64; 2]>, FileError> {
    let mut found: Option<[f64; 2]> = None;
    let sections = sections(text);
    let is_probe = |name: &str| PROBES.iter().any(|probe| name.starts_with(probe));
    for section in &sections {
        let given = ["x_offset", "y_offset"].map(|key| section.given(key));
        let count = given.iter().flatten().count();
        let Some(first) = given.into_iter().flatten().next() else {
            continue;
        };
        if count < 2 && !is_probe(section.name) {
            continue;
        }
        let mut offset = [0.0; 2];
        for (to, given) in offset.iter_mut().zip(given) {
            *to = given.map_or(Ok(0.0), |given| given.line.number(given.value))?;
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
    // What SAVE_CONFIG adds to the section of a probe is no place.
    let is_at_nozzle = || sections.iter().any(|section| is_probe(section.name));
    match sections.iter().find(|section| section.is_include()) {
        _ if found.is_some() => Ok(found),
        Some(include) => Err(include.line.bad(
            "the probe may be in the file that is included here, which is not read",
            "give --probe X,Y: x_offset and y_offset of the probe, or 0,0 for the nozzle",
        )),
        None => Ok(is_at_nozzle().then_some([0.0; 2])),
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
        assert_eq!(
            offset("[display]\nx_offset: 2\n[probe]\n").unwrap(),
            Some([0.0; 2])
        );
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

//! The lines of an INI file that bring the component and its panel into a machine.

/// The panel, below `[DISPLAY]`: a tab of the screen.
pub const PANEL: [&str; 2] = [
    "EMBED_TAB_NAME = Compensation",
    "EMBED_TAB_COMMAND = gladevcp -c trueaxis-panel -x {XID} -u /usr/share/trueaxis/trueaxis_panel.py /usr/share/trueaxis/trueaxis-panel.ui",
];

/// The text of an INI file with the HAL file `hal` after the others, and with the panel; what is there already is not
/// written again. The lines `taken_out`, counted from 1, become comments.
///
/// # Errors
/// The name of a section that this file does not have (it may be in one that it includes).
pub fn install(ini: &str, hal: &str, taken_out: &[usize]) -> Result<String, &'static str> {
    let mut kept = String::new();
    for (k, line) in ini.split_inclusive('\n').enumerate() {
        if taken_out.contains(&(k + 1)) {
            kept += "# ";
        }
        kept += line;
    }
    let ini = &kept;
    let line = format!("HALFILE = {hal}");
    let with_hal = match lines(ini).any(|l| is_entry(l, "HALFILE", hal)) {
        true => ini.to_owned(),
        false => insert(ini, "HAL", "HALFILE", &[&line])?,
    };
    match with_hal.contains("trueaxis-panel") {
        true => Ok(with_hal),
        false => insert(&with_hal, "DISPLAY", "DISPLAY", &PANEL),
    }
}

fn lines(ini: &str) -> impl Iterator<Item = &str> {
    ini.lines().map(str::trim)
}

/// Whether a line is this entry.
fn is_entry(line: &str, key: &str, value: &str) -> bool {
    let entry = line.split_once('=');
    entry.is_some_and(|(k, v)| k.trim() == key && v.trim() == value)
}

/// Adds lines to a section, after its last entry with this key, or after its name.
fn insert(
    ini: &str,
    section: &'static str,
    key: &str,
    added: &[&str],
) -> Result<String, &'static str> {
    let mut within = false;
    let mut after = None;
    for (number, line) in lines(ini).enumerate() {
        if line.starts_with('[') {
            within = line.strip_prefix('[').and_then(|l| l.split(']').next()) == Some(section);
            if within && after.is_none() {
                after = Some(number);
            }
        } else if within && line.split_once('=').is_some_and(|(k, _)| k.trim() == key) {
            after = Some(number);
        }
    }
    let after = after.ok_or(section)?;
    let end = if ini.contains("\r\n") { "\r\n" } else { "\n" };
    let mut text = String::new();
    for (number, line) in ini.split_inclusive('\n').enumerate() {
        text += line;
        if number == after {
            if !line.ends_with('\n') {
                text += end;
            }
            for line in added {
                text += line;
                text += end;
            }
        }
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    const INI: &str = "[DISPLAY]\nDISPLAY = axis\nCYCLE_TIME = 0.1\n[HAL]\nHALFILE = a.hal\nHALUI = halui\n\
                       HALFILE = b.hal\nPOSTGUI_HALFILE = c.hal\n[TRAJ]\n";

    #[test]
    fn the_hal_file_is_the_last_one_and_the_panel_is_below_display() {
        let [name, command] = PANEL;
        let expected = format!(
            "[DISPLAY]\nDISPLAY = axis\n{name}\n{command}\nCYCLE_TIME = 0.1\n[HAL]\nHALFILE = a.hal\nHALUI = halui\n\
             HALFILE = b.hal\nHALFILE = trueaxis.hal\nPOSTGUI_HALFILE = c.hal\n[TRAJ]\n"
        );
        assert_eq!(install(INI, "trueaxis.hal", &[]), Ok(expected.clone()));
        // Only once.
        assert_eq!(
            install(&expected, "trueaxis.hal", &[]),
            Ok(expected.clone())
        );
        // With the line ends of the file.
        let [windows, expected] = [INI, &expected].map(|text| text.replace('\n', "\r\n"));
        assert_eq!(install(&windows, "trueaxis.hal", &[]), Ok(expected));
    }

    #[test]
    fn a_missing_section_is_named_and_a_missing_last_line_end_is_added() {
        assert_eq!(install("[DISPLAY]\n", "x.hal", &[]), Err("HAL"));
        assert_eq!(
            install("[HAL]\nHALFILE = a.hal", "x.hal", &[]),
            Err("DISPLAY")
        );
        let last = install("[DISPLAY]\n[HAL]\nHALFILE = a.hal", "x.hal", &[]);
        assert!(last.is_ok_and(|text| text.ends_with("HALFILE = a.hal\nHALFILE = x.hal\n")));
    }

    #[test]
    fn lines_that_are_taken_out_become_comments() {
        let text = install(INI, "trueaxis.hal", &[3]).unwrap();
        assert!(text.contains("\n# CYCLE_TIME = 0.1\n[HAL]\n"), "{text}");
    }

    /// No line is longer than LinuxCNC reads (LINELEN of its inifile.hh).
    #[test]
    fn lines_are_short_enough_for_linuxcnc() {
        assert!(PANEL.iter().all(|line| line.len() < 255));
    }
}

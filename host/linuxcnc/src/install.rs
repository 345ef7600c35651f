//! The lines of an INI file that bring the component and its panel into a machine.

use crate::formats::ini::joined;

/// The panel, below `[DISPLAY]`: a tab of the screen.
pub const PANEL: [&str; 2] = [
    "EMBED_TAB_NAME = Compensation",
    "EMBED_TAB_COMMAND = gladevcp -c trueaxis-panel -x {XID} -u /usr/share/trueaxis/trueaxis_panel.py /usr/share/trueaxis/trueaxis-panel.ui",
];

/// How a line begins that `install` has taken out.
const TAKEN_OUT: &str = "# trueaxis has in errors.toml: ";

/// The text of an INI file with the HAL file `hal` after the others, and with the panel; what is there already is not
/// written again. The lines `taken_out`, counted from 1, become comments.
///
/// # Errors
/// The name of a section that this file does not have (it may be in one that it includes).
pub fn install(ini: &str, hal: &str, taken_out: &[usize]) -> Result<String, &'static str> {
    let mut text = String::new();
    for line in lines(ini) {
        let is_taken_out = taken_out.contains(&line.number);
        for part in line.text.split_inclusive('\n') {
            if is_taken_out {
                text += TAKEN_OUT;
            }
            text += part;
        }
    }
    let line = format!("HALFILE = {hal}");
    if !has(&text, "HAL", "HALFILE", |value| value == hal) {
        text = insert(&text, "HAL", "HALFILE", &[&line])?;
    }
    let is_panel = |value: &str| value.contains("trueaxis-panel");
    if !has(&text, "DISPLAY", "EMBED_TAB_COMMAND", is_panel) {
        text = insert(&text, "DISPLAY", "DISPLAY", &PANEL)?;
    }
    Ok(text)
}

/// A line of an INI file with those that continue it.
struct IniLine<'i> {
    /// That of its first line, from 1.
    number: usize,
    /// With the ends of its lines.
    text: &'i str,
    /// As LinuxCNC reads it.
    joined: String,
}

impl IniLine<'_> {
    /// The section that begins here.
    fn section(&self) -> Option<&str> {
        self.joined.strip_prefix('[')?.split(']').next()
    }

    fn entry(&self) -> Option<(&str, &str)> {
        let (key, value) = self.joined.split_once('=')?;
        let is_comment = key.starts_with(['#', ';']);
        (!is_comment).then(|| (key.trim(), value.trim()))
    }
}

fn lines(ini: &str) -> Vec<IniLine<'_>> {
    let joined = joined(ini);
    let starts = joined.iter().map(|(_, span)| span.start);
    let ends = starts.skip(1).chain([ini.len()]);
    let mut number = 1;
    let lines = joined.iter().zip(ends).map(|((line, span), end)| {
        let text = &ini[span.start..end];
        let line = IniLine {
            number,
            text,
            joined: line.trim_start_matches('\u{feff}').trim().to_owned(),
        };
        number += text.matches('\n').count();
        line
    });
    lines.collect()
}

/// Whether a section has an entry with such a value.
fn has(ini: &str, section: &str, key: &str, is_wanted: impl Fn(&str) -> bool) -> bool {
    let mut within = false;
    lines(ini).iter().any(|line| {
        within = line
            .section()
            .map_or(within, |found| found.trim() == section);
        within
            && line
                .entry()
                .is_some_and(|(k, value)| k == key && is_wanted(value))
    })
}

/// Adds lines to a section, after its last entry with this key, or after its name.
fn insert(
    ini: &str,
    section: &'static str,
    key: &str,
    added: &[&str],
) -> Result<String, &'static str> {
    let lines = lines(ini);
    let mut within = false;
    let mut after = None;
    for (k, line) in lines.iter().enumerate() {
        if let Some(found) = line.section() {
            within = found.trim() == section;
            after = after.or(within.then_some(k));
        } else if within && line.entry().is_some_and(|(k, _)| k == key) {
            after = Some(k);
        }
    }
    let after = after.ok_or(section)?;
    let end = if ini.contains("\r\n") { "\r\n" } else { "\n" };
    let mut text = String::new();
    for (k, line) in lines.iter().enumerate() {
        text += line.text;
        if k == after {
            let is_ended = line.text.ends_with('\n');
            if !is_ended {
                text += end;
            }
            if is_continued(line.text) {
                text += end;
            }
            text += &added.join(end);
            // What comes last still has no end then.
            if is_ended {
                text += end;
            }
        }
    }
    Ok(text)
}

/// Whether the last line of a text ends with a backslash, at the end of the file, where it continues nothing.
fn is_continued(text: &str) -> bool {
    text.trim_end_matches(['\r', '\n']).ends_with('\\')
}

/// The text of an INI file as it was before [`install`]: without the HAL file `hal` and the panel, and with the lines that
/// were taken out. `None` if it has nothing of that.
#[must_use]
pub fn remove(ini: &str, hal: &str) -> Option<String> {
    let lines = lines(ini);
    let mut section = "";
    let mut ours = Vec::new();
    for line in &lines {
        section = line.section().map_or(section, str::trim);
        ours.push(match (section, line.entry()) {
            ("HAL", Some(("HALFILE", value))) => value == hal,
            ("DISPLAY", Some(_)) => PANEL.contains(&line.joined.as_str()),
            _ => false,
        });
    }
    let mut text = String::new();
    let mut is_changed = false;
    for (k, line) in lines.iter().enumerate() {
        if !ours[k] {
            for part in line.text.split_inclusive('\n') {
                let before = part.strip_prefix(TAKEN_OUT);
                is_changed |= before.is_some();
                text += before.unwrap_or(part);
            }
            continue;
        }
        is_changed = true;
        if !line.text.ends_with('\n') {
            unended(&mut text);
        }
        let is_last = ours.get(k + 1).is_none_or(|is_ours| !is_ours);
        if is_last && is_continued(&text) {
            unended(&mut text);
        }
    }
    is_changed.then_some(text)
}

/// Takes one end of a line from the end of a text.
fn unended(text: &mut String) {
    if text.ends_with('\n') {
        text.pop();
        if text.ends_with('\r') {
            text.pop();
        }
    }
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
        assert!(last.is_ok_and(|text| text.ends_with("HALFILE = a.hal\nHALFILE = x.hal")));
    }

    #[test]
    fn lines_that_are_taken_out_become_comments() {
        let text = install(INI, "trueaxis.hal", &[3]).unwrap();
        let taken_out = format!("\n{TAKEN_OUT}CYCLE_TIME = 0.1\n[HAL]\n");
        assert!(text.contains(&taken_out), "{text}");
    }

    #[test]
    fn continued_lines_stay_whole() {
        let ini = INI.replace("HALFILE = b.hal", "HALFILE = \\\nb.hal");
        let ini = ini.replace("CYCLE_TIME = 0.1", "CYCLE_TIME = \\\n0.1");
        let text = install(&ini, "trueaxis.hal", &[3]).unwrap();
        for part in [
            "HALFILE = \\\nb.hal\nHALFILE = trueaxis.hal\n",
            &format!("{TAKEN_OUT}CYCLE_TIME = \\\n{TAKEN_OUT}0.1\n[HAL]"),
        ] {
            assert!(text.contains(part), "{text}");
        }
        // Lines are counted as in an editor.
        let text = install(&ini, "trueaxis.hal", &[10]).unwrap();
        assert!(
            text.contains(&format!("{TAKEN_OUT}POSTGUI_HALFILE = c.hal")),
            "{text}"
        );
    }

    #[test]
    fn comments_and_other_sections_are_no_panel() {
        let [_, command] = PANEL;
        for before in [format!("# {command}\n[HAL]"), format!("[HAL]\n{command}")] {
            let ini = INI.replacen("[HAL]", &before, 1);
            let text = install(&ini, "trueaxis.hal", &[]).unwrap();
            let panels = text.lines().filter(|line| *line == command).count();
            let already = ini.lines().filter(|line| *line == command).count();
            assert_eq!(panels, already + 1, "{text}");
        }
    }

    #[test]
    fn what_was_installed_can_be_removed_byte_for_byte() {
        let last_hal = "[DISPLAY]\nDISPLAY = axis\n[HAL]\nHALFILE = a.hal";
        let last_display = "[HAL]\nHALFILE = a.hal\n[DISPLAY]\nDISPLAY = axis";
        let mut inis: Vec<String> = Vec::new();
        for ini in [INI, last_hal, last_display] {
            for end in [
                "",
                "\n",
                "\n\n",
                " \\",
                " \\\n",
                " \\\n\n",
                " \\\n\n[TRAJ]\n",
            ] {
                let ini = format!("{}{end}", ini.trim_end_matches('\n'));
                inis.push(ini.replace('\n', "\r\n"));
                inis.push(ini.replace("CYCLE_TIME = 0.1", "CYCLE_TIME = \\\n0.1"));
                inis.push(ini);
            }
        }
        for ini in inis {
            for taken_out in [&[][..], &[2]] {
                let installed = install(&ini, "trueaxis.hal", taken_out).unwrap();
                let removed = remove(&installed, "trueaxis.hal");
                assert_eq!(removed.as_deref(), Some(&*ini), "{installed:?}");
            }
            assert_eq!(remove(&ini, "trueaxis.hal"), None);
        }
    }

    #[test]
    fn what_was_changed_since_stays() {
        let installed = install(INI, "trueaxis.hal", &[3]).unwrap();
        let edited = installed.replace("[TRAJ]\n", "[TRAJ]\nLINEAR_UNITS = mm\n");
        let expected = INI.replace("[TRAJ]\n", "[TRAJ]\nLINEAR_UNITS = mm\n");
        assert_eq!(remove(&edited, "trueaxis.hal"), Some(expected));
    }

    /// No line is longer than LinuxCNC reads (LINELEN of its inifile.hh).
    #[test]
    fn lines_are_short_enough_for_linuxcnc() {
        assert!(PANEL.iter().all(|line| line.len() < 255));
    }
}

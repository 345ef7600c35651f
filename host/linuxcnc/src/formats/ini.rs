//! INI files as LinuxCNC reads them: keys may repeat, files are included, and a backslash continues a line.
//!
//! This is a separate parser because existing ones do not keep the line of a value, which messages need, do not know
//! `#INCLUDE`, and give `#` within a line a meaning that it does not have here.

use std::ops::Range;
use std::rc::Rc;
use trueaxis_model::source::{FileError, Named, leading_number};

/// A place in a file.
#[derive(Clone, Debug)]
pub struct FileLocation {
    /// The file.
    pub source: Rc<Named>,
    /// Bytes of the first line.
    pub span: Range<usize>,
}

impl FileLocation {
    /// Line, counted from 1.
    #[must_use]
    pub fn line(&self) -> usize {
        let start = self.span.start.min(self.source.text.len());
        let before = &self.source.text.as_bytes()[..start];
        before.iter().filter(|b| **b == b'\n').count() + 1
    }

    /// An error at this place.
    pub fn error(
        &self,
        message: impl Into<String>,
        label: impl Into<String>,
        remedy: impl Into<String>,
    ) -> FileError {
        FileError::at(self.span.clone(), message, label, remedy)
            .within(&self.source.name, &self.source.text)
    }
}

/// `KEY = value` in a section.
#[derive(Clone, Debug)]
pub struct IniEntry {
    /// The section, without brackets; empty before the first one.
    pub section: String,
    /// The key.
    pub key: String,
    /// The text after the equals sign, without surrounding spaces.
    pub value: String,
    /// Place.
    pub place: FileLocation,
}

impl IniEntry {
    /// The number at the start of the value, and the text after it, which LinuxCNC 2.10 ignores; `None` if there is no
    /// number, or if the text directly follows it, as in `40+35` or `6O`.
    #[must_use]
    pub fn number(&self) -> Option<(f64, &str)> {
        let (number, after) = leading_number(&self.value)?;
        let is_apart = |c: char| c.is_whitespace() || matches!(c, '#' | ';');
        (after.is_empty() || after.starts_with(is_apart)).then(|| (number, after.trim_start()))
    }
}

/// A line that LinuxCNC reads otherwise than it looks, or not in every version.
#[derive(Clone, Debug)]
pub struct Remark {
    /// Place of the line.
    pub place: FileLocation,
    /// What LinuxCNC does.
    pub reason: String,
    /// What to write there.
    pub write: String,
}

/// An INI file with what it includes.
#[derive(Debug)]
pub struct Ini {
    entries: Vec<IniEntry>,
    sections: Vec<(String, FileLocation)>,
    /// Lines that versions of LinuxCNC read differently.
    pub remarks: Vec<Remark>,
}

/// LinuxCNC 2.10 follows `#INCLUDE` to this depth; 2.9 to a depth of 1.
const DEEPEST: usize = 16;

/// Opens a file by its name in an INI or HAL file; returns the cause of a failure.
pub type Open<'o> = dyn Fn(&str) -> Result<Named, String> + 'o;

/// The lines of a file with their bytes, without line endings.
pub(super) fn lines(text: &str) -> impl Iterator<Item = (&str, Range<usize>)> {
    let mut next = 0;
    text.split_inclusive('\n').map(move |line| {
        let start = next;
        next += line.len();
        let line = line.trim_end_matches(['\n', '\r']);
        (line, start..start + line.len())
    })
}

/// The remedy where a version of LinuxCNC reads a line.
const AS_MEANT: &str = "nothing, if that is meant";

/// Whether every version of LinuxCNC reads a line with this key.
fn is_key(key: &str) -> bool {
    let is_letter = |c: char| c.is_ascii_alphanumeric() || c == '_';
    key.chars().all(is_letter) && !key.is_empty() && !key.starts_with(|c: char| c.is_ascii_digit())
}

/// The file that a line includes; a comment if another letter follows.
fn included(line: &str) -> Option<&str> {
    let name = line.strip_prefix("#INCLUDE")?;
    (name.is_empty() || name.starts_with(char::is_whitespace)).then_some(name.trim())
}

/// Lines, joined where a backslash at the end continues them; the place is that of the first line.
pub(crate) fn joined(text: &str) -> Vec<(String, Range<usize>)> {
    let mut found: Vec<(String, Range<usize>)> = Vec::new();
    let mut goes_on = false;
    for (line, span) in lines(text) {
        let (part, more) = match line.strip_suffix('\\') {
            Some(part) => (part, true),
            None => (line, false),
        };
        match found.last_mut() {
            Some((whole, _)) if goes_on => whole.push_str(part),
            _ => found.push((part.to_owned(), span)),
        }
        goes_on = more;
    }
    found
}

impl Ini {
    /// Reads a file. `read` opens the files that it includes, whose names are relative to it.
    ///
    /// # Errors
    /// [`FileError`]: a section without its closing bracket, files that include each other.
    pub fn read(source: Named, read: &Open<'_>) -> Result<Self, FileError> {
        let mut ini = Self {
            entries: Vec::new(),
            sections: Vec::new(),
            remarks: Vec::new(),
        };
        let mut section = String::new();
        ini.take(&Rc::new(source), &mut section, read, 0)?;
        Ok(ini)
    }

    fn take(
        &mut self,
        source: &Rc<Named>,
        section: &mut String,
        read: &Open<'_>,
        depth: usize,
    ) -> Result<(), FileError> {
        for (line, span) in joined(&source.text) {
            let place = FileLocation {
                source: Rc::clone(source),
                span,
            };
            let line = line.trim_start_matches('\u{feff}').trim();
            if let Some(name) = included(line) {
                if let Some(included) = self.include(name, &place, read, depth)? {
                    self.take(&Rc::new(included), section, read, depth + 1)?;
                }
            } else if line.is_empty() || line.starts_with(['#', ';']) {
            } else if let Some(rest) = line.strip_prefix('[') {
                let Some((name, _)) = rest.split_once(']') else {
                    return Err(place.error(
                        "a section without its closing bracket",
                        "here",
                        "write [NAME]; is the file cut off?",
                    ));
                };
                name.trim().clone_into(section);
                if let Some(first) = self.section(section) {
                    let write = format!(
                        "its lines below the first one, line {} of {}",
                        first.line(),
                        first.source.name
                    );
                    let reason = format!(
                        "a second [{section}]: LinuxCNC 2.10 adds its lines to the first, 2.9 ignores them"
                    );
                    self.remark(&place, reason, write);
                }
                self.sections.push((section.clone(), place));
            } else if let Some((key, value)) = line.split_once('=')
                && is_key(key.trim())
                && !section.is_empty()
            {
                self.entries.push(IniEntry {
                    section: section.clone(),
                    key: key.trim().to_owned(),
                    value: value.trim().to_owned(),
                    place,
                });
            } else {
                let reason = format!(
                    "`{line}` is not KEY = value in a section: LinuxCNC 2.9 reads past it, 2.10 rejects the file"
                );
                self.remark(&place, reason, format!("# {line}"));
            }
        }
        Ok(())
    }

    fn remark(&mut self, place: &FileLocation, reason: String, write: impl Into<String>) {
        self.remarks.push(Remark {
            place: place.clone(),
            reason,
            write: write.into(),
        });
    }

    /// An included file, if it can be read.
    fn include(
        &mut self,
        name: &str,
        place: &FileLocation,
        read: &Open<'_>,
        depth: usize,
    ) -> Result<Option<Named>, FileError> {
        if depth == DEEPEST {
            return Err(place.error(
                format!("`{name}` is included by files that include each other"),
                "here",
                "include a file once",
            ));
        }
        if depth > 0 {
            let reason = format!(
                "LinuxCNC 2.10 includes `{name}` here, 2.9 ignores the line, because this file is included itself"
            );
            self.remark(place, reason, AS_MEANT);
        }
        let file = read(name).map_err(|cause| {
            let reason = format!(
                "the included file `{name}` cannot be read: {cause}; LinuxCNC 2.9 reads past the line, 2.10 rejects the file"
            );
            self.remark(place, reason, "#INCLUDE with the name of a file");
        });
        Ok(file.ok())
    }

    /// All values of a key, in order.
    pub fn all<'i>(&'i self, section: &'i str, key: &'i str) -> impl Iterator<Item = &'i IniEntry> {
        let entries = self.entries.iter();
        entries.filter(move |e| e.section == section && e.key == key)
    }

    /// The value of a key; the first one, as in LinuxCNC.
    #[must_use]
    pub fn get(&self, section: &str, key: &str) -> Option<&IniEntry> {
        self.entries
            .iter()
            .find(|e| e.section == section && e.key == key)
    }

    /// The start of a section.
    #[must_use]
    pub fn section(&self, name: &str) -> Option<&FileLocation> {
        let mut sections = self.sections.iter();
        Some(&sections.find(|(found, _)| found == name)?.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(text: &str) -> Named {
        Named {
            name: "m.ini".to_owned(),
            text: text.to_owned(),
        }
    }

    fn none(_: &str) -> Result<Named, String> {
        Err("there is none".to_owned())
    }

    #[test]
    fn keys_repeat_lines_go_on_and_comments_are_whole_lines() {
        let text = "[HAL]\r\n# a comment = 1\n ; another\nHALFILE = a.hal\nHALFILE=b.hal # not a comment\n\
                    [KINS]\nKINEMATICS = trivkins \\\ncoordinates=XYZ\nJOINTS = 3\n";
        let ini = Ini::read(source(text), &none).unwrap();
        let files: Vec<&str> = ini
            .all("HAL", "HALFILE")
            .map(|e| e.value.as_str())
            .collect();
        assert_eq!(files, ["a.hal", "b.hal # not a comment"]);
        let kins = ini.get("KINS", "KINEMATICS").unwrap();
        assert_eq!(kins.value, "trivkins coordinates=XYZ");
        assert_eq!(kins.place.line(), 7);
        assert_eq!(ini.get("KINS", "JOINTS").unwrap().place.line(), 9);
        assert!(ini.get("HAL", "JOINTS").is_none());
        assert_eq!(ini.section("KINS").unwrap().line(), 6);
    }

    #[test]
    fn an_included_file_stands_where_it_is_included() {
        let read = |name: &str| {
            assert_eq!(name, "joint.inc");
            Ok(Named {
                name: name.to_owned(),
                text: "\nBACKLASH = 0.01\n[X]\nA = 1\n".to_owned(),
            })
        };
        let ini = Ini::read(source("[JOINT_0]\n#INCLUDE joint.inc\nB = 2\n"), &read).unwrap();
        let backlash = ini.get("JOINT_0", "BACKLASH").unwrap();
        assert_eq!(backlash.place.source.name, "joint.inc");
        assert_eq!(backlash.place.line(), 2);
        assert_eq!(ini.get("X", "B").unwrap().value, "2");
    }

    #[test]
    fn what_is_cut_off_or_not_there_is_named_with_its_line() {
        let text = "[A]\n[JOINT_";
        let error = Ini::read(source(text), &none).unwrap_err();
        assert!(
            error.message.contains("closing bracket"),
            "{}",
            error.message
        );
        assert_eq!(error.line(text), Some(2));
        let again = |_: &str| Ok(source("#INCLUDE m.ini"));
        let error = Ini::read(source("#INCLUDE m.ini"), &again).unwrap_err();
        assert!(error.message.contains("include each other"));
    }

    #[test]
    fn lines_past_which_linuxcnc_reads_are_remarked() {
        let read = |name: &str| {
            let text = match name {
                "a.inc" => "A = 1\n#INCLUDE b.inc\n",
                _ => "B = 2\n",
            };
            Ok(source(text))
        };
        let ini = Ini::read(source("[S]\n#INCLUDE a.inc\nno value here\nC = 3\n"), &read).unwrap();
        let missing = Ini::read(source("[S]\n#INCLUDE x.inc\n#INCLUDED = 1\nC = 3\n"), &none);
        let missing = missing.unwrap();
        assert_eq!(missing.get("S", "C").unwrap().value, "3");
        let [remark] = &missing.remarks[..] else {
            panic!("{:?}", missing.remarks);
        };
        assert_eq!(remark.place.line(), 2);
        let reason = &remark.reason;
        assert!(
            reason.contains("`x.inc` cannot be read: there is none"),
            "{reason}"
        );
        for (key, value) in [("A", "1"), ("B", "2"), ("C", "3")] {
            assert_eq!(ini.get("S", key).unwrap().value, value);
        }
        let remarks = of_lines(&ini);
        assert!(
            matches!(&remarks[..], [(2, nested), (3, _)] if nested.contains("2.9")),
            "{remarks:?}"
        );
    }

    fn of_lines(ini: &Ini) -> Vec<(usize, String)> {
        let remarks = ini.remarks.iter();
        remarks
            .map(|r| (r.place.line(), r.reason.clone()))
            .collect()
    }

    #[test]
    fn lines_that_are_no_entries_are_those_that_linuxcnc_2_10_rejects() {
        let text = "A = 1\n[S]\nMAX LIMIT = 2\n9TH = 3\nnothing\n= 4\nK = 5\n";
        let ini = Ini::read(source(text), &none).unwrap();
        let lines: Vec<usize> = of_lines(&ini).iter().map(|(line, _)| *line).collect();
        assert_eq!(lines, [1, 3, 4, 5, 6]);
        for (_, reason) in of_lines(&ini) {
            assert!(
                reason.contains("2.9 reads past it, 2.10 rejects"),
                "{reason}"
            );
        }
        assert_eq!(ini.get("S", "K").unwrap().value, "5");
    }

    /// `inivar` of 2.9 on this file: X is 1, "Can not find -sec A -var Z".
    #[test]
    fn a_section_that_is_there_twice_is_remarked_with_the_versions() {
        let inner = |_: &str| Ok(source("[A]\nZ = 3\n"));
        for text in [
            "[A]\nX = 1\n[B]\n[A]\nX = 2\nZ = 3\n",
            "[A]\nX = 1\n[B]\n#INCLUDE z\n",
        ] {
            let ini = Ini::read(source(text), &inner).unwrap();
            assert_eq!(ini.get("A", "X").unwrap().value, "1");
            assert_eq!(ini.get("A", "Z").unwrap().value, "3");
            let [Remark { reason, write, .. }] = &ini.remarks[..] else {
                panic!("{:?}", ini.remarks);
            };
            assert!(reason.contains("a second [A]: LinuxCNC 2.10"), "{reason}");
            assert_eq!(write, "its lines below the first one, line 1 of m.ini");
        }
    }

    #[test]
    fn a_number_stands_alone_or_apart_from_the_text_after_it() {
        for (value, number) in [
            ("60", Some((60.0, ""))),
            ("60 # mm per s", Some((60.0, "# mm per s"))),
            ("-1.5e3 (mm)", Some((-1500.0, "(mm)"))),
            (".5;half", Some((0.5, ";half"))),
            ("15mm", None),
            ("2e", None),
            ("40+35", None),
            ("60,5", None),
            ("# 60", None),
            ("", None),
            ("0x10", None),
            ("1e999", None),
            ("nan", None),
        ] {
            let ini = Ini::read(source(&format!("[S]\nK = {value}\n")), &none).unwrap();
            assert_eq!(ini.get("S", "K").unwrap().number(), number, "{value}");
        }
    }
}

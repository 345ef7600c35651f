//! INI files as LinuxCNC reads them: keys may repeat, files are included, and a backslash continues a line.
//!
//! This is a separate parser because existing ones do not keep the line of a value, which messages need, do not know
//! `#INCLUDE`, and give `#` within a line a meaning that it does not have here.

use std::ops::Range;
use std::rc::Rc;
use trueaxis_model::source::{FileError, Named};

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
    /// The number at the start of the value, as `strtod` reads it, and the text after it; `None` if there is none.
    #[must_use]
    pub fn number(&self) -> Option<(f64, &str)> {
        let value = &self.value;
        let is_number = |c: char| c.is_ascii_digit() || "+-.eE".contains(c);
        let longest = value.find(|c| !is_number(c)).unwrap_or(value.len());
        let end = (1..=longest)
            .rev()
            .find(|end| value[..*end].parse::<f64>().is_ok())?;
        let number: f64 = value[..end].parse().ok()?;
        let after = &value[end..];
        let is_hexadecimal = after.starts_with(['x', 'X']);
        (number.is_finite() && !is_hexadecimal).then_some((number, after.trim_start()))
    }
}

/// An INI file with what it includes.
#[derive(Debug)]
pub struct Ini {
    entries: Vec<IniEntry>,
    sections: Vec<(String, FileLocation)>,
    /// Lines that versions of LinuxCNC read differently, or past which they read: what they do.
    pub remarks: Vec<(FileLocation, String)>,
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
                self.sections.push((section.clone(), place));
            } else if let Some((key, value)) = line.split_once('=') {
                self.entries.push(IniEntry {
                    section: section.clone(),
                    key: key.trim().to_owned(),
                    value: value.trim().to_owned(),
                    place,
                });
            } else {
                let remark = format!(
                    "`{line}` is neither a section nor KEY = value: LinuxCNC reads past it"
                );
                self.remarks.push((place, remark));
            }
        }
        Ok(())
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
            let remark = format!(
                "LinuxCNC 2.10 includes `{name}` here, 2.9 ignores the line, because this file is included itself"
            );
            self.remarks.push((place.clone(), remark));
        }
        Ok(read(name)
            .map_err(|cause| {
                let remark = format!(
                    "the included file `{name}` cannot be read: {cause}; LinuxCNC 2.9 reads past the line"
                );
                self.remarks.push((place.clone(), remark));
            })
            .ok())
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
        let [(place, remark)] = &missing.remarks[..] else {
            panic!("{:?}", missing.remarks);
        };
        assert_eq!(place.line(), 2);
        assert!(
            remark.contains("`x.inc` cannot be read: there is none"),
            "{remark}"
        );
        for (key, value) in [("A", "1"), ("B", "2"), ("C", "3")] {
            assert_eq!(ini.get("S", key).unwrap().value, value);
        }
        let remarks: Vec<(usize, &str)> = (ini.remarks.iter())
            .map(|(place, remark)| (place.line(), remark.as_str()))
            .collect();
        assert!(
            matches!(remarks[..], [(2, nested), (3, _)] if nested.contains("2.9")),
            "{remarks:?}"
        );
    }

    #[test]
    fn a_number_ends_where_strtod_ends_it() {
        for (value, number) in [
            ("60", Some((60.0, ""))),
            ("60 # mm per s", Some((60.0, "# mm per s"))),
            ("-1.5e3mm", Some((-1500.0, "mm"))),
            (".5;half", Some((0.5, ";half"))),
            ("2e", Some((2.0, "e"))),
            ("+7-", Some((7.0, "-"))),
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

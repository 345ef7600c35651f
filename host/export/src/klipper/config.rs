//! `printer.cfg`: sections and their options.

use crate::text_lines::{TextLine, lines};
use trueaxis_model::source::FileError;

/// A section.
#[derive(Debug)]
pub struct ConfigSection<'t> {
    /// What stands between the brackets.
    pub name: &'t str,
    /// First line of the section.
    pub line: TextLine<'t>,
    options: Vec<ConfigEntry<'t>>,
}

/// An option.
#[derive(Debug)]
pub struct ConfigEntry<'t> {
    key: &'t str,
    /// What follows the key in its line.
    pub value: &'t str,
    /// Line of the option.
    pub line: TextLine<'t>,
    /// Indented lines after it.
    pub more: Vec<TextLine<'t>>,
}

impl<'t> ConfigSection<'t> {
    /// An option that must be there.
    ///
    /// # Errors
    /// [`FileError`] at the section.
    pub fn option(&self, key: &str) -> Result<&ConfigEntry<'t>, FileError> {
        self.given(key).ok_or_else(|| {
            self.line.bad(
                format!("[{}] has no `{key}`", self.name),
                "give the section as Klipper stores it",
            )
        })
    }

    /// An option that may be there. Of several the last one counts, in letters of any case.
    pub fn given(&self, key: &str) -> Option<&ConfigEntry<'t>> {
        let is_it = |option: &&ConfigEntry<'t>| option.key.eq_ignore_ascii_case(key);
        self.options.iter().rev().find(is_it)
    }

    /// True if it stands for another file.
    pub fn is_include(&self) -> bool {
        self.name.starts_with("include ")
    }
}

/// A line without its comment, and without what `SAVE_CONFIG` writes before it.
fn without_comment(line: &str) -> &str {
    let saved = line.strip_prefix("#*#");
    let body = saved.map_or(line, |rest| rest.strip_prefix(' ').unwrap_or(rest));
    let comment = body.find(['#', ';']);
    comment.map_or(body, |comment| body[..comment].trim_end())
}

/// All sections of a file. Comments are left out; what `SAVE_CONFIG` has written after `#*#` counts. Sections of one name are
/// one, as in Klipper.
pub fn sections(text: &str) -> Vec<ConfigSection<'_>> {
    let mut sections: Vec<ConfigSection<'_>> = Vec::new();
    let mut current = 0;
    for line in lines(text) {
        let body = without_comment(line.text);
        let trimmed = body.trim();
        if trimmed.is_empty() {
            continue;
        }
        if let Some(name) = trimmed.strip_prefix('[').and_then(|b| b.strip_suffix(']')) {
            let known = sections.iter().position(|section| section.name == name);
            current = known.unwrap_or(sections.len());
            if known.is_none() {
                sections.push(ConfigSection {
                    name,
                    line,
                    options: Vec::new(),
                });
            }
            continue;
        }
        let Some(section) = sections.get_mut(current) else {
            continue;
        };
        let line = TextLine {
            text: trimmed,
            span: line.span,
        };
        if body.starts_with(char::is_whitespace)
            && let Some(option) = section.options.last_mut()
        {
            option.more.push(line);
        } else if let Some((key, value)) = trimmed.split_once(['=', ':']) {
            section.options.push(ConfigEntry {
                key: key.trim(),
                value: value.trim(),
                line,
                more: Vec::new(),
            });
        }
    }
    sections
}

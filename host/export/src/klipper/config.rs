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
    /// Line of the key.
    pub line: TextLine<'t>,
    /// What follows the key in its line, and the further indented lines, without those that are empty.
    pub lines: Vec<TextLine<'t>>,
}

impl ConfigEntry<'_> {
    /// The value on one line.
    pub fn value(&self) -> String {
        let lines: Vec<&str> = self.lines.iter().map(|line| line.text).collect();
        lines.join(" ")
    }

    /// The value as a number.
    ///
    /// # Errors
    /// [`FileError`]
    pub fn number(&self) -> Result<f64, FileError> {
        self.line.number(&self.value())
    }

    /// The value as numbers between commas.
    ///
    /// # Errors
    /// [`FileError`]
    pub fn numbers(&self) -> Result<Vec<f64>, FileError> {
        let value = self.value();
        let words = value.split(',').map(str::trim);
        words.map(|word| self.line.number(word)).collect()
    }

    /// The value as X and Y.
    ///
    /// # Errors
    /// [`FileError`]
    pub fn pair(&self) -> Result<[f64; 2], FileError> {
        <[f64; 2]>::try_from(self.numbers()?).map_err(|_| {
            let message = format!("`{}` needs two numbers", self.key);
            self.line
                .bad(message, "write X and Y in mm, with a comma between them")
        })
    }
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

/// Start of the lines of `SAVE_CONFIG`.
const SAVED: &str = "#*#";

/// A line without its comment, and without what `SAVE_CONFIG` writes before it.
fn without_comment(line: &str) -> &str {
    let saved = line.strip_prefix(SAVED);
    let body = saved.map_or(line, |rest| rest.strip_prefix(' ').unwrap_or(rest));
    let comment = body.find(['#', ';']);
    comment.map_or(body, |comment| &body[..comment]).trim_end()
}

/// All sections of a file, without comments. Sections of one name are one, as in Klipper. The lines of `SAVE_CONFIG` come
/// before the others, which take precedence.
pub fn sections(text: &str) -> Vec<ConfigSection<'_>> {
    let mut sections = Vec::new();
    let (saved, main): (Vec<_>, Vec<_>) =
        (lines(text).into_iter()).partition(|line| line.text.starts_with(SAVED));
    add(&mut sections, saved);
    add(&mut sections, main);
    sections
}

/// Adds the sections of one part of a file. As in Python's `configparser`, a line that is indented more than the option before
/// it belongs to that option.
fn add<'t>(sections: &mut Vec<ConfigSection<'t>>, part: Vec<TextLine<'t>>) {
    let (mut section, mut option_indent) = (None, None);
    for line in part {
        let body = without_comment(line.text);
        let trimmed = body.trim_start();
        let indent = body.len() - trimmed.len();
        let of_line = |text: &'t str| TextLine {
            text,
            span: line.span.clone(),
        };
        if trimmed.is_empty() {
            continue;
        }
        if option_indent.is_some_and(|of_option| indent > of_option)
            && let Some(option) = section.and_then(|k: usize| sections[k].options.last_mut())
        {
            option.lines.push(of_line(trimmed));
        } else if let Some((name, _)) =
            (trimmed.strip_prefix('[')).and_then(|rest| rest.rsplit_once(']'))
        {
            let known = sections.iter().position(|section| section.name == name);
            section = known.or(Some(sections.len()));
            option_indent = None;
            if known.is_none() {
                sections.push(ConfigSection {
                    name,
                    line,
                    options: Vec::new(),
                });
            }
        } else if let (Some(k), Some((key, value))) = (section, trimmed.split_once(['=', ':'])) {
            let value = Some(value.trim()).filter(|value| !value.is_empty());
            sections[k].options.push(ConfigEntry {
                key: key.trim(),
                line: of_line(trimmed),
                lines: value.map(of_line).into_iter().collect(),
            });
            option_indent = Some(indent);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The values of an option of a section, each as one line.
    fn value(text: &str, section: &str, key: &str) -> Option<String> {
        let all = sections(text);
        let section = all.iter().find(|s| s.name == section)?;
        section.given(key).map(ConfigEntry::value)
    }

    #[test]
    fn a_line_belongs_to_the_option_before_it_only_if_it_is_indented_more() {
        let text = "[bltouch]\n  # comment\n  x_offset: -24\n\n  y_offset: -13\n  points:\n   1, 2\n\t\t\t3, 4 # more\n\
                    [printer] # mine\nkinematics:\n  corexy\n";
        let of = |key: &str| value(text, "bltouch", key);
        assert_eq!(of("x_offset").as_deref(), Some("-24"));
        assert_eq!(of("y_offset").as_deref(), Some("-13"));
        // Python counts a tab as one character.
        assert_eq!(of("points").as_deref(), Some("1, 2 3, 4"));
        assert_eq!(
            value(text, "printer", "kinematics").as_deref(),
            Some("corexy")
        );
        let body = "[gcode_macro A]\ngcode:\n  G28\n  [probe]\n  x_offset: 1\n";
        assert_eq!(sections(body).len(), 1);
        assert_eq!(value(body, "gcode_macro A", "x_offset"), None);
    }

    #[test]
    fn the_main_part_of_a_file_takes_precedence_over_what_save_config_adds() {
        let text = "[probe]\nz_offset: 1\n#*# <--- SAVE_CONFIG --->\n#*#\n#*# [probe]\n#*# z_offset = 2\n\
                    #*# z_offset = 3\n#*# x_offset = 4\n#*# x_offset = 5\n";
        assert_eq!(value(text, "probe", "z_offset").as_deref(), Some("1"));
        assert_eq!(value(text, "probe", "x_offset").as_deref(), Some("5"));
    }
}

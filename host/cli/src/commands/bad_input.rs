//! What is shown when input is bad: file, line, cause, remedy.

use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode};
use std::fmt::Display;
use std::ops::Range;
use std::path::Path;
use trueaxis::LoadError;
use trueaxis_model::source::FileError;
use trueaxis_tables::compile::{CompileError, Mismatch};

/// Bad input: exit code 2.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
pub struct BadInput {
    message: String,
    remedy: String,
    place: Option<Box<(NamedSource<String>, LabeledSpan)>>,
}

impl Diagnostic for BadInput {
    fn help<'a>(&'a self) -> Option<Box<dyn Display + 'a>> {
        Some(Box::new(&self.remedy))
    }
    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.place.as_ref().map(|p| &p.0 as &dyn SourceCode)
    }
    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let label = self.place.as_ref()?.1.clone();
        Some(Box::new(std::iter::once(label)))
    }
}

impl BadInput {
    /// Without a place in a file.
    pub fn new(message: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            message: cut(message.into(), MOST_MESSAGE),
            remedy: cut(remedy.into(), MOST_MESSAGE),
            place: None,
        }
    }

    /// At its place in a text file of this name.
    pub fn in_text(error: FileError, place: &str, name: &str, text: &str) -> Self {
        let quoted = error.span.as_ref().map(|span| line(text, span.start));
        // A message about a long line may quote it.
        let most = match quoted {
            Some(line) if line.chars().nth(MOST_LINE).is_some() => MOST_LINE,
            _ => MOST_MESSAGE,
        };
        let [message, label, remedy] =
            [error.message, error.label, error.remedy].map(|words| cut(words, most));
        let place_in_text = error.span.map(|span| {
            let (shown, span) = excerpt(text, span);
            let source = NamedSource::new(name, shown);
            let label = (!label.is_empty()).then_some(label);
            Box::new((source, LabeledSpan::new_with_span(label, span)))
        });
        Self {
            message: format!("{place}: {message}"),
            remedy,
            place: place_in_text,
        }
    }

    /// A blob that the runtime refuses.
    pub fn in_blob(error: LoadError, path: &Path) -> Self {
        let remedy = match error {
            LoadError::NoHeader | LoadError::BadMagic => {
                "give a .trax file, as `trueaxis compile` writes it"
            }
            LoadError::UnknownVersion { .. } | LoadError::UnknownVariant { .. } => {
                "use the version of trueaxis that wrote the file, or compile it again with this one"
            }
            LoadError::WrongLength { .. } | LoadError::TooLong { .. } | LoadError::BadChecksum => {
                "the file was cut off or changed on its way: copy it again (as binary), or compile it again"
            }
            LoadError::TooSmall { .. } | LoadError::TooManyTables { .. } => {
                "compile it again with a larger --tolerance"
            }
            _ => {
                "the checksum is right, so the program that wrote the file is wrong: compile it again with this version"
            }
        };
        Self::new(format!("{}: {error}", path.display()), remedy)
    }

    /// A blob that belongs to another machine.
    pub fn mismatch(error: &Mismatch, path: &Path) -> Self {
        Self::new(
            format!("{}: {error}", path.display()),
            "give the machine and error files from which the blob was compiled, or compile it again",
        )
    }
}

/// Most characters of a line of an input file that a message shows.
const MOST_LINE: usize = 200;
/// Most characters of a message.
const MOST_MESSAGE: usize = 2000;

/// The line of a text that a byte belongs to.
fn line(text: &str, at: usize) -> &str {
    let at = floor_char_boundary(text, at);
    let start = text[..at].rfind('\n').map_or(0, |newline| newline + 1);
    text[start..].lines().next().unwrap_or_default()
}

/// The place of the character that a byte belongs to; the end of the text if it is beyond.
fn floor_char_boundary(text: &str, at: usize) -> usize {
    let at = at.min(text.len());
    (0..=at)
        .rev()
        .find(|&k| text.is_char_boundary(k))
        .unwrap_or(0)
}

/// Text of at most so many characters; if there are more, `…` replaces those after three quarters of them.
fn cut(text: String, most: usize) -> String {
    let count = text.chars().count();
    if count <= most {
        return text;
    }
    let head = most * 3 / 4;
    let tail = most - head - 1;
    let start: String = text.chars().take(head).collect();
    let end: String = text.chars().skip(count - tail).collect();
    format!("{start}…{end}")
}

/// A text with every line cut to [`MOST_LINE`] characters, in the line of `span` those around its start; and where
/// `span` is in it. Lines keep their numbers.
fn excerpt(text: &str, span: Range<usize>) -> (String, Range<usize>) {
    const BEFORE: usize = MOST_LINE / 2;
    let mut shown = String::new();
    let mut moved = [0; 2];
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        let body = line.trim_end_matches(['\n', '\r']);
        let end = start + body.len();
        let at = floor_char_boundary(body, span.start.saturating_sub(start));
        let before = &body[..if at < body.len() { at } else { 0 }];
        let skipped = before.chars().count().saturating_sub(BEFORE);
        let is_long = body.chars().nth(MOST_LINE).is_some();
        let kept: String = match is_long {
            true => body.chars().skip(skipped).take(MOST_LINE - 2).collect(),
            false => body.to_owned(),
        };
        let from = match is_long {
            true => {
                start
                    + body
                        .chars()
                        .take(skipped)
                        .map(char::len_utf8)
                        .sum::<usize>()
            }
            false => start,
        };
        if from > start {
            shown.push('…');
        }
        let place = shown.len();
        for (moved, at) in moved.iter_mut().zip([span.start, span.end]) {
            if at >= start {
                *moved = place + at.saturating_sub(from).min(kept.len());
            }
        }
        shown.push_str(&kept);
        if from + kept.len() < end {
            shown.push('…');
        }
        shown.push_str(&line[body.len()..]);
        start += line.len();
    }
    let [start, end] = moved.map(|at| floor_char_boundary(&shown, at));
    // A span of many lines is marked where it starts.
    (shown, start..end.clamp(start, start + MOST_MESSAGE))
}

impl From<CompileError> for BadInput {
    fn from(error: CompileError) -> Self {
        Self::new(error.to_string(), error.remedy())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn marked(text: &str, span: Range<usize>) -> String {
        let (shown, span) = excerpt(text, span);
        assert!(shown.lines().all(|line| line.chars().count() <= MOST_LINE));
        assert_eq!(shown.lines().count(), text.lines().count());
        shown[span].to_owned()
    }

    #[test]
    fn an_excerpt_marks_the_same_place_in_lines_of_at_most_200_characters() {
        let long = "ä".repeat(1000) + "wrong" + &"b".repeat(1_000_000);
        for text in [
            format!("first\n{long}\nlast"),
            format!("{long}\r\n\r\nlast\r\n"),
            long.clone(),
        ] {
            let at = text.find("wrong").unwrap();
            assert_eq!(marked(&text, at..at + 5), "wrong");
            assert_eq!(
                marked(&text, at..text.len())
                    .chars()
                    .take(5)
                    .collect::<String>(),
                "wrong"
            );
            if let Some(at) = text.find("last") {
                assert_eq!(marked(&text, at..at + 4), "last");
            }
            assert_eq!(marked(&text, text.len()..text.len()), "");
        }
        let short = "[axes]\nx = wrong\n".to_owned();
        assert_eq!(excerpt(&short, 11..16), (short.clone(), 11..16));
    }

    #[test]
    fn a_message_keeps_its_start_and_its_end() {
        assert_eq!(cut("short".to_owned(), 200), "short");
        let shown = cut(
            "`".to_owned() + &"x".repeat(1_000_000) + "` is not a number",
            200,
        );
        assert_eq!(shown.chars().count(), 200);
        assert!(shown.starts_with("`xxx") && shown.ends_with("xx` is not a number"));
    }
}

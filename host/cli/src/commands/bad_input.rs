//! Reports bad input: file, line, cause, remedy.

use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};
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
    quote: Option<Box<Quote>>,
}

/// The lines of a text file around the place that a message is about.
#[derive(Debug)]
struct Quote {
    /// The name of the file.
    name: String,
    /// The line of that place with one line before and one after.
    lines: Excerpt,
    label: String,
}

impl BadInput {
    /// Bad input without a place in a file.
    pub fn new(message: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            message: cut(message.into(), MOST_MESSAGE),
            remedy: cut(remedy.into(), MOST_MESSAGE),
            quote: None,
        }
    }

    /// Bad input at a place in a text file called `name`.
    pub fn in_text(error: FileError, place: &str, name: &str, text: &str) -> Self {
        let quoted = error.span.as_ref().map(|span| line(text, span.start));
        // The message itself may quote a long line.
        let most = match quoted {
            Some(line) if line.chars().nth(MOST_LINE).is_some() => MOST_LINE,
            _ => MOST_MESSAGE,
        };
        let [message, label, remedy] =
            [error.message, error.label, error.remedy].map(|words| cut(words, most));
        let quote = error.span.map(|span| Quote {
            name: name.to_owned(),
            lines: Excerpt::around(text, span),
            label,
        });
        Self {
            message: format!("{place}: {message}"),
            remedy,
            quote: quote.map(Box::new),
        }
    }

    /// Prints message, place and remedy to standard error.
    pub fn show(&self) {
        let snippet = self.quote.as_ref().map(|quote| {
            let Excerpt { first, text, span } = &quote.lines;
            let place = AnnotationKind::Primary.span(span.clone());
            let place = place.label((!quote.label.is_empty()).then_some(quote.label.as_str()));
            let lines = Snippet::source(text).line_start(*first).path(&quote.name);
            lines.fold(false).annotation(place)
        });
        let title = Level::ERROR.primary_title(&self.message);
        let remedy = Level::HELP.message(&self.remedy);
        let group = match snippet {
            Some(snippet) => title.element(snippet).element(remedy),
            None => title.element(remedy),
        };
        let text = Renderer::styled()
            .term_width(MOST_LINE + 40)
            .render(&[group]);
        anstream::eprintln!("{text}");
    }

    /// A blob that the runtime rejects.
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

    /// A blob made for another machine.
    pub fn mismatch(error: &Mismatch, path: &Path) -> Self {
        Self::new(
            format!("{}: {error}", path.display()),
            "give the machine and error files from which the blob was compiled, or compile it again",
        )
    }
}

/// Longest line, in characters, that a message quotes from an input file.
const MOST_LINE: usize = 200;
/// Longest message, in characters.
const MOST_MESSAGE: usize = 2000;

/// The line of `text` that contains byte `at`.
fn line(text: &str, at: usize) -> &str {
    let at = floor_char_boundary(text, at);
    let start = text[..at].rfind('\n').map_or(0, |newline| newline + 1);
    text[start..].lines().next().unwrap_or_default()
}

/// Index of the start of the character that contains byte `at`, or the end of the text if `at` is past it.
fn floor_char_boundary(text: &str, at: usize) -> usize {
    let at = at.min(text.len());
    (0..=at)
        .rev()
        .find(|&k| text.is_char_boundary(k))
        .unwrap_or(0)
}

/// Shortens a text to `most` characters: `…` replaces what follows the first three quarters.
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

/// A few lines around a place in a text, each at most [`MOST_LINE`] characters long.
#[derive(Debug)]
struct Excerpt {
    /// Number of the first line in the text, counted from 1.
    first: usize,
    text: String,
    /// The place in `text`; if it spans several lines, the part in the first.
    span: Range<usize>,
}

impl Excerpt {
    /// The line at `span` and its neighbours. A long line is cut around the place.
    fn around(text: &str, span: Range<usize>) -> Self {
        let at = floor_char_boundary(text, span.start);
        let start = text[..at].rfind('\n').map_or(0, |newline| newline + 1);
        let body = line(text, at);
        let neighbour = |line: &str| cut(line.to_owned(), MOST_LINE);
        let before = text[..start].lines().last().map(neighbour);
        let after = text[start..].lines().nth(1).map(neighbour);

        let at = (at - start).min(body.len());
        let end = floor_char_boundary(body, span.end.saturating_sub(start)).max(at);
        let is_long = body.chars().nth(MOST_LINE).is_some();
        let skipped = match is_long {
            true => body[..at].chars().count().saturating_sub(MOST_LINE / 2),
            false => 0,
        };
        let from = body.char_indices().nth(skipped).map_or(0, |(from, _)| from);
        let kept: String = body[from..].chars().take(MOST_LINE - 2).collect();
        let kept = if is_long { kept.as_str() } else { body };
        let is_cut =
            [from > 0, from + kept.len() < body.len()].map(|cut| if cut { "…" } else { "" });

        let mut shown = before
            .as_ref()
            .map_or(String::new(), |line| format!("{line}\n"));
        shown += is_cut[0];
        let [start_shown, end_shown] =
            [at, end].map(|at| shown.len() + (at - from).min(kept.len()));
        shown += kept;
        shown += is_cut[1];
        shown.extend(after.map(|line| format!("\n{line}")));
        Self {
            first: text[..start].matches('\n').count() + usize::from(before.is_none()),
            text: shown,
            span: start_shown..end_shown,
        }
    }
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
        let number = text[..span.start].matches('\n').count() + 1;
        let Excerpt { first, text, span } = Excerpt::around(text, span);
        assert!(text.lines().all(|line| line.chars().count() <= MOST_LINE));
        assert_eq!(first + text[..span.start].matches('\n').count(), number);
        text[span].to_owned()
    }

    #[test]
    fn an_excerpt_marks_the_same_place_in_lines_of_at_most_200_characters() {
        let long = "ä".repeat(1000) + "wrong" + &"b".repeat(1_000_000);
        for text in [
            format!("first\n{long}\nlast"),
            format!("\n{long}\r\n\r\nlast\r\n"),
            long.clone(),
        ] {
            let at = text.find("wrong").unwrap();
            assert_eq!(marked(&text, at..at + 5), "wrong");
            assert!(marked(&text, at..text.len()).starts_with("wrongbb"));
            if let Some(at) = text.find("last") {
                assert_eq!(marked(&text, at..at + 4), "last");
            }
            assert_eq!(marked(&text, text.len()..text.len()), "");
        }
        let short = "[axes]\nx = wrong\n".to_owned();
        let Excerpt { first, text, span } = Excerpt::around(&short, 11..16);
        assert_eq!(
            (first, text.as_str(), span),
            (1, "[axes]\nx = wrong", 11..16)
        );
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

//! Errors with a place in a file.

use serde::de::{Deserialize, Deserializer, Error};
use std::ops::Range;

/// An error in a file: cause, place and remedy.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
#[error("{message}")]
pub struct FileError {
    /// What is wrong.
    pub message: String,
    /// A few words for the marked place.
    pub label: String,
    /// What to write instead.
    pub remedy: String,
    /// Byte range in the file.
    pub span: Option<Range<usize>>,
    /// The file it is in, if the file being read refers to another one.
    pub within: Option<Box<Named>>,
}

/// A text file with its name.
#[derive(Clone, Debug, PartialEq)]
pub struct Named {
    /// Name as referred to.
    pub name: String,
    /// Content of the text file.
    pub text: String,
}

/// The number at the start of a text as C's `strtod` reads it, and the text after it; `None` if there is none, or one that
/// is hexadecimal or not finite.
#[must_use]
pub fn leading_number(text: &str) -> Option<(f64, &str)> {
    let text = text.trim_start();
    let longest = text.find(|c: char| !c.is_ascii_digit() && !"+-.eE".contains(c));
    let (end, number) = (1..=longest.unwrap_or(text.len()))
        .rev()
        .find_map(|end| Some((end, text[..end].parse::<f64>().ok()?)))?;
    let after = &text[end..];
    (number.is_finite() && !after.starts_with(['x', 'X'])).then_some((number, after))
}

impl FileError {
    /// An error at a place.
    pub fn at(
        span: Range<usize>,
        message: impl Into<String>,
        label: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self {
            message: message.into(),
            label: label.into(),
            remedy: remedy.into(),
            span: Some(span),
            within: None,
        }
    }

    /// An error at a place that is labelled `here`.
    pub fn here(span: Range<usize>, message: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::at(span, message, "here", remedy)
    }

    /// An error about the whole file.
    pub fn whole(message: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            message: message.into(),
            label: String::new(),
            remedy: remedy.into(),
            span: None,
            within: None,
        }
    }

    /// The error, in another file.
    #[must_use]
    pub fn within(mut self, name: &str, text: &str) -> Self {
        self.within = Some(Box::new(Named {
            name: name.to_owned(),
            text: text.to_owned(),
        }));
        self
    }

    /// A TOML syntax error.
    #[must_use]
    pub fn syntax(error: &toml::de::Error, text: &str) -> Self {
        let remedy = match error.span() {
            Some(span) if has_decimal_comma(text, &span, error.message()) => {
                "write a decimal point, not a comma: 1.5e-5"
            }
            _ => remedy(error.message()),
        };
        Self {
            message: error.message().to_owned(),
            label: "here".to_owned(),
            remedy: remedy.to_owned(),
            span: error.span(),
            within: None,
        }
    }

    /// The file is a machine file where an error file is expected, or the other way round; `None` if `text` is not a file
    /// of the kind `is`.
    pub(crate) fn swapped(text: &str, is: FileKind) -> Option<Self> {
        let keys: toml::Table = toml::from_str(text).ok()?;
        let has = |key: &str| keys.contains_key(key);
        let (found, expected) = match is {
            FileKind::Machine => (has("name") && has("axis"), "an error file"),
            FileKind::Errors => (
                has("machine") && ["parameters", "tabulated", "thermal"].into_iter().any(has),
                "a machine file",
            ),
        };
        let is = match is {
            FileKind::Machine => "a machine file",
            FileKind::Errors => "an error file",
        };
        found.then(|| {
            Self::whole(
                format!("this is {is}, where {expected} is expected"),
                "check the order: the machine file comes first, then the error file",
            )
        })
    }

    /// The line of the error, counted from 1.
    #[must_use]
    pub fn line(&self, text: &str) -> Option<usize> {
        let start = self.span.as_ref()?.start.min(text.len());
        Some(
            text.as_bytes()[..start]
                .iter()
                .filter(|b| **b == b'\n')
                .count()
                + 1,
        )
    }
}

/// What a file describes.
#[derive(Clone, Copy)]
pub(crate) enum FileKind {
    /// Axes, spindle and tool.
    Machine,
    /// Error parameters of a machine.
    Errors,
}

/// Part of the message if numbers are missing or there are too many.
const COUNT: &str = "numbers, where";

/// Exactly `N` numbers in a file. `[-210,0, 210,0]` is rejected: it is not the range that someone who writes decimal
/// commas intends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exactly<const N: usize>(pub [f64; N]);

impl<'de, const N: usize> Deserialize<'de> for Exactly<N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let numbers = Vec::<f64>::deserialize(deserializer)?;
        let count = numbers.len();
        let numbers = numbers.try_into();
        numbers
            .map(Self)
            .map_err(|_| D::Error::custom(format!("{count} {COUNT} {N} are expected")))
    }
}

/// What to do about a file that the parser of TOML refuses.
fn remedy(message: &str) -> &'static str {
    let kinds = [
        (
            "unknown field",
            "write one of the keys named above, or take it out; a key of a later version of trueaxis needs that version",
        ),
        ("unknown variant", "write one of the values named above"),
        ("missing field", "add it"),
        (
            "invalid type",
            "write the kind of value that is expected: numbers have no quotes, texts have",
        ),
        (COUNT, "write as many values as are expected"),
        ("duplicate key", "keep one of the two"),
    ];
    let found = kinds.iter().find(|(kind, _)| message.contains(kind));
    found.map_or(
        "write `key = value`, with texts in quotes, lists in [ ] and a title in [ ] or [[ ]] on a line of its own",
        |(_, remedy)| remedy,
    )
}

/// True if the lines of a place have a comma between two digits without a following space, and this may be the cause
/// of the error: not for keys or for the syntax of a list, where such a comma may be right.
fn has_decimal_comma(text: &str, span: &Range<usize>, message: &str) -> bool {
    let bytes = text.as_bytes();
    let start = span.start.min(bytes.len());
    let end = span.end.clamp(start, bytes.len());
    let from = bytes[..start].iter().rposition(|b| *b == b'\n');
    let to = bytes[end..].iter().position(|b| *b == b'\n');
    let lines = &bytes[from.map_or(0, |n| n + 1)..to.map_or(bytes.len(), |n| end + n)];
    let code = lines.split(|b| *b == b'#').next().unwrap_or(lines);
    let in_list = code.contains(&b'[') && !message.contains(COUNT);
    if in_list || message.contains("field") {
        return false;
    }
    code.windows(3)
        .any(|w| w[0].is_ascii_digit() && w[1] == b',' && w[2].is_ascii_digit())
}

/// The name in the right case, if only the case is wrong: `X` for `x`, `EXXb` for `exxB`.
#[must_use]
pub(crate) fn right_case(name: &str, is_right: impl Fn(&str) -> bool) -> Option<String> {
    let upper = name.to_uppercase();
    let split = upper
        .char_indices()
        .nth(3)
        .map_or(upper.len(), |(at, _)| at);
    let mixed = upper[..split].to_owned() + &upper[split..].to_lowercase();
    [upper, mixed]
        .into_iter()
        .find(|n| n != name && is_right(n))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decimal_comma_is_one_between_digits() {
        let syntax = "expected newline";
        for (text, message, is) in [
            ("EXX1 = 1,5e-5", syntax, true),
            (
                "range = [-210,0, 210,0]",
                "4 numbers, where 2 are expected",
                true,
            ),
            (
                "range = [-210.0, 210.0, 1.0]",
                "3 numbers, where 2 are expected",
                false,
            ),
            ("rang = [0,100]", "unknown field `rang`", false),
            ("range = [0,100", syntax, false),
            ("x = 1 # 1,5", syntax, false),
        ] {
            assert_eq!(has_decimal_comma(text, &(2..3), message), is, "{text}");
        }
    }

    #[test]
    fn every_refusal_of_the_parser_has_a_remedy_of_its_own() {
        #[derive(Debug, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Known {
            #[expect(dead_code, reason = "only its reading is tested")]
            range: Exactly<2>,
        }
        for (text, message, remedy) in [
            ("rang = [0, 1]", "unknown field `rang`", "one of the keys"),
            ("", "missing field `range`", "add it"),
            ("range = \"0\"", "invalid type", "kind of value"),
            ("range = [0.0]", "1 numbers, where 2", "as many values"),
            (
                "range = [0, 1]\nrange = [0, 1]",
                "duplicate key",
                "keep one",
            ),
            ("range = 0 1", "", "key = value"),
        ] {
            let error = toml::from_str::<Known>(text).unwrap_err();
            let found = FileError::syntax(&error, text);
            assert!(found.message.contains(message), "{text}: {}", found.message);
            assert!(found.remedy.contains(remedy), "{text}: {}", found.remedy);
        }
    }

    #[test]
    fn the_right_case_is_found() {
        let names = ["X", "EXX1", "EXXb", "EA0Z", "EXCc1"];
        let is_right = |n: &str| names.contains(&n);
        for (name, right) in [
            ("x", Some("X")),
            ("exx1", Some("EXX1")),
            ("EXXB", Some("EXXb")),
            ("ea0z", Some("EA0Z")),
            ("excC1", Some("EXCc1")),
            ("EXX1", None),
            ("é", None),
            ("eéé1", None),
        ] {
            assert_eq!(right_case(name, is_right).as_deref(), right, "{name}");
        }
    }
}

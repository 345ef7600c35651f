//! What is refused, where, and what to do.

use std::ops::Range;

/// Something in a line that cannot be corrected.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// Bytes of the line; `None`: the words of its motion.
    pub span: Option<Range<usize>>,
    /// Which kind, for programs and tests.
    pub kind: Kind,
    /// What is wrong.
    pub cause: String,
    /// What to do.
    pub remedy: String,
}

/// Kinds of faults.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A parameter `#`.
    Parameter,
    /// An expression in brackets.
    Expression,
    /// An O-word.
    Flow,
    /// A word that is not known, or not built in yet.
    Word,
    /// Anything else.
    Other,
}

/// The advice for programs that compute.
pub const FLAT: &str = "use the compensation in the controller (in LinuxCNC: trueaxis linuxcnc start), or write the \
program out flat: numbers only, no parameters, expressions, loops or subprograms (LinuxCNC's interpreter `rs274 -g` lists \
the motions that it computes)";

impl Fault {
    /// Of the kind [`Kind::Other`].
    pub fn new(span: Range<usize>, cause: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            span: Some(span),
            kind: Kind::Other,
            cause: cause.into(),
            remedy: remedy.into(),
        }
    }

    /// Of the motion of a line.
    pub(crate) fn of_motion(cause: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            span: None,
            ..Self::new(0..0, cause, remedy)
        }
    }

    /// Of another kind.
    #[must_use]
    pub fn kind(self, kind: Kind) -> Self {
        Self { kind, ..self }
    }
}

/// A program that is refused, at a line and a word.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("line {line}{}: {cause}", shown(word))]
pub struct Refusal {
    /// Line, from 1.
    pub line: u64,
    /// The word, empty if it is the line as a whole.
    pub word: String,
    /// Which kind.
    pub kind: Kind,
    /// What is wrong.
    pub cause: String,
    /// What to do.
    pub remedy: String,
}

fn shown(word: &str) -> String {
    match word {
        "" => String::new(),
        word => format!(", `{word}`"),
    }
}

impl Refusal {
    /// A fault in this line.
    #[must_use]
    pub fn at(fault: Fault, line: u64, text: &[u8]) -> Self {
        let Range { start, end } = fault.span.unwrap_or_default();
        let part = text.get(start..end.min(text.len())).unwrap_or_default();
        let mut word: String = String::from_utf8_lossy(part).trim().to_owned();
        if word.chars().count() > 40 {
            word = word.chars().take(40).collect::<String>() + "…";
        }
        Self {
            line,
            word,
            kind: fault.kind,
            cause: fault.cause,
            remedy: fault.remedy,
        }
    }
}

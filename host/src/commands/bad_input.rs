//! What is shown when input is bad: file, line, cause, remedy.

use super::files::Text;
use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode};
use std::fmt::Display;
use std::path::Path;
use trueaxis::LoadError;
use trueaxis_host::compile::{CompileError, Mismatch};
use trueaxis_host::source::FileError;

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
            message: message.into(),
            remedy: remedy.into(),
            place: None,
        }
    }

    /// At its place in a text file, or in another that this names.
    pub fn in_text(error: FileError, text: &Text) -> Self {
        let within = error.within.as_deref().map(|other| Text {
            name: text.beside(&other.name),
            text: other.text.clone(),
        });
        let text = within.as_ref().unwrap_or(text);
        let message = format!("{}: {}", text.place(&error), error.message);
        let place = error.span.map(|span| {
            let source = NamedSource::new(&text.name, text.text.clone());
            let label = (!error.label.is_empty()).then_some(error.label);
            Box::new((source, LabeledSpan::new_with_span(label, span)))
        });
        Self {
            message,
            remedy: error.remedy,
            place,
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
            LoadError::WrongLength { .. } | LoadError::BadChecksum => {
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

impl From<CompileError> for BadInput {
    fn from(error: CompileError) -> Self {
        Self::new(error.to_string(), error.remedy())
    }
}

//! Files as they were before a command, to put them back.

use super::setup::kept_at;
use crate::commands::bad_input::BadInput;
use crate::commands::files;
use crate::commands::output;
use std::path::{Path, PathBuf};

/// Files that `start` may write, as they were before.
pub struct KeptFiles(Vec<(PathBuf, Option<Vec<u8>>)>);

impl KeptFiles {
    /// Reads them; what is missing stays missing.
    pub fn read<'p>(files: impl IntoIterator<Item = &'p Path>) -> Result<Self, BadInput> {
        let read = files.into_iter().map(|file| {
            let bytes = match file.exists() {
                true => Some(files::read_bytes(file)?),
                false => None,
            };
            Ok((file.to_owned(), bytes))
        });
        Ok(Self(read.collect::<Result<_, BadInput>>()?))
    }

    /// Copies of what will be replaced by something else: `written`, and what is compiled.
    pub fn copies(&self, written: &[(PathBuf, &str)]) -> Result<Vec<(PathBuf, &[u8])>, BadInput> {
        let is_same = |file: &Path, before: &[u8]| {
            let mut all = written.iter().filter(|(path, _)| path == file);
            all.any(|(_, text)| text.as_bytes() == before)
        };
        let replaced = self.0.iter().filter_map(|(file, before)| {
            let before = before.as_deref()?;
            (!is_same(file, before)).then_some((file, before))
        });
        replaced
            .map(|(file, before)| Ok((kept_at(file, before)?, before)))
            .collect()
    }

    /// Puts back what has changed.
    pub fn restore(&self) -> Result<(), BadInput> {
        for (file, before) in &self.0 {
            let now = std::fs::read(file).ok();
            match before {
                _ if now == *before => {}
                Some(bytes) => output::write(file, bytes)?,
                None => std::fs::remove_file(file).map_err(|error| {
                    BadInput::new(
                        format!("{} cannot be removed: {error}", file.display()),
                        "remove it",
                    )
                })?,
            }
        }
        Ok(())
    }
}

//! New readings beside what LinuxCNC compensates already: what the error file must keep, and which readings it spoils.

use super::configuration::Configuration;
use super::imported::{Import, has_imported, is_imported};
use super::setup::SetupFiles;
use std::fmt::Write;

/// Why readings cannot be added.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BesideError {
    /// The error file has what LinuxCNC compensated, the INI file no longer.
    #[error("it has what LinuxCNC compensated, the INI file has not: replacing it would lose that")]
    Lost,
    /// The INI file compensates what the error file does not have.
    #[error("it does not have what LinuxCNC compensates: {0}")]
    Missing(String),
    /// The joints of an axis are compensated differently, so that LinuxCNC keeps that.
    #[error(
        "a reading along {letter}: {key} of joint {joint} stays with LinuxCNC, because the joints of {letter} differ"
    )]
    Stays {
        /// The axis.
        letter: char,
        /// `COMP_FILE` or `BACKLASH`.
        key: String,
        /// A joint that has it.
        joint: usize,
    },
    /// The INI file compensates the axis.
    #[error("a reading along {letter}: the INI file already compensates {letter} ({source_line})")]
    InIni {
        /// The axis.
        letter: char,
        /// The line in the INI file.
        source_line: String,
    },
    /// The error file has what LinuxCNC compensated along the axis.
    #[error("a reading along {0}: errors.toml already has what LinuxCNC compensated along {0}")]
    InErrors(char),
}

impl BesideError {
    /// What to do about it.
    #[must_use]
    pub fn remedy(&self) -> String {
        match self {
            Self::Lost => "put COMP_FILE and BACKLASH back into the INI file (--remove does); or, if they were wrong, move errors.toml away".to_owned(),
            Self::Missing(_) => "give --overwrite: machine.toml, trueaxis.hal and errors.toml are made again from the INI file".to_owned(),
            Self::Stays { letter, .. } => {
                format!("correct COMP_FILE or BACKLASH of each joint of {letter} by what the reading shows")
            }
            Self::InIni { .. } => "take COMP_FILE and BACKLASH of this axis out of the INI file, measure again, and start again".to_owned(),
            Self::InErrors(_) => "take that out of errors.toml, measure again without compensation, and start again".to_owned(),
        }
    }
}

/// What LinuxCNC compensates, and the error file that has what it compensated.
#[derive(Clone, Copy, Debug)]
pub struct Compensated<'a> {
    /// The configuration.
    pub configuration: &'a Configuration,
    /// What the INI file compensates and the error file can have.
    pub imports: &'a [Import],
}

impl Compensated<'_> {
    /// The text to which readings are added: all that LinuxCNC compensates, or did before the component came. `made` is a
    /// new set-up (`None` if the one that is there stays), `old` the error file that is there. `None` if there is nothing
    /// to keep.
    ///
    /// # Errors
    /// [`BesideError::Lost`], [`BesideError::Missing`].
    pub fn to_keep(
        &self,
        made: Option<&SetupFiles>,
        old: Option<&str>,
    ) -> Result<Option<String>, BesideError> {
        let old = old.map(|text| text.replace("\r\n", "\n"));
        let old = old.filter(|text| is_imported(text));
        match (made, old) {
            (Some(made), _) if !self.imports.is_empty() => Ok(made.errors.clone()),
            (Some(_), Some(_)) => Err(BesideError::Lost),
            (Some(_), None) => Ok(None),
            (None, old) => {
                let text = old.as_deref().unwrap_or_default();
                let is_missing = |import: &&Import| {
                    !import.lines(self.configuration).is_empty() && !import.is_in(text)
                };
                match self.imports.iter().find(is_missing) {
                    Some(import) => Err(BesideError::Missing(import.source())),
                    None => Ok(old),
                }
            }
        }
    }

    /// Refuses a reading along an axis that is compensated already, by LinuxCNC or in the text that is kept: what the
    /// instrument showed depends on that.
    ///
    /// # Errors
    /// [`BesideError::Stays`], [`BesideError::InIni`], [`BesideError::InErrors`].
    pub fn accepts_reading(&self, letter: char, kept: Option<&str>) -> Result<(), BesideError> {
        if let Some((joint, entry)) = self.configuration.kept(letter).first() {
            return Err(BesideError::Stays {
                letter,
                key: entry.key.clone(),
                joint: joint.number,
            });
        }
        let mut imports = self.imports.iter();
        if let Some(import) = imports.find(|import| import.letter() == letter) {
            return Err(BesideError::InIni {
                letter,
                source_line: import.source(),
            });
        }
        match kept {
            Some(kept) if has_imported(kept, letter) => Err(BesideError::InErrors(letter)),
            _ => Ok(()),
        }
    }

    /// What LinuxCNC keeps because the joints of an axis differ, a line each.
    #[must_use]
    pub fn staying(&self) -> String {
        let mut letters: Vec<char> = (self.configuration.axes().iter())
            .map(|joint| joint.letter)
            .collect();
        letters.sort_unstable();
        letters.dedup();
        let mut lines = String::new();
        for (joint, entry) in letters.iter().flat_map(|l| self.configuration.kept(*l)) {
            let _ = writeln!(
                lines,
                "{} = {} of joint {} stays in the INI file: the joints of {} differ",
                entry.key, entry.value, joint.number, joint.letter
            );
        }
        lines
    }
}

//! New readings beside what LinuxCNC compensates already: what the error file must keep, and which readings it spoils.

use crate::configuration::Configuration;
use crate::imported::{Import, has_imported, is_imported};
use crate::setup::SetupFiles;
use std::fmt::Write;

/// Why readings cannot be added.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{error}")]
pub struct BesideError {
    /// What is in the way.
    pub error: String,
    /// What to do about it.
    pub remedy: String,
}

impl BesideError {
    fn new(error: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            error: error.into(),
            remedy: remedy.into(),
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
    /// The error file has what the INI file no longer compensates, or lacks what it does.
    pub fn to_keep(
        &self,
        made: Option<&SetupFiles>,
        old: Option<&str>,
    ) -> Result<Option<String>, BesideError> {
        let old = old.map(|text| text.replace("\r\n", "\n"));
        let old = old.filter(|text| is_imported(text));
        match (made, old) {
            (Some(made), _) if !self.imports.is_empty() => Ok(made.errors.clone()),
            (Some(_), Some(_)) => Err(BesideError::new(
                "it has what LinuxCNC compensated, the INI file has not: replacing it would lose that",
                "put COMP_FILE and BACKLASH back into the INI file (--remove does); or, if they were wrong, move errors.toml away",
            )),
            (Some(_), None) => Ok(None),
            (None, old) => {
                let text = old.as_deref().unwrap_or_default();
                let is_missing = |import: &&Import| {
                    !import.lines(self.configuration).is_empty() && !import.is_in(text)
                };
                match self.imports.iter().find(is_missing) {
                    Some(import) => Err(BesideError::new(
                        format!(
                            "it does not have what LinuxCNC compensates: {}",
                            import.source()
                        ),
                        "give --overwrite: machine.toml, trueaxis.hal and errors.toml are made again from the INI file",
                    )),
                    None => Ok(old),
                }
            }
        }
    }

    /// Refuses a reading along an axis that is compensated already, by LinuxCNC or in the text that is kept: what the
    /// instrument showed depends on that.
    ///
    /// # Errors
    /// The axis is compensated already.
    pub fn accepts_reading(&self, letter: char, kept: Option<&str>) -> Result<(), BesideError> {
        if let Some((joint, entry)) = self.configuration.kept(letter).first() {
            let (key, number) = (&entry.key, joint.number);
            return Err(BesideError::new(
                format!(
                    "a reading along {letter}: {key} of joint {number} stays with LinuxCNC, because the joints of {letter} differ"
                ),
                format!(
                    "correct COMP_FILE or BACKLASH of each joint of {letter} by what the reading shows"
                ),
            ));
        }
        let mut imports = self.imports.iter();
        if let Some(import) = imports.find(|import| import.letter() == letter) {
            let line = import.source();
            return Err(BesideError::new(
                format!(
                    "a reading along {letter}: the INI file already compensates {letter} ({line})"
                ),
                "take COMP_FILE and BACKLASH of this axis out of the INI file, measure again, and start again",
            ));
        }
        match kept {
            Some(kept) if has_imported(kept, letter) => Err(BesideError::new(
                format!(
                    "a reading along {letter}: errors.toml already has what LinuxCNC compensated along {letter}"
                ),
                "take that out of errors.toml, measure again without compensation, and start again",
            )),
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

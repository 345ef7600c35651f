//! The first comment of a corrected program: what it was corrected with, and whether that is taken away.

use super::Corrector;
use crate::gcode::fault::Fault;
use crate::gcode::words::{Block, MARK};

/// What a mark says.
struct Mark<'m> {
    /// Name of the file, and its checksum.
    compensation: &'m str,
    checksum: &'m str,
    /// What became of reversals; where it is not said that is `move`.
    backlash: &'m str,
}

impl<'m> Mark<'m> {
    /// From the comment, from its first word on.
    fn read(text: &'m str) -> Option<Self> {
        let (_, said) = text.split_once(':')?;
        let mut fields = said.split(',').map(str::trim);
        let compensation = fields.next()?;
        let (_, checksum) = compensation.rsplit_once(' ')?;
        let key = "backlash ";
        let is_backlash = |field: &&str| {
            let begins = field.get(..key.len());
            begins.is_some_and(|b| b.eq_ignore_ascii_case(key))
        };
        Some(Self {
            compensation,
            checksum,
            backlash: fields.find(is_backlash).map_or("move", |f| &f[key.len()..]),
        })
    }
}

impl Corrector<'_> {
    /// A line of a corrected program that says what it was corrected with: it must be what is taken away.
    ///
    /// # Errors
    /// Another compensation, or other reversals.
    pub(super) fn take_mark(&mut self, line: &[u8]) -> Result<(), Fault> {
        self.is_marked = true;
        let Some(given) = self.mark.as_deref().and_then(Mark::read) else {
            return Ok(());
        };
        let span = 0..line.len();
        let begin = MARK.len() - 1;
        let at = line
            .windows(begin)
            .position(|w| w.eq_ignore_ascii_case(&MARK[1..]));
        let text = String::from_utf8_lossy(&line[at.unwrap_or(0)..]);
        let text = text.split(')').next().unwrap_or_default();
        let Some(said) = Mark::read(text) else {
            return Err(Fault::new(
                span,
                format!(
                    "the comment does not say what the program was corrected with, and {} is given",
                    given.compensation
                ),
                "give the program as trueaxis gcode wrote it",
            ));
        };
        if !said.checksum.eq_ignore_ascii_case(given.checksum) {
            return Err(Fault::new(
                span,
                format!(
                    "the program was corrected with {}, and {} is given: another checksum",
                    said.compensation, given.compensation
                ),
                format!(
                    "give the compensation with the checksum {}: another one would leave the difference of both",
                    said.checksum
                ),
            ));
        }
        if !said.backlash.eq_ignore_ascii_case(given.backlash) {
            return Err(Fault::new(
                span,
                format!(
                    "the program was corrected with --backlash {}, and --backlash {} is given",
                    said.backlash, given.backlash
                ),
                format!("give --backlash {}", said.backlash),
            ));
        }
        Ok(())
    }

    /// What is taken away must be known before the first words.
    ///
    /// # Errors
    /// A program without a mark.
    pub(super) fn needs_mark(&self, block: &Block) -> Result<(), Fault> {
        let is_number = self.may_precede_mark(block);
        if self.is_marked || block.words.is_empty() || is_number {
            return Ok(());
        }
        self.no_mark(0..block.end)
    }

    /// The same at the end of a program.
    ///
    /// # Errors
    /// A program without a mark.
    pub(super) fn no_mark(&self, span: std::ops::Range<usize>) -> Result<(), Fault> {
        let given = self
            .mark
            .as_deref()
            .filter(|_| self.options.undo && !self.is_marked);
        let Some(given) = given.and_then(Mark::read) else {
            return Ok(());
        };
        Err(Fault::new(
            span,
            format!(
                "no comment before it says what the program was corrected with, and {} is given",
                given.compensation
            ),
            "give the program as trueaxis gcode wrote it, with its comment `(trueaxis corrected: …)`; from one that \
             was never corrected nothing is to be taken away",
        ))
    }
}

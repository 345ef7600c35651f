//! Pieces as lines: the line of the program with its words changed, and further ones.

mod extrusion;
mod inserted_lines;
mod rewritten_line;
mod wording;

use super::Corrector;
use super::given::Given;
use super::piece::{Piece, Shape, Timing};
use crate::axes::PerLetter;
use crate::codes::{Code, Machine};
use crate::dialect::Dialect;
use crate::fault::Fault;
use crate::interpret::{Step, bits};
use crate::line_map::Role;
use crate::modal::Motion;
use crate::words::{Block, Word};
pub(super) use extrusion::Extrusion;
pub(super) use wording::replace_number;

/// How a line is changed.
pub(super) struct Change<'p> {
    pub piece: &'p Piece,
    pub timing: &'p Timing,
    /// Axes that have to be written, whatever they are.
    pub wanted: u16,
    /// Axes whose words go, rather than staying with other values.
    pub gone: u16,
    /// Letters that go.
    pub without: &'p [u8],
    /// True if words behind the motion go too, for they are written later.
    pub without_after: bool,
}

impl Corrector<'_> {
    /// All pieces of a motion, of which there is one at least: the first one in its line, the others behind it.
    pub(super) fn write_all(
        &mut self,
        given: &Given<'_>,
        pieces: &[Piece],
        timing: &Timing,
    ) -> Result<(), Fault> {
        let several = pieces.len() > 1;
        let change = self.change(given, &pieces[0], timing, several && given.step.after);
        self.extrusion = match several {
            true => self.extrusion(given)?,
            false => None,
        };
        self.write_first(given, &change)?;
        let given = match several {
            true => self.with_end(given),
            false => *given,
        };
        self.out.extend_from_slice(given.eol);
        for piece in &pieces[1..] {
            self.write_next(&given, piece, timing)?;
        }
        self.all_is_extruded()?;
        if change.without_after {
            self.write_after(&given)?;
        }
        Ok(())
    }

    /// What becomes of the words of a line for the first piece of its motion.
    fn change<'p>(
        &self,
        given: &Given<'_>,
        piece: &'p Piece,
        timing: &'p Timing,
        without_after: bool,
    ) -> Change<'p> {
        let is_arc = matches!(
            self.nominal.motion,
            Some(Motion::Clockwise | Motion::Counterclockwise)
        );
        // A full turn has no end of its own, which rounding could make another one.
        let gone = match piece.shape {
            Shape::Arc(arc) => arc.closed(),
            _ => 0,
        };
        Change {
            piece,
            timing,
            wanted: given.block.axes() & !gone,
            gone,
            without: match piece.shape {
                _ if !is_arc => b"",
                Shape::Arc(_) => b"R",
                // Chords.
                _ => b"IJKRP",
            },
            without_after,
        }
    }

    /// What the line of a piece is.
    fn role(piece: &Piece) -> Role {
        match piece.share {
            None => Role::Step,
            Some(_) => Role::Until(piece.until),
        }
    }

    /// A line with an end, so that another one can stand beside it: the last one of a program may have none.
    pub(super) fn with_end<'l>(&self, given: &Given<'l>) -> Given<'l> {
        let eol = match given.eol {
            [] => self.eol,
            eol => eol,
        };
        Given { eol, ..*given }
    }

    /// Words that belong behind the motion, in a line of their own.
    pub(super) fn write_after(&mut self, given: &Given<'_>) -> Result<(), Fault> {
        let words = given.block.words.iter();
        let after = words.filter(|w| is_after(w, self.rules.dialect));
        let after: Vec<&[u8]> = after.map(|word| &given.line[word.span()]).collect();
        self.write_apart(given, &after.join(&b' '))
    }

    /// A line without motion beside those of a motion.
    pub(super) fn write_apart(&mut self, given: &Given<'_>, words: &[u8]) -> Result<(), Fault> {
        let from = self.out.len();
        if given.block.deleted {
            self.out.push(b'/');
        }
        self.out.extend_from_slice(words);
        self.follow(from, None)?;
        self.end_line(given.eol, Role::Plain);
        Ok(())
    }

    /// What the controller makes of the line that begins at a place of what is written: it must lead where it was meant to.
    pub(super) fn follow(&mut self, from: usize, to: Option<&PerLetter>) -> Result<Step, Fault> {
        let text = &self.out[from..];
        fits_controller(text, self.rules.dialect)?;
        if let Some(before) = self.before_modes.take() {
            self.written = before;
        }
        let mut block = std::mem::take(&mut self.check);
        block.scan(text, self.rules.dialect)?;
        // A word without a point is not meant in least increments here: all have one, or are unchanged.
        let mut step = Step::default();
        let done = self.written.step_into(&block, self.rules, &mut step);
        self.check = block;
        done?;
        let leads = to.is_none_or(|to| {
            bits(self.tables.axes).all(|i| (self.written.position.at[i] - to[i]).abs() < 1e-6)
        });
        if leads {
            return Ok(step);
        }
        Err(Fault::new(
            0..0,
            format!(
                "what would be written is wrong: `{}`",
                String::from_utf8_lossy(text)
            ),
            "this is a mistake of trueaxis: please report the line; nothing is written",
        ))
    }
}

/// True if a word G53 is in the line.
pub(super) fn is_machine(block: &Block, dialect: Dialect) -> bool {
    let is_g53 = |word: &Word| word.code(dialect) == Some(Code::MachineCoordinates);
    block.has_codes && block.words.iter().any(is_g53)
}

/// A line must not be longer than those that the controller keeps whole.
fn fits_controller(text: &[u8], dialect: Dialect) -> Result<(), Fault> {
    let table = dialect.table();
    let longest = table.longest_line;
    let length = match table.counts_words_alone {
        true => stored(text),
        false => text.len(),
    };
    if length <= longest {
        return Ok(());
    }
    Err(Fault::new(
        0..0,
        format!("the corrected line has more than {longest} bytes, which controllers cut off"),
        "shorten its comment",
    ))
}

/// Bytes of a line that Grbl keeps: neither spaces nor comments.
fn stored(text: &[u8]) -> usize {
    let mut in_comment = false;
    let kept = text.iter().take_while(|b| **b != b';').filter(|b| {
        in_comment |= **b == b'(';
        let keeps = !in_comment && !b.is_ascii_whitespace();
        in_comment &= **b != b')';
        keeps
    });
    kept.count()
}

fn is_after(word: &Word, dialect: Dialect) -> bool {
    matches!(
        word.machine(dialect),
        Some(Machine::Pause | Machine::End | Machine::After)
    )
}

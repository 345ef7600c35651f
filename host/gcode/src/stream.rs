//! Programs from a file and into one, a line at a time.

use super::fault::{Fault, Kind, Refusal};
use super::words::Block;
use super::{Corrector, Dialect};
use std::io::{BufRead, Error, Read, Write};

/// Longest line that is read, bytes: a file without line ends is not a program.
const LONGEST: u64 = 10_000;

/// Why a program was not corrected.
#[derive(Debug, thiserror::Error)]
pub enum StreamError {
    /// What is refused.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// The program cannot be read.
    #[error("the program cannot be read: {0}")]
    Read(Error),
    /// The corrected one cannot be written.
    #[error("the corrected program cannot be written: {0}")]
    Write(Error),
}

/// A line, and how it ends.
pub type Line<'l> = (&'l [u8], &'l [u8]);

/// A line without its end (LF, CR LF, or none), and the end.
pub(crate) fn split_end(line: &[u8]) -> Line<'_> {
    let end = match line {
        [.., b'\r', b'\n'] => 2,
        [.., b'\n'] => 1,
        _ => 0,
    };
    line.split_at(line.len() - end)
}

/// The lines of a program, one after the other.
#[derive(Debug)]
pub struct Lines<R> {
    reader: R,
    line: Vec<u8>,
    number: u64,
}

impl<R: BufRead> Lines<R> {
    /// From the beginning.
    pub fn new(reader: R) -> Self {
        Self {
            reader,
            line: Vec::new(),
            number: 0,
        }
    }

    /// Number of the last line, from 1.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// The next line and how it ends (LF, CR LF, or not at all).
    ///
    /// # Errors
    /// What cannot be read, and a line of more than 10 000 bytes.
    pub fn next_line(&mut self) -> Result<Option<Line<'_>>, StreamError> {
        self.line.clear();
        let mut limited = self.reader.by_ref().take(LONGEST);
        let read = limited.read_until(b'\n', &mut self.line);
        let read = read.map_err(StreamError::Read)?;
        if read == 0 {
            return Ok(None);
        }
        self.number += 1;
        if read as u64 == LONGEST && self.line.last() != Some(&b'\n') {
            let remedy = match self.line.contains(&b'\r') {
                true => {
                    "end lines with LF or with CR LF: the file has CR alone, as old Macintosh files do"
                }
                false => "give a program: text in lines",
            };
            let fault = Fault::new(
                0..40,
                format!("a line of more than {LONGEST} bytes"),
                remedy,
            );
            return Err(Refusal::at(fault, self.number, &self.line).into());
        }
        Ok(Some(split_end(&self.line)))
    }
}

/// Looks for what no line may have: parameters, expressions and O-words, before anything is interpreted.
///
/// # Errors
/// The first such line.
pub fn look_for_computing(reader: impl BufRead, dialect: Dialect) -> Result<(), StreamError> {
    let mut lines = Lines::new(reader);
    let mut block = Block::default();
    let mut number = 0;
    while let Some((line, _)) = lines.next_line()? {
        number += 1;
        let speaks = |b: &u8| matches!(b, b'#' | b'[' | b'o' | b'O' | b'M' | b'm' | b'%');
        if !line.iter().any(speaks) {
            continue;
        }
        match block.scan(line, dialect) {
            // Lines after the end are not part of the program.
            Ok(()) if block.percent && number > 1 => break,
            Ok(()) if !block.deleted && block.ends(dialect) => break,
            Err(fault) if matches!(fault.kind, Kind::Parameter | Kind::Expression | Kind::Flow) => {
                return Err(Refusal::at(fault, number, line).into());
            }
            // Anything else is told where it is interpreted.
            _ => {}
        }
    }
    Ok(())
}

/// Corrects a program. Writes the map of its lines to `map` (see [`super::line_map`]), and calls `seen` with the number
/// of bytes of each line read.
///
/// # Errors
/// See [`StreamError`]; what was written by then is of no use.
pub fn correct(
    reader: impl BufRead,
    writer: &mut impl Write,
    map: &mut impl Write,
    corrector: &mut Corrector<'_>,
    mut seen: impl FnMut(u64),
) -> Result<(), StreamError> {
    let mut lines = Lines::new(reader);
    let mut out = Vec::new();
    while let Some((line, eol)) = lines.next_line()? {
        let read = (line.len() + eol.len()) as u64;
        corrector.next(line, eol, &mut out)?;
        if out.len() > 1 << 16 {
            writer.write_all(&out).map_err(StreamError::Write)?;
            corrector.take_map(map).map_err(StreamError::Write)?;
            out.clear();
        }
        seen(read);
    }
    corrector.finish()?;
    corrector.take_map(map).map_err(StreamError::Write)?;
    writer.write_all(&out).map_err(StreamError::Write)
}

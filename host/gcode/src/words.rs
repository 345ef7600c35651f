//! Words of a line: letters with numbers, in f64, with the place of every byte.

mod digits;
mod names;
mod printer;
mod unknown_bytes;

use super::axes;
use super::codes::{Code, Machine};
use super::dialect::Dialect;
use super::fault::{FLAT, Fault, Kind};
use super::modal::Distance;
use digits::{Number, number_at};
pub(crate) use names::number_of_name;
pub use printer::Command;
use unknown_bytes::{heidenhain, is_din_iso, strange};

/// A letter and its number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Word {
    /// The letter, a capital.
    pub letter: u8,
    /// Number.
    pub value: f64,
    /// Where the letter stands.
    pub start: usize,
    /// Where the number begins.
    pub number: usize,
    /// Behind the word.
    pub end: usize,
    /// Digits behind the point.
    pub decimals: usize,
    /// True if there is a point.
    pub point: bool,
    /// What it counts from, where it says so itself: a Sinumerik's AC and IC, with a bracket after the digits.
    pub distance: Option<Distance>,
}

impl Word {
    /// A letter with the number at `place`.
    fn with_number(letter: u8, start: usize, place: usize, number: &Number) -> Self {
        Self {
            letter,
            value: number.value,
            start,
            number: place,
            end: number.end,
            decimals: number.decimals,
            point: number.point,
            distance: None,
        }
    }

    /// A word whose bytes are not a letter and a number.
    fn meant(letter: u8, value: f64, start: usize, end: usize) -> Self {
        Self {
            letter,
            value,
            start,
            number: start,
            end,
            decimals: 0,
            point: false,
            distance: None,
        }
    }

    /// Bytes of the number.
    #[must_use]
    pub fn digits(&self) -> std::ops::Range<usize> {
        self.number..self.end - usize::from(self.distance.is_some())
    }

    /// What is wrong with it.
    pub(crate) fn fault(&self, cause: impl Into<String>, remedy: impl Into<String>) -> Fault {
        Fault::new(self.span(), cause, remedy)
    }

    /// Bytes.
    #[must_use]
    pub fn span(&self) -> std::ops::Range<usize> {
        self.start..self.end
    }

    /// What it asks for; `None` unless it is a G word that is known and built.
    #[must_use]
    #[inline]
    pub fn code(&self, dialect: Dialect) -> Option<Code> {
        match self.letter {
            b'G' => dialect.g(self.tenths()?),
            _ => None,
        }
    }

    /// What it asks for; `None` unless it is an M word that is known.
    #[must_use]
    #[inline]
    pub fn machine(&self, dialect: Dialect) -> Option<Machine> {
        match self.letter {
            b'M' => dialect.m(self.tenths()?),
            _ => None,
        }
    }

    /// The number of a G or M word in tenths: G54.1 is 541.
    #[must_use]
    pub fn tenths(&self) -> Option<u16> {
        let tenths = self.value * 10.0;
        let rounded = tenths.round();
        ((tenths - rounded).abs() < 1e-6 && (0.0..60_000.0).contains(&rounded))
            .then_some(rounded as u16)
    }
}

/// A line, read.
#[derive(Clone, Debug, Default)]
pub struct Block {
    /// Words of the line.
    pub words: Vec<Word>,
    /// True behind `/`.
    pub deleted: bool,
    /// True if it is `%`.
    pub percent: bool,
    /// True if a comment in it says that the program is corrected already.
    pub marked: bool,
    /// A line of a printer that is not read as words.
    pub command: Option<Command>,
    /// True if it has words G or M: without any it goes on with what holds.
    pub has_codes: bool,
    /// True if there is anything else than words: comments, or what stands behind `%`.
    pub has_text: bool,
    /// Behind its last word, or behind `/`: where words can be added.
    pub end: usize,
    /// Place of the word of a letter, plus 1 (not of G and M).
    by: [u8; 26],
}

/// How the first comment of a corrected program begins.
pub(crate) const MARK: &[u8] = b"(trueaxis corrected";

/// TRAORI and TRAFOOF, a Sinumerik's words for M428 and M429, as words M: numbers that no M word has.
pub(super) const TRANSFORMATIONS: [(&str, f64); 2] = [("TRAORI", 428.9), ("TRAFOOF", 429.9)];

/// What a line begins with, if it is one of the words that are no letter and number.
fn transformation(line: &[u8]) -> Option<(&'static str, f64)> {
    TRANSFORMATIONS.into_iter().find(|(name, _)| {
        let (begins, next) = (line.get(..name.len()), line.get(name.len()));
        begins.is_some_and(|b| b.eq_ignore_ascii_case(name.as_bytes()))
            && !next.is_some_and(u8::is_ascii_alphanumeric)
    })
}

/// Words after an O-word that computes.
const FLOW: &str =
    "sub endsub call return if elseif else endif while endwhile do repeat endrepeat break continue";

/// True if what stands behind an O makes it a word of LinuxCNC's flow control, and not the number of a program.
fn is_flow(rest: &[u8]) -> bool {
    let begins = rest.first().copied();
    let after: Vec<u8> = rest
        .iter()
        .skip_while(|b| b.is_ascii_digit() || b.is_ascii_whitespace())
        .take_while(|b| b.is_ascii_alphabetic())
        .map(u8::to_ascii_lowercase)
        .collect();
    matches!(begins, Some(b'<' | b'[' | b'#'))
        || FLOW.split(' ').any(|word| after == word.as_bytes())
}

/// True for a line that asks Grbl for something, and changes nothing.
fn is_question(line: &[u8]) -> bool {
    let words = line.split(|b| matches!(b, b';' | b'(')).next();
    matches!(
        words.unwrap_or_default().trim_ascii(),
        b"?" | b"$" | b"$$" | b"$#" | b"$I" | b"$G" | b"$N"
    )
}

/// Where a comment begins within another one.
fn nested(line: &[u8]) -> Option<usize> {
    let mut within = false;
    line.iter().position(|byte| {
        let again = within && *byte == b'(';
        within = *byte == b'(' || within && *byte != b')';
        again
    })
}

/// Behind `;` Fanuc's controllers begin another block, others of their kin a comment.
fn another_block(line: &[u8], at: usize) -> Result<(), Fault> {
    let blank = |b: &&u8| matches!(b, b' ' | b'\t' | b'/');
    let letter = at + line[at..].iter().take_while(blank).count();
    let is_word = line.get(letter).is_some_and(u8::is_ascii_alphabetic)
        && number_at(line, letter + 1).is_some();
    match is_word {
        false => Ok(()),
        true => Err(Fault::new(
            letter..line.len(),
            "words after `;`, which ends a block on some controllers and begins a comment on others",
            "write a line for each block, and comments in brackets",
        )),
    }
}

/// Most words of a line.
const MOST: usize = 100;

impl Block {
    /// True if it ends the program: M2, M30.
    #[must_use]
    pub fn ends(&self, dialect: Dialect) -> bool {
        let ends = |word: &Word| word.machine(dialect) == Some(Machine::End);
        self.has_codes && self.words.iter().any(ends)
    }

    /// The word of a letter other than G and M.
    #[must_use]
    pub fn word(&self, letter: u8) -> Option<&Word> {
        match self.by[usize::from(letter - b'A')] {
            0 => None,
            place => self.words.get(usize::from(place) - 1),
        }
    }

    /// The first word of an axis.
    pub(crate) fn first_axis(&self) -> Option<&Word> {
        self.words.iter().find(|w| axes::index(w.letter).is_some())
    }

    /// The bytes of the first word of an axis, or of the line.
    pub(crate) fn axis_span(&self) -> std::ops::Range<usize> {
        self.first_axis().map_or(0..self.end, Word::span)
    }

    /// What is wrong with the motion of the line.
    pub(crate) fn fault(&self, cause: impl Into<String>, remedy: impl Into<String>) -> Fault {
        Fault::new(self.axis_span(), cause, remedy)
    }

    /// Adds a word.
    pub(super) fn push(&mut self, word: Word) {
        self.words.push(word);
        self.end = word.end;
        if word.letter != b'G' && word.letter != b'M' {
            self.by[usize::from(word.letter - b'A')] = self.words.len() as u8;
        } else {
            self.has_codes = true;
        }
    }

    /// Reads a line without its end. The vector is used again.
    ///
    /// # Errors
    /// What cannot be read.
    pub fn scan(&mut self, line: &[u8], dialect: Dialect) -> Result<(), Fault> {
        let mut words = std::mem::take(&mut self.words);
        words.clear();
        *self = Self {
            words,
            ..Self::default()
        };
        let done = self.scan_words(line, dialect);
        // Of all that may be wrong line ends are told first; a comment would hide all lines behind them.
        if (done.is_err() || self.has_text)
            && let Some(at) = line.iter().position(|b| matches!(b, b'\r' | 0))
        {
            // A byte order mark says more than the NUL behind it.
            let is_marked = matches!(line[0], 0xFE | 0xFF);
            return Err(strange(line, if is_marked { 0 } else { at }));
        }
        if done.is_err()
            && let Some(at) = nested(line)
        {
            return Err(Fault::new(
                at..line.len(),
                "a comment within a comment: it ends at the first `)`",
                "take the inner brackets out",
            ));
        }
        done.map_err(|fault| heidenhain(line).unwrap_or(fault))
    }

    fn scan_words(&mut self, line: &[u8], dialect: Dialect) -> Result<(), Fault> {
        if !dialect.table().printer {
            return self.scan_letters(line, dialect);
        }
        if self.scan_printer(line)? {
            return Ok(());
        }
        self.scan_letters(line, dialect)?;
        self.one_command()
    }

    fn scan_letters(&mut self, line: &[u8], dialect: Dialect) -> Result<(), Fault> {
        let mut at = 0;
        while let Some(&byte) = line.get(at) {
            match byte {
                b' ' | b'\t' => at += 1,
                b';' => {
                    self.has_text = true;
                    if dialect.table().semicolon_ends_block {
                        another_block(line, at + 1)?;
                    }
                    self.look_for_mark(&line[at..]);
                    break;
                }
                b'(' if !dialect.table().has_names => at = self.comment(line, at)?,
                b'/' if self.words.is_empty() && !self.deleted => {
                    self.deleted = true;
                    at += 1;
                    self.end = at;
                }
                b'%' if self.words.is_empty() && !self.deleted && !is_din_iso(line) => {
                    // The rest of such a line is not part of the program.
                    (self.percent, self.has_text) = (true, true);
                    break;
                }
                // Questions to Grbl, which answers and does nothing.
                b'$' | b'?' if at == 0 && dialect.table().asks && is_question(line) => {
                    self.has_text = true;
                    break;
                }
                // Another way to write the number of a program.
                b':' if self.words.is_empty() => at = self.word_at(line, at)?,
                _ if byte.is_ascii_alphabetic() && dialect.table().has_names => {
                    at = self.named_word(line, at)?;
                }
                _ if byte.is_ascii_alphabetic() => at = self.word_at(line, at)?,
                _ => return Err(strange(line, at)),
            }
        }
        Ok(())
    }

    /// A comment in brackets; returns where it ends.
    fn comment(&mut self, line: &[u8], start: usize) -> Result<usize, Fault> {
        let Some(length) = line[start..].iter().position(|b| *b == b')') else {
            return Err(Fault::new(
                start..line.len(),
                "a comment that does not end",
                "end it with `)` in the same line",
            ));
        };
        self.has_text = true;
        self.look_for_mark(&line[start..start + length]);
        Ok(start + length + 1)
    }

    fn look_for_mark(&mut self, comment: &[u8]) {
        // Behind its first byte, ( or ;.
        let begins = comment.get(1..MARK.len());
        self.marked |= begins.is_some_and(|b| b.eq_ignore_ascii_case(&MARK[1..]));
    }

    fn word_at(&mut self, line: &[u8], start: usize) -> Result<usize, Fault> {
        let letter = match line[start] {
            b':' => b'O',
            letter => letter.to_ascii_uppercase(),
        };
        let mut number = start + 1;
        while let Some(b' ' | b'\t') = line.get(number) {
            number += 1;
        }
        if letter == b'O' && is_flow(&line[number..]) {
            return Err(
                Fault::new(start..line.len(), "an O-word: the program computes", FLAT)
                    .kind(Kind::Flow),
            );
        }
        if letter == b'T'
            && self.words.len() < MOST
            && let Some((name, value)) = transformation(&line[start..])
        {
            let end = start + name.len();
            self.push(Word::meant(b'M', value, start, end));
            return Ok(end);
        }
        let Some(read) = number_at(line, number) else {
            let signed = matches!(line.get(number), Some(b'+' | b'-'));
            return Err(match line.get(number + usize::from(signed)) {
                Some(b'#' | b'[') => strange(line, number + usize::from(signed)),
                _ => Fault::new(
                    start..(number + 1).min(line.len()),
                    "a letter without a number",
                    "write a number after each letter: digits, a point, no exponent",
                ),
            });
        };
        self.add(Word::with_number(letter, start, number, &read))
    }

    /// The axes that have words, a bit each.
    pub(crate) fn axes(&self) -> u16 {
        let axes = self.words.iter().filter_map(|w| axes::index(w.letter));
        axes.fold(0, |mask, axis| mask | 1 << axis)
    }

    /// Adds a word of a line; returns where it ends.
    fn add(&mut self, word: Word) -> Result<usize, Fault> {
        let (letter, end) = (word.letter, word.end);
        // Numbers of lines tell nothing.
        if letter != b'N' && !axes::can_be(word.value) {
            return Err(word.fault(
                format!("a number beyond {:.0e}", axes::LARGEST),
                "write a position within reach: so large a number has no digits for µm",
            ));
        }
        if self.words.len() == MOST {
            return Err(word.fault(
                format!("more than {MOST} words in a line"),
                "write several lines",
            ));
        }
        if self.by[usize::from(letter - b'A')] != 0 {
            let letter = char::from(letter);
            return Err(word.fault(
                format!("a second word {letter} in the line"),
                "write one, or two lines",
            ));
        }
        self.push(word);
        Ok(end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn words(line: &str) -> Vec<(char, f64)> {
        let mut block = Block::default();
        block.scan(line.as_bytes(), Dialect::LinuxCnc).unwrap();
        let words = block.words.iter();
        words.map(|w| (char::from(w.letter), w.value)).collect()
    }

    fn kind(line: &str) -> Kind {
        let mut block = Block::default();
        block
            .scan(line.as_bytes(), Dialect::LinuxCnc)
            .unwrap_err()
            .kind
    }

    #[test]
    fn words_are_read_with_or_without_spaces_and_between_comments() {
        let expected = vec![
            ('N', 10.0),
            ('G', 1.0),
            ('X', -1.5),
            ('Y', 0.25),
            ('F', 100.0),
        ];
        assert_eq!(words("N10 G1 X-1.5 Y+.25 F100."), expected);
        assert_eq!(words("n10g1(to (the hole)x-1.5\tY .25F100;Z9"), expected);
        assert_eq!(words("; nothing"), []);
    }

    #[test]
    fn what_computes_is_named() {
        assert_eq!(kind("X#5"), Kind::Parameter);
        assert_eq!(kind("#<depth> = 3"), Kind::Parameter);
        assert_eq!(kind("G1 X[1+2]"), Kind::Expression);
        assert_eq!(kind("o100 call"), Kind::Flow);
        assert_eq!(kind("O<fix> sub"), Kind::Flow);
        assert_eq!(kind("X-#5"), Kind::Parameter);
        assert_eq!(kind("G81 ^[360/17]"), Kind::Expression);
        assert_eq!(kind("G81 ^60"), Kind::Word);
        assert_eq!(kind("G1 X"), Kind::Other);
        assert_eq!(kind("G1 X1 2"), Kind::Other);
        assert_eq!(kind("G1 X1 X2"), Kind::Other);
        assert_eq!(kind("G1 (X1"), Kind::Other);
        assert_eq!(kind("\u{feff}G1"), Kind::Other);
        assert_eq!(kind("G1\rG2"), Kind::Other);
    }

    proptest! {
        #[test]
        fn no_line_makes_the_scanner_panic(line in proptest::collection::vec(any::<u8>(), 0..60)) {
            let mut block = Block::default();
            let _ = block.scan(&line, Dialect::Fanuc);
        }
    }
}

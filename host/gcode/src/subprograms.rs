//! Subprograms in the file of their program, written where they are called: M98 P (a program O), M97 P (a line N, on a
//! Haas), each up to its M99.
//!
//! The program that comes out has no calls. A line with a call becomes its other words and a comment; a line O of a
//! subprogram becomes a comment. Subprograms that nothing calls stay where they are, behind the end.

use super::check::CheckResult;
use super::dialect::Dialect;
use super::edit::Edits;
use super::fault::{Fault, Kind, Refusal};
use super::report::Report;
use super::stream::split_end;
use super::words::{Block, Word};
use std::collections::BTreeMap;
use std::io::{BufRead, Error};

/// Calls within calls, at most.
const DEEPEST: usize = 10;
/// Most bytes of a program whose calls are written out.
const LARGEST: usize = 256 << 20;

/// A program without calls.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Inlined {
    /// Text.
    pub text: Vec<u8>,
    /// The line of the file, from 1, that each of its lines comes from.
    lines: Vec<u32>,
}

impl Inlined {
    /// The line of the file that a line comes from.
    #[must_use]
    pub fn original(&self, line: u64) -> u64 {
        let at = usize::try_from(line)
            .unwrap_or(usize::MAX)
            .saturating_sub(1);
        let known = self.lines.get(at).or(self.lines.last());
        known.map_or(line, |line| u64::from(*line))
    }

    /// What is refused, at the line of the file.
    #[must_use]
    pub fn refusal(&self, refusal: &Refusal) -> Refusal {
        Refusal {
            line: self.original(refusal.line),
            ..refusal.clone()
        }
    }

    /// Puts lines of the file in place of those of the program without calls.
    pub fn relabel(&self, report: &mut Report, found: Option<&mut CheckResult>) {
        let largest = report.largest.iter_mut().map(|(_, line)| line);
        let written_out = report.written_out.iter_mut().map(|(line, _)| line);
        let found = found.into_iter().flat_map(CheckResult::places);
        for line in largest.chain(written_out).chain(found) {
            *line = self.original(*line);
        }
    }

    /// How many lines it has.
    #[must_use]
    pub fn lines(&self) -> usize {
        self.lines.len()
    }
}

/// True if a program calls subprograms: a word M97 or M98 in any of its lines, comments aside.
///
/// # Errors
/// What cannot be read.
pub fn calls(mut reader: impl BufRead, dialect: Dialect) -> Result<bool, Error> {
    let (mut line, mut block) = (Vec::new(), Block::default());
    loop {
        line.clear();
        if reader.read_until(b'\n', &mut line)? == 0 {
            return Ok(false);
        }
        let mut pairs = line.windows(2);
        let may_call = pairs.any(|pair| matches!(pair, b"97" | b"98"))
            && line.iter().any(|b| matches!(b, b'M' | b'm'));
        if may_call {
            let _ = block.scan(split_end(&line).0, dialect);
            if block.words.iter().any(|word| call_of(word).is_some()) {
                return Ok(true);
            }
        }
    }
}

/// What a word M does.
#[derive(Clone, Copy, PartialEq)]
enum Call {
    /// M98: the number of a program.
    Program,
    /// M97: the number of a line.
    Line,
    /// M99.
    Return,
}

fn call_of(word: &Word) -> Option<Call> {
    match (word.letter, word.tenths()) {
        (b'M', Some(980)) => Some(Call::Program),
        (b'M', Some(970)) => Some(Call::Line),
        (b'M', Some(990)) => Some(Call::Return),
        _ => None,
    }
}

/// Writes the calls of a program out.
///
/// # Errors
/// A subprogram that is not in the file, or that does not end; returns to other lines; calls within more than ten calls.
pub fn inline(text: &[u8], dialect: Dialect) -> Result<Inlined, Refusal> {
    let lines: Vec<&[u8]> = text.split_inclusive(|b| *b == b'\n').collect();
    let mut inliner = Inliner::new(lines, dialect);
    let end = match inliner.run(0, 0)? {
        Flow::Ended(at) => at + 1,
        Flow::Returned => inliner.lines.len(),
    };
    // What no call has used is told where it is corrected.
    for at in end..inliner.lines.len() {
        if !inliner.used[at] {
            inliner.copy(at);
        }
    }
    Ok(inliner.done)
}

/// How a run of lines ends.
enum Flow {
    /// By M99.
    Returned,
    /// By M2, M30 or `%` in this line, or by the end of the file.
    Ended(usize),
}

struct Inliner<'t> {
    dialect: Dialect,
    lines: Vec<&'t [u8]>,
    /// Where programs begin, by their numbers.
    programs: BTreeMap<u32, usize>,
    /// Lines by their N, of each program in the file.
    numbers: BTreeMap<(usize, u32), usize>,
    /// In which program of the file a line is.
    within: Vec<usize>,
    /// Lines that calls have run.
    used: Vec<bool>,
    edits: Edits,
    done: Inlined,
}

impl<'t> Inliner<'t> {
    fn new(lines: Vec<&'t [u8]>, dialect: Dialect) -> Self {
        let (mut programs, mut numbers) = (BTreeMap::new(), BTreeMap::new());
        let (mut within, mut program) = (Vec::with_capacity(lines.len()), 0);
        let mut block = Block::default();
        for (at, line) in lines.iter().enumerate() {
            let _ = block.scan(split_end(line).0, dialect);
            if let Some(word) = block.word(b'O') {
                programs.entry(word.value as u32).or_insert(at);
                program += 1;
            }
            if let Some(word) = block.word(b'N') {
                numbers.entry((program, word.value as u32)).or_insert(at);
            }
            within.push(program);
        }
        Self {
            dialect,
            used: vec![false; lines.len()],
            lines,
            programs,
            numbers,
            within,
            edits: Edits::default(),
            done: Inlined::default(),
        }
    }

    /// Runs lines up to an end or a return.
    fn run(&mut self, start: usize, depth: usize) -> Result<Flow, Refusal> {
        let (mut block, mut begun) = (Block::default(), false);
        for at in start..self.lines.len() {
            self.used[at] |= depth > 0;
            let (line, _) = split_end(self.lines[at]);
            // What cannot be read is told where it is corrected.
            if block.scan(line, self.dialect).is_err() {
                self.copy(at);
                continue;
            }
            let named = block.word(b'O');
            if depth > 0 && (block.percent || named.is_some() && at > start) {
                return Err(self.without_return(at, line.len()));
            }
            if let (Some(word), true) = (named, depth > 0) {
                self.without(at, &block, |other| other == word);
                continue;
            }
            if block.percent && begun {
                self.copy(at);
                return Ok(Flow::Ended(at));
            }
            begun |= !block.words.is_empty();
            let mut words = block.words.iter();
            let flow = match words.find_map(|word| Some((word, call_of(word)?))) {
                Some((word, call)) => self.call(at, &block, word, call, depth)?,
                None => {
                    self.copy(at);
                    block.ends(self.dialect).then_some(Flow::Ended(at))
                }
            };
            if let Some(flow) = flow {
                return Ok(flow);
            }
        }
        match depth {
            0 => Ok(Flow::Ended(self.lines.len())),
            _ => Err(self.without_return(start, 0)),
        }
    }

    /// Expands a line with a call or a return; `None` if the next line follows.
    fn call(
        &mut self,
        at: usize,
        block: &Block,
        word: &Word,
        call: Call,
        depth: usize,
    ) -> Result<Option<Flow>, Refusal> {
        if block.deleted {
            return Err(self.refused(
                at,
                word.span(),
                "a call or a return after `/`",
                "take `/` or the line out",
            ));
        }
        if call == Call::Return {
            if depth == 0 || block.word(b'P').is_some() {
                return Err(self.refused(
                    at,
                    word.span(),
                    "M99 in the main program, or with P: it jumps",
                    "end the main program with M30, and subprograms with M99 alone",
                ));
            }
            self.without(at, block, |other| other == word);
            return Ok(Some(Flow::Returned));
        }
        let (to, times) = self.target(at, block, word, call)?;
        if depth >= DEEPEST {
            return Err(self.refused(
                at,
                word.span(),
                "calls within more than ten calls",
                "check which subprogram calls itself",
            ));
        }
        self.without(at, block, |other| {
            other == word || b"PL".contains(&other.letter)
        });
        let before = self.done.text.len();
        for call in 1..=times as usize {
            if let Flow::Ended(_) = self.run(to, depth + 1)? {
                return Ok(Some(Flow::Ended(at)));
            }
            // Every call adds as much.
            let added = (self.done.text.len() - before) / call;
            if before.saturating_add(added.saturating_mul(times as usize)) > LARGEST {
                return Err(self.refused(
                    at,
                    word.span(),
                    "more than 256 MB of calls written out",
                    "check L: it is how often the subprogram is called",
                ));
            }
        }
        Ok(None)
    }

    /// Where a call leads, and how often.
    fn target(
        &self,
        at: usize,
        block: &Block,
        word: &Word,
        call: Call,
    ) -> Result<(usize, u32), Refusal> {
        let whole = |letter: u8| {
            block
                .word(letter)
                .filter(|w| w.value >= 0.0 && w.value.fract() == 0.0)
        };
        let number = whole(b'P').map(|p| p.value as u32);
        let times = whole(b'L').map(|l| l.value as u32).filter(|l| *l > 0);
        if let (Some(often), None) = (block.word(b'L'), times) {
            return Err(self.refused(
                at,
                often.span(),
                "L that is not a whole number of calls",
                "write a whole number from 1 up, or remove the call",
            ));
        }
        let to = match (number, call) {
            (None, _) => Err((
                "a call without P".to_owned(),
                "write P with the number of the subprogram",
            )),
            (Some(number), Call::Line) => match self.numbers.get(&(self.within[at], number)) {
                Some(to) => Ok((*to, times.unwrap_or(1))),
                None => Err((
                    format!("the program has no line N{number}"),
                    "write the number of a line of the same program after P",
                )),
            },
            (Some(number), _) => self.program(number, times),
        };
        to.map_err(|(cause, remedy)| self.refused(at, word.span(), &cause, remedy))
    }

    /// Where a program begins, and how often it is called; or why that is not known, and what to do.
    fn program(
        &self,
        number: u32,
        times: Option<u32>,
    ) -> Result<(usize, u32), (String, &'static str)> {
        // P00031234 is three times O1234 on a Fanuc; on a Haas all digits are the program's.
        let has_times = self.dialect == Dialect::Fanuc && number > 9999 && times.is_none();
        let short = has_times.then(|| self.programs.get(&(number % 10_000)));
        match (self.programs.get(&number), short.flatten()) {
            (Some(_), Some(_)) => Err((
                format!(
                    "P{number} is program {number}, or {} times program {}",
                    number / 10_000,
                    number % 10_000
                ),
                "write how often with L",
            )),
            (Some(to), None) => Ok((*to, times.unwrap_or(1))),
            (None, Some(to)) => Ok((*to, number / 10_000)),
            (None, None) => Err((
                format!("the file has no program O{number}"),
                "append the subprogram to the file, from its line O to its M99",
            )),
        }
    }

    /// A subprogram that does not end.
    fn without_return(&self, at: usize, length: usize) -> Refusal {
        self.refused(at, 0..length, "a subprogram without M99", "end it with M99")
    }

    fn refused(
        &self,
        at: usize,
        span: std::ops::Range<usize>,
        cause: &str,
        remedy: &str,
    ) -> Refusal {
        let fault = Fault::new(span, cause, remedy).kind(Kind::Flow);
        Refusal::at(fault, at as u64 + 1, split_end(self.lines[at]).0)
    }

    /// A line as it is.
    fn copy(&mut self, at: usize) {
        self.done.text.extend_from_slice(self.lines[at]);
        self.done.lines.push(at as u32 + 1);
    }

    /// A line without some of its words, which stand in a comment behind it.
    fn without(&mut self, at: usize, block: &Block, goes: impl Fn(&Word) -> bool) {
        let (line, end) = split_end(self.lines[at]);
        self.edits.clear();
        let mut gone = Vec::new();
        for word in block.words.iter().filter(|word| goes(word)) {
            self.edits.remove(line, word.span());
            gone.push(b' ');
            gone.extend_from_slice(&line[word.span()]);
        }
        self.edits.replace(block.end..block.end, |to| {
            to.push(b'(');
            to.extend_from_slice(gone.trim_ascii());
            to.push(b')');
        });
        self.edits.apply(line, &mut self.done.text);
        self.done.text.extend_from_slice(match end {
            [] => b"\n",
            end => end,
        });
        self.done.lines.push(at as u32 + 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn inlined(text: &str) -> String {
        let inlined = inline(text.as_bytes(), Dialect::Haas).unwrap();
        assert_eq!(
            inlined.lines(),
            inlined.text.split_inclusive(|b| *b == b'\n').count()
        );
        String::from_utf8(inlined.text).unwrap()
    }

    #[test]
    fn subprograms_stand_where_they_are_called_and_as_often() {
        let text = "%\nO1 (main)\nG0 X1. M98 P2 L2\nM97 P100\nM30\nN100 G1 Y1.\nM99\nO2 (sub)\nX2.\nG0 Z1. M99\n%\n";
        assert_eq!(
            inlined(text),
            "%\nO1 (main)\nG0 X1.(M98 P2 L2)\n\
             (O2) (sub)\nX2.\nG0 Z1.(M99)\n(O2) (sub)\nX2.\nG0 Z1.(M99)\n\
             (M97 P100)\nN100 G1 Y1.\n(M99)\nM30\n%\n"
        );
        let inlined = inline(text.as_bytes(), Dialect::Haas).unwrap();
        assert_eq!([4, 7, 13].map(|line| inlined.original(line)), [8, 8, 5]);
    }

    #[test]
    fn the_repeats_of_older_controllers_stand_before_the_number() {
        let text = b"M98 P20003\nM30\nO3\nX1.\nM99\n";
        let written = inline(text, Dialect::Fanuc).unwrap().text;
        assert_eq!(
            String::from_utf8(written).unwrap(),
            "(M98 P20003)\n(O3)\nX1.\n(M99)\n(O3)\nX1.\n(M99)\nM30\n"
        );
        // On a Haas all five digits are the number of the program.
        let refusal = inline(text, Dialect::Haas).unwrap_err();
        assert_eq!(refusal.cause, "the file has no program O20003");
        let both = inlined("M98 P20003\nM30\nO3\nX1.\nM99\nO20003\nX2.\nM99\n");
        assert!(
            both.starts_with("(M98 P20003)\n(O20003)\nX2.\n(M99)\nM30\n"),
            "{both}"
        );
    }

    #[test]
    fn what_cannot_be_written_out_is_named() {
        let cause = |text: &str| inline(text.as_bytes(), Dialect::Fanuc).unwrap_err().cause;
        for (text, part) in [
            ("M98 P9\nM30\n", "no program O9"),
            ("M98 P2\nM30\nO2\nM98 P2\nM99\n", "more than ten calls"),
            ("M98 P2\nM30\nO2\nX1.\nO3\nM99\n", "without M99"),
            ("M98 P2\nM30\nO2\nX1.\n", "without M99"),
            ("G0 X1.\nM99\n", "in the main program"),
            ("/M98 P2\nM30\nO2\nM99\n", "after `/`"),
            ("M98\nM30\n", "without P"),
            ("M98 P2 L2.5\nM30\nO2\nM99\n", "L that is not a whole"),
            ("M98 P2 L-1\nM30\nO2\nM99\n", "L that is not a whole"),
            ("M97 P2 L0\nM30\nN2 M99\n", "L that is not a whole"),
            (
                "M98 P20003\nM30\nO3\nM99\nO20003\nM99\n",
                "2 times program 3",
            ),
            (
                "M98 P2 L9999\nM30\nO2\nM98 P3 L9999\nM99\nO3\nM99\n",
                "256 MB",
            ),
        ] {
            assert!(cause(text).contains(part), "{text}");
        }
    }

    proptest! {
        #[test]
        fn no_program_makes_it_panic(text in "([OMNPLX]([0-9]|9[789])|[ \n%/(;)]){0,60}") {
            let _ = inline(text.as_bytes(), Dialect::Haas);
            let _ = calls(text.as_bytes(), Dialect::Haas);
        }
    }
}

//! A line of the program with corrected words.

use super::wording::{Wording, replace_number, write_word};
use super::{Change, is_after};
use crate::axes;
use crate::codes::Code;
use crate::correct::Corrector;
use crate::correct::feed::same_feed;
use crate::correct::given::Given;
use crate::edit::Edits;
use crate::fault::Fault;
use crate::interpret::bits;
use crate::modal::Motion;
use crate::number;
use crate::state::Rules;
use crate::words::{Block, Word};

/// What the words of the line say already, and where others belong.
#[derive(Default)]
struct WordsPresent {
    axes: u16,
    centre: [bool; 2],
    turns: bool,
    feed: bool,
    motion: bool,
    /// Where the first axis begins.
    first_axis: Option<usize>,
    /// Where the last axis, or word of a centre, ends.
    last_axis: Option<usize>,
}

/// A line of the program while its words are changed.
struct RewrittenLine<'l> {
    given: &'l Given<'l>,
    change: &'l Change<'l>,
    wording: &'l Wording,
    rules: &'l Rules,
    said: WordsPresent,
    edits: Edits,
}

impl RewrittenLine<'_> {
    fn change_motion(&mut self, word: &Word, was: Motion) {
        let Some(motion) = self.wording.motion else {
            return;
        };
        self.said.motion = true;
        if was != motion {
            self.edits.replace(word.span(), |to| {
                to.extend_from_slice(motion.word().as_bytes())
            });
        }
    }

    fn change_axis(&mut self, word: &Word, axis: usize) {
        let words = &self.wording.words;
        if (self.change.gone | words.left_out) & (1 << axis) != 0 {
            self.edits.remove(self.given.line, word.span());
        } else if words.written & (1 << axis) != 0 {
            self.said.axes |= 1 << axis;
            self.said.first_axis = self.said.first_axis.or(Some(word.start));
            self.said.last_axis = Some(word.end);
            let decimals = usize::from(words.decimals[axis]);
            self.replace(word, words.value[axis], decimals);
        }
    }

    /// P of an arc.
    fn change_turns(&mut self, word: &Word) {
        self.said.turns = true;
        let turns = self.wording.turns;
        let is_printer = self.rules.dialect.table().printer;
        // No full circle any more.
        let opens = is_printer && self.wording.words.written & 0b11 != 0;
        let is_other = word.value.max(1.0) != f64::from(turns);
        if opens || is_other && turns == 1 {
            self.edits.remove(self.given.line, word.span());
        } else if is_other {
            self.edits.replace(word.digits(), |to| {
                number::write(to, f64::from(turns), 0, 0, false);
            });
        }
    }

    fn replace(&mut self, word: &Word, value: f64, decimals: usize) {
        replace_number(&mut self.edits, self.rules, word, value, decimals);
    }

    /// Writes further words behind those of the axes.
    fn add(&mut self, separator: &[u8], write: impl FnOnce(&mut Vec<u8>)) {
        let place = self.said.last_axis.unwrap_or(self.given.block.end);
        self.edits.replace(place..place, |to| {
            to.extend_from_slice(separator);
            write(to);
        });
    }
}

impl Corrector<'_> {
    /// Writes the line with other words, without its end.
    pub(in crate::correct) fn write_first(
        &mut self,
        given: &Given<'_>,
        change: &Change<'_>,
    ) -> Result<(), Fault> {
        let wording = self.wording(
            given.block,
            change.piece,
            change.timing,
            Some(change.wanted),
        )?;
        if self.feed_changes(given.block, &wording) {
            self.needs_feed_point(given.block)?;
        }
        let mut line = RewrittenLine {
            given,
            change,
            wording: &wording,
            rules: self.rules,
            said: WordsPresent::default(),
            edits: std::mem::take(&mut self.edits),
        };
        line.edits.clear();
        for word in &given.block.words {
            self.change_word(word, &mut line);
        }
        self.add_words(&mut line);
        let from = self.out.len();
        line.edits.apply(given.line, &mut self.out);
        self.edits = line.edits;
        let comes_back = |word: &Word| word.code(self.rules.dialect) == Some(Code::Threading(331));
        let ends = match given.block.has_codes && given.block.words.iter().any(comes_back) {
            true => self.written.position.at,
            false => wording.words.to,
        };
        self.follow(from, Some(&ends))?;
        self.note(Self::role(change.piece));
        Ok(())
    }

    /// True if the line gets an F that it does not have.
    fn feed_changes(&self, block: &Block, wording: &Wording) -> bool {
        match block.word(b'F') {
            Some(word) => wording
                .feed
                .is_some_and(|feed| !same_feed(feed / self.nominal.feed_unit, word.value)),
            None => self.feed_word(wording).is_some(),
        }
    }

    /// Changes or removes a word of the line.
    fn change_word(&mut self, word: &Word, line: &mut RewrittenLine<'_>) {
        let centre = line.wording.centre.iter().flatten();
        let mut centre = centre
            .enumerate()
            .map(|(place, (letter, value))| (place, *letter, *value));
        if let Some(Code::Motion(was)) = word.code(line.rules.dialect) {
            line.change_motion(word, was);
        } else if let Some(axis) = axes::index(word.letter) {
            line.change_axis(word, axis);
        } else if let Some((place, _, value)) = centre.find(|(_, letter, _)| *letter == word.letter)
        {
            line.said.centre[place] = true;
            line.said.last_axis = Some(word.end);
            let needed = self.options.decimals(0, self.units());
            let decimals = self.kept(word.decimals).max(needed);
            line.replace(word, number::rounded(value, decimals), decimals);
        } else if word.letter == b'P' && line.wording.centre.is_some() {
            line.change_turns(word);
        } else if word.letter == b'E' && self.extrusion.is_some() {
            match self.extruder_word(line.change.piece) {
                Some((value, decimals)) => line.replace(word, value, decimals),
                None => line.edits.remove(line.given.line, word.span()),
            }
        } else if word.letter == b'F' {
            self.change_feed(word, line);
        } else {
            self.leave_out(word, line);
        }
    }

    fn change_feed(&mut self, word: &Word, line: &mut RewrittenLine<'_>) {
        let Some(feed) = line.wording.feed else {
            return;
        };
        line.said.feed = true;
        let feed = feed / self.nominal.feed_unit;
        if !same_feed(feed, word.value) {
            self.report.feeds += 1;
            let point = self.point();
            line.edits
                .replace(word.digits(), |to| number::write_feed(to, feed, point));
        }
    }

    /// Removes a word that the line must not have any more.
    fn leave_out(&mut self, word: &Word, line: &mut RewrittenLine<'_>) {
        let change = line.change;
        let is_normal = line.wording.normal == Some(word.letter);
        if is_normal {
            // A zero along the normal of the plane, which LinuxCNC refuses.
            self.report.zeros_of_centres += 1;
        }
        let goes = is_normal
            || change.without.contains(&word.letter)
            || (change.without_after && is_after(word, line.rules.dialect));
        if goes {
            line.edits.remove(line.given.line, word.span());
        }
    }

    /// Adds what the words of the line do not say.
    fn add_words(&mut self, line: &mut RewrittenLine<'_>) {
        let (block, wording) = (line.given.block, line.wording);
        let words = &wording.words;
        let point = self.point();
        let mut before = line.given.line[..block.end].iter();
        let spaced = block.words.len() < 2 || before.any(|b| matches!(b, b' ' | b'\t'));
        let separator: &[u8] = if spaced { b" " } else { b"" };
        if let (false, Some(motion)) = (line.said.motion, wording.motion)
            && self.written.motion != Some(motion)
        {
            match line.said.first_axis {
                Some(at) => line.edits.replace(at..at, |to| {
                    to.extend_from_slice(motion.word().as_bytes());
                    to.extend_from_slice(separator);
                }),
                None => line.add(separator, |to| {
                    to.extend_from_slice(motion.word().as_bytes())
                }),
            }
        }
        for axis in bits(words.written & !line.said.axes) {
            let decimals = usize::from(words.decimals[axis]);
            let letter = axes::LETTERS[axis];
            line.add(separator, |to| {
                write_word(to, letter, words.value[axis], decimals, point)
            });
        }
        let decimals = self.options.decimals(0, self.units());
        for (k, (letter, value)) in wording.centre.iter().flatten().enumerate() {
            if !line.said.centre[k] {
                line.add(separator, |to| {
                    write_word(to, *letter, *value, decimals, point)
                });
            }
        }
        if wording.turns > 1 && !line.said.turns {
            let turns = f64::from(wording.turns);
            line.add(separator, |to| write_word(to, b'P', turns, 0, false));
        }
        if let (false, Some(feed)) = (line.said.feed, self.feed_word(wording)) {
            self.report.feeds += 1;
            line.add(separator, |to| {
                to.push(b'F');
                number::write_feed(to, feed, point);
            });
        }
    }
}

//! A line of the program with corrected words.

use super::wording::{Wording, replace_number};
use super::{Change, is_after};
use crate::axes;
use crate::codes::Code;
use crate::correct::Corrector;
use crate::correct::feed::same_feed;
use crate::correct::given::Given;
use crate::edit::Edits;
use crate::fault::Fault;
use crate::interpret::bits;
use crate::number;
use crate::words::Word;

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

impl Corrector<'_> {
    /// Writes the line with other words, without its end.
    pub(in crate::correct) fn write_first(
        &mut self,
        given: &Given<'_>,
        change: &Change<'_>,
        out: &mut Vec<u8>,
    ) -> Result<(), Fault> {
        let wording = self.wording(
            given.block,
            change.piece,
            change.timing,
            Some(change.wanted),
        )?;
        let feed_changes = match given.block.word(b'F') {
            Some(word) => wording
                .feed
                .is_some_and(|feed| !same_feed(feed / self.nominal.feed_unit, word.value)),
            None => self.feed_word(&wording).is_some(),
        };
        if feed_changes {
            self.needs_feed_point(given.block)?;
        }
        let mut edits = std::mem::take(&mut self.edits);
        edits.clear();
        let said = self.change_words(given, change, &wording, &mut edits);
        self.add_words(given, &wording, &said, &mut edits);
        let from = out.len();
        edits.apply(given.line, out);
        self.edits = edits;
        let comes_back = |word: &Word| word.code(self.rules.dialect) == Some(Code::Threading(331));
        let ends = match given.block.has_codes && given.block.words.iter().any(comes_back) {
            true => self.written.position.at,
            false => wording.words.to,
        };
        self.follow(&out[from..], Some(&ends))?;
        self.note(Self::role(change.piece));
        Ok(())
    }

    /// Changes or removes the words of the line.
    fn change_words(
        &mut self,
        given: &Given<'_>,
        change: &Change<'_>,
        wording: &Wording,
        edits: &mut Edits,
    ) -> WordsPresent {
        let (rules, words) = (self.rules, &wording.words);
        let mut said = WordsPresent::default();
        for word in &given.block.words {
            if let Some(Code::Motion(was)) = word.code(rules.dialect) {
                if let Some(motion) = wording.motion {
                    said.motion = true;
                    if was != motion {
                        edits.replace(word.span(), |to| {
                            to.extend_from_slice(motion.word().as_bytes())
                        });
                    }
                }
                continue;
            }
            if let Some(axis) = axes::index(word.letter) {
                if (change.gone | words.left_out) & (1 << axis) != 0 {
                    edits.remove(given.line, word.span());
                } else if words.written & (1 << axis) != 0 {
                    said.axes |= 1 << axis;
                    said.first_axis = said.first_axis.or(Some(word.start));
                    said.last_axis = Some(word.end);
                    let decimals = usize::from(words.decimals[axis]);
                    replace_number(edits, rules, word, words.value[axis], decimals);
                }
                continue;
            }
            if let Some(centre) = &wording.centre
                && let Some(place) = centre.iter().position(|(letter, _)| *letter == word.letter)
            {
                said.centre[place] = true;
                said.last_axis = Some(word.end);
                let needed = self.options.decimals(0, self.units());
                let decimals = self.kept(word.decimals).max(needed);
                let value = number::rounded(centre[place].1, decimals);
                replace_number(edits, rules, word, value, decimals);
                continue;
            }
            if word.letter == b'P' && wording.centre.is_some() {
                said.turns = true;
                if rules.dialect.table().printer && words.written & 0b11 != 0 {
                    // No full circle any more.
                    edits.remove(given.line, word.span());
                } else if word.value.max(1.0) != f64::from(wording.turns) {
                    match wording.turns {
                        1 => edits.remove(given.line, word.span()),
                        turns => edits.replace(word.digits(), |to| {
                            number::write(to, f64::from(turns), 0, 0, false);
                        }),
                    }
                }
                continue;
            }
            if word.letter == b'E' && self.extrusion.is_some() {
                match self.extruder_word(change.piece) {
                    Some((value, decimals)) => {
                        replace_number(edits, rules, word, value, decimals);
                    }
                    None => edits.remove(given.line, word.span()),
                }
                continue;
            }
            if word.letter == b'F' {
                if let Some(feed) = wording.feed {
                    said.feed = true;
                    let feed = feed / self.nominal.feed_unit;
                    if !same_feed(feed, word.value) {
                        self.report.feeds += 1;
                        let point = self.point();
                        edits.replace(word.digits(), |to| number::write_feed(to, feed, point));
                    }
                }
                continue;
            }
            let is_normal = wording.normal == Some(word.letter);
            if is_normal {
                // A zero along the normal of the plane, which LinuxCNC refuses.
                self.report.zeros_of_centres += 1;
            }
            let goes = is_normal
                || change.without.contains(&word.letter)
                || (change.without_after && is_after(word, rules.dialect));
            if goes {
                edits.remove(given.line, word.span());
            }
        }
        said
    }

    /// Adds what the words of the line do not say.
    fn add_words(
        &mut self,
        given: &Given<'_>,
        wording: &Wording,
        said: &WordsPresent,
        edits: &mut Edits,
    ) {
        let (block, words) = (given.block, &wording.words);
        let point = self.point();
        let mut before = given.line[..block.end].iter();
        let spaced = block.words.len() < 2 || before.any(|b| matches!(b, b' ' | b'\t'));
        let separator: &[u8] = if spaced { b" " } else { b"" };
        let place = said.last_axis.unwrap_or(block.end);
        if let (false, Some(motion)) = (said.motion, wording.motion)
            && self.written.motion != Some(motion)
        {
            match said.first_axis {
                Some(at) => edits.replace(at..at, |to| {
                    to.extend_from_slice(motion.word().as_bytes());
                    to.extend_from_slice(separator);
                }),
                None => edits.replace(place..place, |to| {
                    to.extend_from_slice(separator);
                    to.extend_from_slice(motion.word().as_bytes());
                }),
            }
        }
        for axis in bits(words.written & !said.axes) {
            edits.replace(place..place, |to| {
                to.extend_from_slice(separator);
                to.push(axes::LETTERS[axis]);
                let decimals = usize::from(words.decimals[axis]);
                number::write(to, words.value[axis], decimals, 0, point);
            });
        }
        for (k, (letter, value)) in wording.centre.iter().flatten().enumerate() {
            if !said.centre[k] {
                edits.replace(place..place, |to| {
                    to.extend_from_slice(separator);
                    to.push(*letter);
                    number::write(to, *value, self.options.decimals(0, self.units()), 0, point);
                });
            }
        }
        if wording.turns > 1 && !said.turns {
            edits.replace(place..place, |to| {
                to.extend_from_slice(separator);
                to.push(b'P');
                number::write(to, f64::from(wording.turns), 0, 0, false);
            });
        }
        if let (false, Some(feed)) = (said.feed, self.feed_word(wording)) {
            self.report.feeds += 1;
            edits.replace(place..place, |to| {
                to.extend_from_slice(separator);
                to.push(b'F');
                number::write_feed(to, feed, point);
            });
        }
    }
}

//! Lines inserted where a motion is split.

use super::wording::{Wording, write_word};
use crate::axes;
use crate::correct::Corrector;
use crate::correct::given::Given;
use crate::correct::piece::{Piece, Timing};
use crate::fault::Fault;
use crate::interpret::bits;
use crate::number;
use crate::words::Block;

impl Corrector<'_> {
    /// Writes a further line, unless it would move nothing.
    pub(in crate::correct) fn write_next(
        &mut self,
        given: &Given<'_>,
        piece: &Piece,
        timing: &Timing,
    ) -> Result<(), Fault> {
        let wording = self.wording(given.block, piece, timing, None)?;
        let words = &wording.words;
        let extruded = self.extruder_word(piece);
        if !words.moves && wording.centre.is_none() && extruded.is_none() {
            return Ok(());
        }
        let point = self.point();
        let mut text = std::mem::take(&mut self.out);
        let from = text.len();
        self.begin_inserted(given.block, &wording, &mut text);
        let mut add = |letter: u8, value: f64, decimals: usize, point: bool| {
            write_word(&mut text, letter, value, decimals, point);
            text.push(b' ');
        };
        for axis in bits(words.written) {
            let decimals = usize::from(words.decimals[axis]);
            add(axes::LETTERS[axis], words.value[axis], decimals, point);
        }
        for (letter, value) in wording.centre.iter().flatten() {
            add(
                *letter,
                *value,
                self.options.decimals(0, self.units()),
                point,
            );
        }
        if wording.turns > 1 {
            add(b'P', f64::from(wording.turns), 0, false);
        }
        if let Some((value, decimals)) = extruded {
            add(b'E', value, decimals, point);
        }
        if let Some(feed) = self.feed_word(&wording) {
            self.needs_feed_point(given.block)?;
            self.report.feeds += 1;
            text.push(b'F');
            number::write_feed(&mut text, feed, point);
            text.push(b' ');
        }
        while text.last() == Some(&b' ') {
            text.pop();
        }
        self.out = text;
        self.follow(from, Some(&words.to))?;
        self.end_line(given.eol, Self::role(piece));
        Ok(())
    }

    /// What stands before the words of axes of an inserted line.
    fn begin_inserted(&self, block: &Block, wording: &Wording, text: &mut Vec<u8>) {
        if block.deleted {
            text.push(b'/');
        }
        self.sub_number(block, text);
        if wording.machine {
            text.extend_from_slice(b"G53 ");
        }
        if let Some(motion) = wording.motion
            && (self.written.motion != Some(motion) || self.rules.dialect.table().printer)
        {
            text.extend_from_slice(motion.word().as_bytes());
            text.push(b' ');
        }
    }

    /// The number of an inserted line, if it gets one.
    fn sub_number(&self, block: &Block, text: &mut Vec<u8>) {
        let Some(word) = block.word(b'N').filter(|_| self.options.sub_numbers) else {
            return;
        };
        let inserted = self.lines.iter().rev().position(|entry| entry.begins);
        let number = inserted.map_or(1, |before| before + 1);
        text.extend_from_slice(format!("N{}.{number} ", word.value).as_bytes());
    }
}

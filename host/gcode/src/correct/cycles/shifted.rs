//! A cycle that stays one: its words shifted.

use super::Hole;
use crate::axes::{self, PerLetter};
use crate::codes::Code;
use crate::correct::Corrector;
use crate::correct::given::Given;
use crate::correct::piece::{Piece, Shape, Timing};
use crate::correct::write::replace_number;
use crate::cycle::Cycle;
use crate::edit::Edits;
use crate::fault::Fault;
use crate::line_map::Role;
use crate::modal::{Distance, Motion};
use crate::moves::{Move, Rate};
use crate::number;
use crate::words::{Block, Word};

/// Decimals of words that are as they were: F, P, Q.
const MOST_DECIMALS: usize = 9;

/// A word of a hole: letter, value in units of the program, decimals.
type Needed = (u8, f64, usize);

impl Corrector<'_> {
    /// The cycle with corrected words, in a line for each hole whose correction is another.
    pub(super) fn shifted(
        &mut self,
        given: &Given<'_>,
        cycle: &Cycle,
        holes: &[Hole],
    ) -> Result<(), Fault> {
        let limits = self.limits();
        let added = |hole: &Hole| -> PerLetter {
            std::array::from_fn(|i| hole.bottom.to[i] - hole.bottom.q[i])
        };
        let first = added(&holes[0]);
        let is_same = |hole: &Hole| {
            let by = added(hole);
            limits.of(&std::array::from_fn(|i| by[i] - first[i])) <= 1.0
        };
        if holes.iter().all(is_same) {
            return self.line_of_cycle(given, cycle, &holes[0], cycle.repeat, true);
        }
        let with_end = self.with_end(given);
        for (number, hole) in holes.iter().enumerate() {
            self.line_of_cycle(&with_end, cycle, hole, 1, number == 0)?;
        }
        Ok(())
    }

    /// A line with a hole, or with the first one of so many.
    fn line_of_cycle(
        &mut self,
        given: &Given<'_>,
        cycle: &Cycle,
        hole: &Hole,
        repeat: u32,
        is_first: bool,
    ) -> Result<(), Fault> {
        // A line before it ends the series for the controller: all words are written anew.
        let moves = self.outside_first(given, cycle, hole)?;
        let words = self.words_of_hole(given.block, cycle, hole);
        let mut edits = std::mem::take(&mut self.edits);
        edits.clear();
        let from = self.out.len();
        match is_first {
            true => {
                self.change_cycle(given, cycle, &words, repeat, moves, &mut edits);
                edits.apply(given.line, &mut self.out);
            }
            false => self.further_hole(given, cycle, &words, moves),
        }
        self.edits = edits;
        let step = self.follow(from, None)?;
        self.out.extend_from_slice(given.eol);
        let done = f64::from(cycle.repeat.min(repeat));
        let until = match is_first {
            true => done,
            false => self.progress() + 1.0,
        };
        self.note(Role::Until(until));
        match &step.motion {
            Some(Move::Cycle(written)) if self.is_meant(written, cycle, hole) => Ok(()),
            _ => Err(Fault::new(
                0..given.block.end,
                "what would be written is wrong",
                "this is a mistake of trueaxis: please report the line",
            )),
        }
    }

    /// True if what the controller makes of a line is the hole that was meant.
    fn is_meant(&self, written: &Cycle, cycle: &Cycle, hole: &Hole) -> bool {
        let last = self.options.resolutions();
        let near = |axis: usize, a: f64, b: f64| (a - b).abs() <= 2.0 * last[axis];
        let [i, j, n] = cycle.axes;
        let by = hole.bottom.to[n] - hole.bottom.q[n];
        [i, j]
            .iter()
            .all(|axis| near(*axis, written.first[*axis], hole.bottom.to[*axis]))
            && near(n, written.bottom, hole.bottom.to[n])
            && near(n, written.r, cycle.r + by)
    }

    /// Rotary axes and others outside the plane go to the hole in a line before; true if there is one.
    fn outside_first(
        &mut self,
        given: &Given<'_>,
        cycle: &Cycle,
        hole: &Hole,
    ) -> Result<bool, Fault> {
        let Some(before) = self.outside(cycle, hole) else {
            return Ok(false);
        };
        // Modes and offsets of the line do not hold before it.
        let had_modes = self
            .before_modes
            .take()
            .map(|written| self.written = written);
        let piece = Piece {
            share: None,
            ..Piece::whole(Shape::Rapid, before)
        };
        let timing = Timing {
            rate: Rate::Rapid,
            minutes: 0.0,
            turns: false,
        };
        let motion = self.nominal.motion.replace(Motion::Rapid);
        let distance = std::mem::replace(&mut self.nominal.distance, self.written.distance);
        let done = self.write_next(&self.with_end(given), &piece, &timing);
        self.nominal.motion = motion;
        self.nominal.distance = distance;
        done?;
        if had_modes.is_some() {
            self.modes_first(given.block)?;
        }
        Ok(true)
    }

    /// The words of a hole: its place in the plane, its bottom, and R.
    fn words_of_hole(&self, block: &Block, cycle: &Cycle, hole: &Hole) -> [Needed; 4] {
        let (unit, units) = (self.unit(), self.units());
        let n = cycle.axes[2];
        let at_r = cycle.r + hole.bottom.to[n] - hole.bottom.q[n];
        let offsets = &self.written.offsets;
        let bottom = offsets.program(&hole.bottom.to);
        let here = offsets.program(&self.written.position.at);
        let initial = self.written.cycle.map(|series| series.initial);
        let relative = self.nominal.distance == Some(Distance::Incremental);
        let decimals = |axis: usize| self.options.decimals(axis, units);
        let word = |axis: usize, value: f64| (axes::LETTERS[axis], value / unit, decimals(axis));
        let [first, second] = [cycle.axes[0], cycle.axes[1]].map(|axis| {
            let from = if relative { here[axis] } else { 0.0 };
            word(axis, bottom[axis] - from)
        });
        let said = [b'R', axes::LETTERS[n]].map(|letter| {
            let said = block.word(letter);
            said.map_or(0, |word| self.kept(word.decimals))
        });
        let digits = decimals(n).max(said[0]).max(said[1]);
        // From the level before the series to R, and from there to the bottom, or both from zero.
        let from = match (relative, initial) {
            (false, _) => self.written.offsets.machine_axis(n, 0.0),
            (true, Some(initial)) => initial,
            (true, None) => self.written.position.at[n],
        };
        let r = number::rounded((at_r - from) / unit, digits);
        // Not deeper than it was, or the last digit would be a peck of its own.
        let top = if relative { 0.0 } else { r };
        let depth = number::up(top - (cycle.r - cycle.bottom) / unit, digits);
        [
            first,
            second,
            (axes::LETTERS[n], depth, digits),
            (b'R', r, digits),
        ]
    }

    /// Changes the words of the line, and adds those that it lacks; `anew`: also those that stay from the cycle
    /// before.
    fn change_cycle(
        &self,
        given: &Given<'_>,
        cycle: &Cycle,
        needed: &[Needed; 4],
        repeat: u32,
        anew: bool,
        edits: &mut Edits,
    ) {
        let block = given.block;
        let mut place = block.end;
        let mut done = [false; 4];
        for word in &block.words {
            if let Some(k) = needed
                .iter()
                .position(|(letter, ..)| *letter == word.letter)
            {
                done[k] = true;
                place = word.end;
                let (_, value, decimals) = needed[k];
                let decimals = decimals.max(self.kept(word.decimals));
                let value = number::rounded(value, decimals);
                replace_number(edits, self.rules, word, value, decimals);
            }
            if matches!(word.letter, b'L' | b'K') && repeat != cycle.repeat {
                edits.remove(given.line, word.span());
            }
        }
        let missing = needed.iter().zip(done).filter(|(_, done)| !done);
        let missing: Vec<Needed> = missing.map(|(needed, _)| *needed).collect();
        let mut text = Vec::new();
        self.words_of_series(Some(block), cycle, &missing, anew, &mut text);
        edits.replace(place..place, |to| to.extend_from_slice(&text));
    }

    /// A line of its own for another hole of the same line.
    fn further_hole(&mut self, given: &Given<'_>, cycle: &Cycle, needed: &[Needed; 4], anew: bool) {
        let mut text = Vec::new();
        self.words_of_series(None, cycle, needed, anew, &mut text);
        if given.block.deleted {
            self.out.push(b'/');
        }
        self.out.extend_from_slice(text.trim_ascii_start());
    }

    /// Words of a hole, and those that neither its line nor its series says yet, each after a space.
    fn words_of_series(
        &self,
        line: Option<&Block>,
        cycle: &Cycle,
        needed: &[Needed],
        anew: bool,
        text: &mut Vec<u8>,
    ) {
        let dialect = self.rules.dialect;
        let point = self.point();
        let is_cycle = |word: &Word| {
            let code = word.code(dialect);
            matches!(code, Some(Code::Motion(Motion::Cycle(_))))
        };
        let says = |letter: u8| line.is_some_and(|line| line.word(letter).is_some());
        let mut add = |letter: u8, value: f64, decimals: usize, point: bool| {
            text.extend_from_slice(&[b' ', letter]);
            number::write(text, value, decimals, 0, point);
        };
        let series = self.written.cycle.filter(|c| c.code == cycle.code && !anew);
        for (letter, value, decimals) in needed {
            add(*letter, *value, *decimals, point);
        }
        let q = cycle.q.map(|q| q / self.unit());
        let before = series.and_then(|c| c.q).map(|q| q / self.unit());
        if let (false, Some(q)) = (says(b'Q'), q)
            && before.is_none_or(|before| (q - before).abs() > 1e-9)
        {
            add(b'Q', q, MOST_DECIMALS, point);
        }
        if let (false, Some(p), None) = (says(b'P'), cycle.p, series) {
            add(b'P', p.value, 6, p.point);
        }
        if let Some(feed) = self.nominal.feed
            && !says(b'F')
            && self.written.feed != Some(feed)
        {
            add(b'F', feed, 6, point);
        }
        let motion = Motion::Cycle(cycle.code);
        let has_word = line.is_some_and(|line| line.words.iter().any(is_cycle));
        if !has_word && self.written.motion != Some(motion) {
            text.push(b' ');
            text.extend_from_slice(motion.word().as_bytes());
        }
    }
}

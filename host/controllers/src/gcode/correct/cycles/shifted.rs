//! A cycle that stays one, with corrected words.

use crate::gcode::axes::{self, PerLetter};
use crate::gcode::codes::{self, Code};
use crate::gcode::correct::Corrector;
use crate::gcode::correct::given::{Given, Moving};
use crate::gcode::correct::piece::{Piece, Shape, Timing};
use crate::gcode::cycle::Cycle;
use crate::gcode::dialect::Dialect;
use crate::gcode::edit::Edits;
use crate::gcode::fault::Fault;
use crate::gcode::modal::{Motion, Retract};
use crate::gcode::number;
use crate::gcode::words::Word;

/// A word that a cycle needs: letter, value in units of the program, decimals.
type Needed = (u8, f64, usize);

/// How far pecks may end from where their corrections lead, in parts of the tolerance.
const PECKS: f64 = 0.25;
/// What the last digits of words may make (mm).
const WORDS: f64 = 1e-3;
/// Most decimals of Q.
const MOST_DECIMALS: usize = 9;

/// The words of a cycle.
struct Words {
    /// Of the hole, its depth and R.
    place: [Needed; 4],
    /// Q (units of the program), if it has to be another one.
    q: Option<f64>,
}

impl Corrector<'_> {
    /// The cycle with corrected words.
    pub(super) fn shifted(
        &mut self,
        given: &Given<'_>,
        cycle: &Cycle,
        moving: &Moving,
        out: &mut Vec<u8>,
    ) -> Result<(), Fault> {
        let field = self.field();
        let n = cycle.axes[2];
        let mut hole = cycle.first;
        hole[n] = cycle.bottom;
        if self.axes_turn() {
            self.ways.come_to(self.tables, &hole);
        }
        if let Some(axis) = self.ways.missing(self.tables) {
            return Err(moving.direction_unknown(axis));
        }
        let at = |height: f64| self.in_hole(&field, cycle, height);
        let (node, top) = (at(cycle.bottom), at(cycle.r));
        let node = node.map_err(|lost| moving.lost(lost))?;
        let top = top.map_err(|lost| moving.lost(lost))?;
        self.corrected(&node);
        // A line before it ends the series for the controller: all words are written anew.
        let moves = self.outside_first(given, cycle, &node.to, out)?;
        let by = top.to[n] - top.q[n];
        let mut edits = std::mem::take(&mut self.edits);
        edits.clear();
        let words = self.words_of_cycle(cycle, &node.to, by);
        self.cycle_words(given, cycle, &words, moves, &mut edits);
        let from = out.len();
        edits.apply(given.line, out);
        self.edits = edits;
        self.follow(&out[from..], None)?;
        out.extend_from_slice(given.eol);
        let mut end = node.to;
        end[n] = match (self.written.cycle, cycle.retract) {
            (Some(written), Retract::Initial) => written.initial.max(cycle.r + by),
            _ => cycle.r + by,
        };
        let at = &self.written.position.at;
        let is_there = cycle.axes.iter().all(|i| (at[*i] - end[*i]).abs() < WORDS);
        let is_deep = self.written.cycle.is_some_and(|written| {
            let [r, depth] = [written.r, written.depth].map(|word| written.frame.zero + word);
            (r - (cycle.r + by)).abs() < WORDS && (depth - node.to[n]).abs() < WORDS
        });
        if is_there && is_deep {
            return Ok(());
        }
        Err(Fault::new(
            moving.span.clone(),
            "what would be written is wrong",
            "this is a mistake of trueaxis: please report the line",
        ))
    }

    /// Rotary axes and others outside the plane go to the hole in a line before; true if there is one.
    fn outside_first(
        &mut self,
        given: &Given<'_>,
        cycle: &Cycle,
        to: &PerLetter,
        out: &mut Vec<u8>,
    ) -> Result<bool, Fault> {
        let Some(before) = self.outside(cycle, to) else {
            return Ok(false);
        };
        // Modes and offsets of the line do not hold before it.
        if let Some(written) = self.before_modes.take() {
            self.written = written;
        }
        let piece = Piece::of(Shape::Rapid, before, Timing::None);
        let motion = self.nominal.motion.replace(Motion::Rapid);
        let distance = std::mem::replace(&mut self.nominal.distance, self.written.distance);
        let done = self.write_next(&self.with_end(given), &piece, out);
        self.nominal.motion = motion;
        self.nominal.distance = distance;
        done?;
        self.modes_first(given.block)?;
        Ok(true)
    }

    /// The words of the hole, of R and of Q; `by` is the correction of the normal axis at R.
    fn words_of_cycle(&self, cycle: &Cycle, hole: &PerLetter, by: f64) -> Words {
        let (unit, units) = (self.unit(), self.units());
        let n = cycle.axes[2];
        let offsets = &self.written.offsets;
        let program = offsets.program(hole);
        let mut at_r = *hole;
        at_r[n] = cycle.r + by;
        let word = |axis: usize| {
            let decimals = number::decimals(axis, units);
            (axes::LETTERS[axis], program[axis] / unit, decimals)
        };
        let [first, second, normal] = cycle.axes.map(word);
        let r = offsets.program(&at_r)[n] / unit;
        let decimals = number::decimals(n, units);
        let depth = number::rounded(r, decimals) - number::rounded(normal.1, decimals);
        let tolerance = PECKS * self.options.tolerance;
        let q = cycle.peck_for(depth * unit, tolerance);
        let q = q.filter(|(q, _)| cycle.q.is_none_or(|before| (q - before).abs() > 1e-9));
        let q = q.map(|(q, pecks)| {
            let fine = |decimals: &usize| pecks * number::finest(*decimals) * unit <= tolerance;
            above(
                q / unit,
                (decimals..MOST_DECIMALS)
                    .find(fine)
                    .unwrap_or(MOST_DECIMALS),
            )
        });
        Words {
            place: [first, second, normal, (b'R', r, decimals)],
            q,
        }
    }

    /// Changes the words of the line, and adds those that it lacks; `anew`: also those that stay from the cycle
    /// before.
    fn cycle_words(
        &self,
        given: &Given<'_>,
        cycle: &Cycle,
        words: &Words,
        anew: bool,
        edits: &mut Edits,
    ) {
        let block = given.block;
        let needed = &words.place;
        let point = self.rules.dialect == Dialect::Fanuc;
        let mut place = block.end;
        let mut done = [false; 4];
        for word in &block.words {
            let same = |(letter, ..): &Needed| *letter == word.letter;
            if let (b'Q', Some(q)) = (word.letter, words.q) {
                edits.replace(word.number..word.end, |to| {
                    number::write(to, q, MOST_DECIMALS, 0, point)
                });
            }
            if let Some(k) = needed.iter().position(same) {
                done[k] = true;
                place = word.end;
                let (_, value, decimals) = needed[k];
                let decimals = decimals.max(word.decimals).min(9);
                edits.replace(word.number..word.end, |to| {
                    number::write(to, value, decimals, word.decimals.min(decimals), point)
                });
            }
        }
        let mut add = |letter: u8, value: f64, decimals: usize, point: bool| {
            edits.replace(place..place, |to| {
                to.extend_from_slice(&[b' ', letter]);
                number::write(to, value, decimals, 0, point);
            });
        };
        for ((letter, value, decimals), done) in needed.iter().zip(done) {
            if !done {
                add(*letter, *value, *decimals, point);
            }
        }
        let lacks = |letter: u8| block.word(letter).is_none();
        let series = self.written.cycle.filter(|c| c.code == cycle.code && !anew);
        let q = words.q.or(cycle.q.map(|q| q / self.unit()));
        let before = series.and_then(|c| c.q).map(|q| q / self.unit());
        if let (true, Some(q)) = (lacks(b'Q'), q)
            && before.is_none_or(|before| (q - before).abs() > 1e-9)
        {
            add(b'Q', q, MOST_DECIMALS, point);
        }
        if let (true, Some(p), None) = (lacks(b'P'), cycle.p, series) {
            add(b'P', p.value, 6, p.point);
        }
        if let Some(feed) = self.nominal.feed
            && lacks(b'F')
            && self.written.feed != Some(feed)
        {
            add(b'F', feed, 6, point);
        }
        let is_cycle = |word: &Word| {
            let code = codes::code(word, self.rules.dialect);
            matches!(code, Some(Code::Motion(Motion::Cycle(_))))
        };
        let motion = Motion::Cycle(cycle.code);
        if !block.words.iter().any(is_cycle) && self.written.motion != Some(motion) {
            edits.replace(place..place, |to| {
                to.push(b' ');
                to.extend_from_slice(motion.word().as_bytes());
            });
        }
    }
}

/// A number with so many decimals that is not less.
fn above(value: f64, decimals: usize) -> f64 {
    number::rounded(value + 0.5 * 10_f64.powi(-(decimals as i32)), decimals)
}

//! Pieces as lines: the line of the program with its words changed, and further ones.

use super::Corrector;
use super::piece::{Piece, Shape, Timing};
use crate::gcode::arc::Arc;
use crate::gcode::axes::{self, COUNT, PerLetter, is_rotary};
use crate::gcode::codes::{self, Code, Machine};
use crate::gcode::dialect::Dialect;
use crate::gcode::fault::Fault;
use crate::gcode::interpret::{Step, bits};
use crate::gcode::modal::{Distance, Motion, Units};
use crate::gcode::moves::Rate;
use crate::gcode::number;
use crate::gcode::words::{Block, Word};

/// Words of axes of a line that is written.
struct Words {
    /// Value in units of the program, of each axis that is written.
    value: [Option<f64>; COUNT],
    decimals: [usize; COUNT],
    /// Where the rounded words lead.
    to: PerLetter,
    /// True if they lead anywhere else than where it is.
    moves: bool,
}

/// How a line is changed.
pub(super) struct Change<'p> {
    pub piece: &'p Piece,
    /// Axes that have to be written, whatever they are.
    pub wanted: u16,
    /// Words of the program's axes go, rather than staying with other values.
    pub fresh: bool,
    /// Letters that go.
    pub without: &'p [u8],
    /// True if words behind the motion go too, for they are written later.
    pub without_after: bool,
}

fn round(value: f64, decimals: usize) -> f64 {
    let power = 10_f64.powi(decimals as i32);
    (value * power).round() / power
}

impl Corrector<'_> {
    fn units(&self) -> Units {
        self.nominal.units.unwrap_or(Units::Millimetre)
    }

    /// Decimals of an axis in this line.
    fn decimals(&mut self, block: &Block, axis: usize) -> usize {
        let needed = number::decimals(axis, self.units());
        let word = block.word(axes::LETTERS[axis]);
        if let Some(word) = word {
            self.report.decimals[0] = self.report.decimals[0].max(word.decimals);
        }
        let decimals = word.map_or(0, |w| w.decimals).max(needed).min(9);
        self.report.decimals[1] = self.report.decimals[1].max(decimals);
        decimals
    }

    /// The words that lead to a position.
    fn words(&mut self, block: &Block, to: &PerLetter, wanted: u16, machine: bool) -> Words {
        let unit = self.unit();
        let relative = !machine && self.nominal.distance == Some(Distance::Incremental);
        let at = self.written.position;
        let (target, here) = if machine {
            (*to, at.at)
        } else {
            (
                self.written.offsets.program(to),
                self.written.offsets.program(&at.at),
            )
        };
        let mut words = Words {
            value: [None; COUNT],
            decimals: [0; COUNT],
            to: at.at,
            moves: false,
        };
        let mut program = here;
        for axis in bits(self.tables.axes) {
            let unit = if is_rotary(axis) { 1.0 } else { unit };
            let decimals = self.decimals(block, axis);
            let by = (target[axis] - here[axis]) / unit;
            let value = if relative { by } else { target[axis] / unit };
            let rounded = round(value, decimals);
            let finest = 0.6 * 10_f64.powi(-(decimals as i32));
            let known = at.knows(axis);
            if wanted & (1 << axis) == 0 && known && by.abs() < finest {
                continue;
            }
            words.value[axis] = Some(rounded);
            words.decimals[axis] = decimals;
            program[axis] = if relative {
                here[axis] + rounded * unit
            } else {
                rounded * unit
            };
            words.moves |= !known || by.abs() >= finest;
        }
        words.to = if machine {
            program
        } else if self.written.offsets.is_turned() {
            self.written.offsets.machine(&program)
        } else {
            let mut to = at.at;
            for axis in bits(self.tables.axes) {
                if words.value[axis].is_some() {
                    to[axis] = self.written.offsets.machine_axis(axis, program[axis]);
                }
            }
            to
        };
        words
    }

    /// The F of a piece: what must hold while it moves.
    fn feed(&self, piece: &Piece, to: &PerLetter) -> Option<f64> {
        let by: PerLetter = std::array::from_fn(|i| {
            let by = to[i] - self.written.position.at[i];
            // Rounding in the last place of f64 is no motion.
            if by.abs() < 1e-9 { 0.0 } else { by }
        });
        let by = self.in_program(&by);
        match piece.timing {
            Timing::None => None,
            Timing::TakeUp => match piece.feed? {
                Rate::Rapid => None,
                Rate::PerMinute(f) | Rate::PerRevolution(f) => Some(f),
                // A twentieth of a second, for a few µm.
                Rate::Inverse(_) => Some(1200.0),
            },
            Timing::Part {
                rate,
                minutes,
                share,
                turns,
            } => match rate {
                Rate::Rapid => None,
                Rate::Inverse(f) => Some(if share >= 1.0 - 1e-9 { f } else { f / share }),
                Rate::PerMinute(f) | Rate::PerRevolution(f) => {
                    let length = match piece.shape {
                        Shape::Arc(arc) => arc.length() / self.unit(),
                        _ => self.rules.dialect.length(&by),
                    };
                    let needed = length / (minutes * share);
                    let turns = turns || (3..6).any(|i| by[i] != 0.0);
                    let allowed = if turns { 1e-4 } else { 0.01 };
                    let same = (needed / f - 1.0).abs() <= allowed;
                    Some(if same || !needed.is_finite() || needed <= 0.0 {
                        f
                    } else {
                        needed
                    })
                }
            },
        }
    }

    /// All pieces of a motion: the first one in its line, the others behind it.
    pub(super) fn write_all(
        &mut self,
        block: &Block,
        step: &Step,
        pieces: &[Piece],
        line: &[u8],
        eol: &[u8],
        out: &mut Vec<u8>,
    ) -> Result<(), Fault> {
        let several = pieces.len() > 1;
        let mut wanted = 0;
        for word in &block.words {
            if let Some(axis) = axes::index(word.letter) {
                wanted |= 1 << axis;
            }
        }
        let machine = is_machine(block, self.rules.dialect);
        let without: &[u8] = match pieces[0].shape {
            Shape::Arc(_) if several => b"RP",
            Shape::Arc(_) => b"R",
            _ => b"IJKR",
        };
        let is_arc = matches!(
            self.nominal.motion,
            Some(Motion::Clockwise | Motion::Counterclockwise)
        );
        let change = Change {
            piece: &pieces[0],
            wanted,
            fresh: false,
            without: if is_arc { without } else { b"" },
            without_after: several && step.after,
        };
        let chords = is_arc && !matches!(pieces[0].shape, Shape::Arc(_));
        let change = match chords {
            true => Change {
                without: b"IJKRP",
                ..change
            },
            false => change,
        };
        self.write_first(block, &change, machine, line, out)?;
        let eol = if several && eol.is_empty() {
            self.eol
        } else {
            eol
        };
        out.extend_from_slice(eol);
        for piece in &pieces[1..] {
            self.write_next(block, piece, machine, eol, out)?;
        }
        if several && step.after {
            self.write_after(block, line, eol, out)?;
        }
        Ok(())
    }

    /// The line of the program with other words.
    pub(super) fn write_first(
        &mut self,
        block: &Block,
        change: &Change<'_>,
        machine: bool,
        line: &[u8],
        out: &mut Vec<u8>,
    ) -> Result<(), Fault> {
        let piece = change.piece;
        let words = self.words(block, &piece.to, change.wanted, machine);
        let feed = self.feed(piece, &words.to);
        let motion = self.motion_word(piece);
        let point = self.rules.dialect == Dialect::Fanuc;
        let arc = match piece.shape {
            Shape::Arc(arc) => Some(self.centre_words(&arc)),
            _ => None,
        };
        let dialect = self.rules.dialect;
        let mut edits = std::mem::take(&mut self.edits);
        edits.clear();
        let mut done_axes = 0_u16;
        let mut done_arc = [false; 2];
        let (mut done_feed, mut done_motion) = (feed.is_none(), motion.is_none());
        let mut last_axis = None;
        let mut first_axis = None;
        let inverse = matches!(piece.feed, Some(Rate::Inverse(_)));
        for word in &block.words {
            if word.letter == b'G'
                && let Some(Code::Motion(was)) = word.tenths().and_then(|t| codes::g(t, dialect))
            {
                if let Some(motion) = motion {
                    done_motion = true;
                    if was != motion {
                        edits.replace(word.span(), |to| {
                            to.extend_from_slice(motion.word().as_bytes())
                        });
                    }
                }
                continue;
            }
            if let Some(axis) = axes::index(word.letter) {
                if change.fresh {
                    edits.remove(line, word.span());
                } else if let Some(value) = words.value[axis] {
                    done_axes |= 1 << axis;
                    first_axis = first_axis.or(Some(word.start));
                    last_axis = Some(word.end);
                    replace_number(
                        &mut edits,
                        word,
                        value,
                        words.decimals[axis],
                        point,
                        self.rules.least_increments,
                    );
                }
                continue;
            }
            if let Some(centre) = &arc
                && let Some(place) = centre.iter().position(|(letter, _)| *letter == word.letter)
            {
                done_arc[place] = true;
                last_axis = Some(word.end);
                let decimals = word.decimals.max(number::decimals(0, self.units()));
                let value = round(centre[place].1, decimals);
                replace_number(
                    &mut edits,
                    word,
                    value,
                    decimals,
                    point,
                    self.rules.least_increments,
                );
                continue;
            }
            if word.letter == b'F' {
                if let Some(feed) = feed {
                    done_feed = true;
                    if !same_feed(feed, word.value) {
                        self.report.feeds += 1;
                        edits.replace(word.number..word.end, |to| {
                            number::write_feed(to, feed, point)
                        });
                    }
                }
                continue;
            }
            let goes = change.without.contains(&word.letter)
                || (change.without_after && is_after(word, dialect));
            if goes {
                edits.remove(line, word.span());
            }
        }
        let spaced =
            block.words.len() < 2 || line[..block.end].iter().any(|b| matches!(b, b' ' | b'\t'));
        let separator: &[u8] = if spaced { b" " } else { b"" };
        let place = last_axis.unwrap_or(block.end);
        if let (false, Some(motion)) = (done_motion, motion)
            && self.written.motion != Some(motion)
        {
            match first_axis {
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
        for axis in 0..COUNT {
            if let Some(value) = words.value[axis]
                && done_axes & (1 << axis) == 0
            {
                edits.replace(place..place, |to| {
                    to.extend_from_slice(separator);
                    to.push(axes::LETTERS[axis]);
                    number::write(to, value, words.decimals[axis], 0, point);
                });
            }
        }
        if let Some(centre) = &arc {
            for (k, (letter, value)) in centre.iter().enumerate() {
                if !done_arc[k] {
                    edits.replace(place..place, |to| {
                        to.extend_from_slice(separator);
                        to.push(*letter);
                        number::write(to, *value, number::decimals(0, self.units()), 0, point);
                    });
                }
            }
        }
        if let (false, Some(feed)) = (done_feed, feed)
            && (inverse || !self.written.feed.is_some_and(|f| same_feed(feed, f)))
        {
            self.report.feeds += 1;
            edits.replace(place..place, |to| {
                to.extend_from_slice(separator);
                to.push(b'F');
                number::write_feed(to, feed, point);
            });
        }
        let from = out.len();
        edits.apply(line, out);
        self.edits = edits;
        self.follow(&out[from..], Some(&words.to))
    }

    /// A further line.
    pub(super) fn write_next(
        &mut self,
        block: &Block,
        piece: &Piece,
        machine: bool,
        eol: &[u8],
        out: &mut Vec<u8>,
    ) -> Result<(), Fault> {
        let words = self.words(block, &piece.to, 0, machine);
        if !words.moves && !matches!(piece.shape, Shape::Arc(_)) {
            return Ok(());
        }
        let point = self.rules.dialect == Dialect::Fanuc;
        let feed = self.feed(piece, &words.to);
        let mut text = std::mem::take(&mut self.text);
        text.clear();
        if block.deleted {
            text.push(b'/');
        }
        if machine {
            text.extend_from_slice(b"G53 ");
        }
        if let Some(motion) = self.motion_word(piece)
            && self.written.motion != Some(motion)
        {
            text.extend_from_slice(motion.word().as_bytes());
            text.push(b' ');
        }
        for axis in 0..COUNT {
            if let Some(value) = words.value[axis] {
                text.push(axes::LETTERS[axis]);
                number::write(&mut text, value, words.decimals[axis], 0, point);
                text.push(b' ');
            }
        }
        if let Shape::Arc(arc) = piece.shape {
            for (letter, value) in self.centre_words(&arc) {
                text.push(letter);
                number::write(
                    &mut text,
                    value,
                    number::decimals(0, self.units()),
                    0,
                    point,
                );
                text.push(b' ');
            }
        }
        let inverse = matches!(piece.feed, Some(Rate::Inverse(_)));
        if let Some(feed) = feed
            && (inverse || !self.written.feed.is_some_and(|f| same_feed(feed, f)))
        {
            self.report.feeds += 1;
            text.push(b'F');
            number::write_feed(&mut text, feed, point);
            text.push(b' ');
        }
        while text.last() == Some(&b' ') {
            text.pop();
        }
        let done = self.follow(&text, Some(&words.to));
        out.extend_from_slice(&text);
        out.extend_from_slice(eol);
        self.text = text;
        self.report.lines[1] += 1;
        done
    }

    /// Words that belong behind the motion, in a line of their own.
    pub(super) fn write_after(
        &mut self,
        block: &Block,
        line: &[u8],
        eol: &[u8],
        out: &mut Vec<u8>,
    ) -> Result<(), Fault> {
        let mut text = Vec::new();
        if block.deleted {
            text.push(b'/');
        }
        for word in block
            .words
            .iter()
            .filter(|w| is_after(w, self.rules.dialect))
        {
            if text.len() > usize::from(block.deleted) {
                text.push(b' ');
            }
            text.extend_from_slice(&line[word.span()]);
        }
        self.report.lines[1] += 1;
        let done = self.follow(&text, None);
        out.extend_from_slice(&text);
        out.extend_from_slice(eol);
        done
    }

    /// What the controller makes of a line that is written: it must lead where it was meant to.
    pub(super) fn follow(&mut self, text: &[u8], to: Option<&PerLetter>) -> Result<(), Fault> {
        let longest = self.rules.dialect.longest_line();
        if text.len() > longest {
            return Err(Fault::new(
                0..0,
                format!(
                    "the corrected line has more than {longest} bytes, which controllers cut off"
                ),
                "shorten its comment",
            ));
        }
        if let Some(before) = self.before_modes.take() {
            self.written = before;
        }
        let mut block = std::mem::take(&mut self.check);
        block.scan(text, self.rules.dialect)?;
        // A word without a point is not meant in least increments here: all have one, or are unchanged.
        let done = self.written.step(&block, self.rules);
        self.check = block;
        done?;
        let leads = to.is_none_or(|to| {
            bits(self.tables.axes).all(|i| (self.written.position.at[i] - to[i]).abs() < 1e-6)
        });
        if leads {
            return Ok(());
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

    fn motion_word(&self, piece: &Piece) -> Option<Motion> {
        match piece.shape {
            // Threads keep their word.
            _ if self.nominal.motion.is_none() => None,
            Shape::Rapid => Some(Motion::Rapid),
            Shape::Feed => Some(Motion::Feed),
            Shape::Arc(arc) if arc.sweep < 0.0 => Some(Motion::Clockwise),
            Shape::Arc(_) => Some(Motion::Counterclockwise),
        }
    }

    /// The words of a centre, in units of the program.
    fn centre_words(&self, arc: &Arc) -> [(u8, f64); 2] {
        let [i, j, _] = arc.axes;
        let unit = self.unit();
        let values = if self.nominal.arc_distance == Distance::Incremental {
            let at = self.written.position.at;
            let by = [arc.centre[0] - at[i], arc.centre[1] - at[j]];
            match self.written.offsets.is_turned() {
                true => self.written.offsets.turned_back(by),
                false => by,
            }
        } else {
            let mut centre = self.written.position.at;
            [centre[i], centre[j]] = arc.centre;
            let program = self.written.offsets.program(&centre);
            [program[i], program[j]]
        };
        [(b"IJK"[i], values[0] / unit), (b"IJK"[j], values[1] / unit)]
    }

    /// G92 and G10 L20: the words say where the machine is, which is elsewhere now.
    pub(super) fn reference(
        &mut self,
        block: &Block,
        system: Option<u16>,
        line: &[u8],
        eol: &[u8],
        out: &mut Vec<u8>,
    ) -> Result<(), Fault> {
        let mut offsets = self.nominal.offsets.clone();
        if let Some(number) = system {
            offsets.select(number);
        }
        let meant = offsets.program(&self.written.position.at);
        let point = self.rules.dialect == Dialect::Fanuc;
        let mut edits = std::mem::take(&mut self.edits);
        edits.clear();
        for word in &block.words {
            let Some(axis) = axes::index(word.letter) else {
                continue;
            };
            let unit = if is_rotary(axis) { 1.0 } else { self.unit() };
            // More decimals: what is lost here is lost everywhere behind it.
            let decimals = word.decimals.max(number::decimals(axis, self.units()) + 1);
            let value = round(meant[axis] / unit, decimals);
            replace_number(
                &mut edits,
                word,
                value,
                decimals,
                point,
                self.rules.least_increments,
            );
        }
        let from = out.len();
        edits.apply(line, out);
        self.edits = edits;
        self.follow(&out[from..], None)?;
        out.extend_from_slice(eol);
        Ok(())
    }
}

/// True if a word G53 is in the line.
pub(super) fn is_machine(block: &Block, dialect: Dialect) -> bool {
    block.words.iter().any(|w| {
        w.letter == b'G'
            && w.tenths().and_then(|t| codes::g(t, dialect)) == Some(Code::MachineCoordinates)
    })
}

fn is_after(word: &Word, dialect: Dialect) -> bool {
    word.letter == b'M'
        && matches!(
            word.tenths().and_then(|t| codes::m(t, dialect)),
            Some(Machine::Pause | Machine::End | Machine::After)
        )
}

fn same_feed(a: f64, b: f64) -> bool {
    (a - b).abs() <= 2e-5 * b.abs()
}

fn replace_number(
    edits: &mut crate::gcode::edit::Edits,
    word: &Word,
    value: f64,
    decimals: usize,
    point: bool,
    least_increments: bool,
) {
    let counts = least_increments && !word.point;
    if counts || round(word.value, 9) != value {
        edits.replace(word.number..word.end, |to| {
            number::write(to, value, decimals, word.decimals.min(decimals), point)
        });
    }
}

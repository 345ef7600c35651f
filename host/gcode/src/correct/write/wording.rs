//! What a line has to say: words of axes, of a centre, of the motion and of the feed.

use super::is_machine;
use crate::arc::Arc;
use crate::axes::{self, COUNT, PerLetter, is_rotary};
use crate::correct::Corrector;
use crate::correct::feed::same_feed;
use crate::correct::piece::{Piece, Shape, Timing};
use crate::edit::Edits;
use crate::fault::Fault;
use crate::interpret::{bits, offset_in_doubt, word_of_wrapped};
use crate::modal::{Distance, Motion, Units};
use crate::moves::Rate;
use crate::number;
use crate::setup::Decimals;
use crate::state::Rules;
use crate::words::{Block, Word};

/// Words of axes of a line that is written.
pub(super) struct Words {
    /// Axes (bits) that are written.
    pub written: u16,
    /// Value in units of the program, of each of them.
    pub value: PerLetter,
    pub decimals: [u8; COUNT],
    /// Axes (bits) whose words go.
    pub left_out: u16,
    /// Where the rounded words lead.
    pub to: PerLetter,
    /// True if they lead anywhere else than where it is.
    pub moves: bool,
}

/// From where to where a line leads, in coordinates of the program, or of the machine.
struct Destination {
    here: PerLetter,
    target: PerLetter,
    /// Axes (bits) that are named, whatever they are.
    wanted: u16,
    machine: bool,
}

/// All that a line with a piece has to say.
pub(super) struct Wording {
    pub words: Words,
    pub feed: Option<f64>,
    /// True if the feed has to be written whatever it was before: G93.
    pub inverse: bool,
    pub motion: Option<Motion>,
    /// The letters of a centre, with their values in units of the program.
    pub centre: Option<[(u8, f64); 2]>,
    /// The letter of a centre along the normal of its plane, which goes.
    pub normal: Option<u8>,
    /// How many turns an arc begins: its P, which 1 needs not.
    pub turns: u32,
    /// True if words are machine coordinates: G53.
    pub machine: bool,
}

impl Corrector<'_> {
    /// The unit of the program: known where words of lengths are read or written, which is asked before.
    pub(in crate::correct) fn units(&self) -> Units {
        self.nominal.units.unwrap_or(Units::Millimetre)
    }

    /// What the line of a piece has to say; `wanted` are axes (bits) that it names, whatever they are: in the place of
    /// the words of the line itself, or `None` for a further line.
    pub(super) fn wording(
        &mut self,
        block: &Block,
        piece: &Piece,
        timing: &Timing,
        wanted: Option<u16>,
    ) -> Result<Wording, Fault> {
        let machine = is_machine(block, self.rules.dialect);
        let coordinates = |at: &PerLetter| match machine {
            true => *at,
            false => self.written.offsets.program(at),
        };
        let destination = Destination {
            here: coordinates(&self.written.position.at),
            target: coordinates(&piece.to),
            wanted: wanted.unwrap_or_default(),
            machine,
        };
        let words = self.words(block, &destination)?;
        Ok(Wording {
            feed: self.feed(piece, timing, &words.to),
            inverse: matches!(timing.rate, Rate::Inverse(_)),
            motion: self.motion_word(piece),
            centre: match piece.shape {
                Shape::Arc(arc) => Some(self.centre_words(&arc, wanted.map(|_| block))),
                _ => None,
            },
            normal: match piece.shape {
                Shape::Arc(arc) => b"IJK".get(arc.axes[2]).copied(),
                _ => None,
            },
            turns: match piece.shape {
                Shape::Arc(arc) => arc.turns(),
                _ => 1,
            },
            machine,
            words,
        })
    }

    /// The feed, if it has to be written.
    pub(super) fn feed_word(&self, wording: &Wording) -> Option<f64> {
        let before = self.written.feed;
        let holds = |feed: f64| before.is_some_and(|before| same_feed(feed, before));
        wording.feed.filter(|f| wording.inverse || !holds(*f))
    }

    /// A feed that is written has a point: the program's must have one too, because F100 and F100. count different units.
    pub(super) fn needs_feed_point(&self, block: &Block) -> Result<(), Fault> {
        let counts_alike = self.rules.setup.decimals == Some(Decimals::Calculator);
        if !self.point() || counts_alike || self.nominal.feed_has_point {
            return Ok(());
        }
        let span = block
            .word(b'F')
            .map_or_else(|| block.axis_span(), Word::span);
        Err(Fault::new(
            span,
            "an F without a decimal point is active, and this move needs another F: what F100 counts is a parameter of the controller",
            "write F with a decimal point, like F100., or give the setup decimals = \"calculator\" if F100 is F100. there",
        ))
    }

    /// How many of the decimals of a word stay.
    pub(in crate::correct) fn kept(&self, decimals: usize) -> usize {
        match self.options.decimals {
            None => decimals.min(9),
            Some(_) => 0,
        }
    }

    /// True if every number has a point.
    pub(in crate::correct) fn point(&self) -> bool {
        self.rules.dialect.table().needs_points
    }

    /// Decimals of an axis in this line.
    fn decimals(&mut self, block: &Block, axis: usize) -> usize {
        let needed = self.options.decimals(axis, self.units());
        let word = block.word(axes::LETTERS[axis]);
        if let Some(word) = word {
            self.report.decimals[0] = self.report.decimals[0].max(word.decimals);
        }
        let decimals = word.map_or(0, |w| self.kept(w.decimals)).max(needed);
        self.report.decimals[1] = self.report.decimals[1].max(decimals);
        decimals
    }

    /// The words that lead to a position.
    fn words(&mut self, block: &Block, destination: &Destination) -> Result<Words, Fault> {
        let mut words = Words {
            written: 0,
            value: [0.0; COUNT],
            decimals: [0; COUNT],
            left_out: 0,
            to: self.written.position.at,
            moves: false,
        };
        let mut program = destination.here;
        for axis in bits(self.tables.axes) {
            self.add_axis(block, axis, destination, &mut words, &mut program)?;
        }
        let offsets = &self.written.offsets;
        if destination.machine {
            words.to = program;
        } else if offsets.is_turned() {
            words.to = offsets.machine(&program);
        } else {
            for axis in bits(words.written) {
                words.to[axis] = offsets.machine_axis(axis, program[axis]);
            }
        }
        Ok(words)
    }

    /// Adds the word of an axis that leads to a position, if it needs one; `program` becomes where it leads.
    fn add_axis(
        &mut self,
        block: &Block,
        axis: usize,
        destination: &Destination,
        words: &mut Words,
        program: &mut PerLetter,
    ) -> Result<(), Fault> {
        let unit = if is_rotary(axis) { 1.0 } else { self.unit() };
        let (here, target) = (destination.here[axis], destination.target[axis]);
        let decimals = self.decimals(block, axis);
        let in_units = |value: f64| if unit == 1.0 { value } else { value / unit };
        let by = in_units(target - here);
        let is_wanted = destination.wanted & (1 << axis) != 0;
        // A word that is replaced keeps what it counts from.
        let replaced = block.word(axes::LETTERS[axis]).filter(|_| is_wanted);
        let relative = !destination.machine
            && self.nominal.distance_of(replaced) == Some(Distance::Incremental);
        let finest = number::finest(decimals);
        let known = self.written.position.knows(axis);
        // An axis that the motion does not name appears only where its correction changes by more than the last digit.
        if !is_wanted && known {
            let last = match self.written.offsets.is_turned() {
                true => finest,
                false => number::last_digit(self.options.decimals(axis, self.units())),
            };
            if by.abs() <= last {
                return Ok(());
            }
        }
        if axis == 2 && !destination.machine && self.written.offset_in_doubt {
            return Err(offset_in_doubt(block.axis_span()));
        }
        let moves = !known || by.abs() >= finest;
        let absolute = !relative && !destination.machine;
        let is_wrapped = absolute && known && self.rules.setup.wrapped[axis] == Some(true);
        if is_wrapped && !moves {
            // A word that moves nothing could mean a whole turn.
            words.left_out |= 1 << axis;
            return Ok(());
        }
        let (value, leads) = if is_wrapped {
            let word = word_of_wrapped(self.rules.dialect, here, target, decimals);
            word.ok_or_else(|| no_word_of_wrapped(block, axis))?
        } else if relative {
            let value = number::rounded(by, decimals);
            (value, here + value * unit)
        } else {
            let value = number::rounded(in_units(target), decimals);
            (value, value * unit)
        };
        words.written |= 1 << axis;
        words.value[axis] = value;
        words.decimals[axis] = decimals as u8;
        words.moves |= moves;
        program[axis] = leads;
        Ok(())
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

    /// The words of a centre, in units of the program, in the place of words of a line or for a further one.
    fn centre_words(&self, arc: &Arc, replaced: Option<&Block>) -> [(u8, f64); 2] {
        let [i, j, _] = arc.axes;
        let at = self.written.position.at;
        let by = [arc.centre[0] - at[i], arc.centre[1] - at[j]];
        let relative = match self.written.offsets.is_turned() {
            true => self.written.offsets.turned_back(by),
            false => by,
        };
        let mut centre = at;
        [centre[i], centre[j]] = arc.centre;
        let program = self.written.offsets.program(&centre);
        let word = |k: usize, axis: usize| {
            let letter = b"IJK"[axis];
            let own = replaced.and_then(|block| block.word(letter)?.distance);
            let value = match own.unwrap_or(self.nominal.arc_distance) {
                Distance::Incremental => relative[k],
                Distance::Absolute => program[axis],
            };
            (letter, value / self.unit())
        };
        [word(0, i), word(1, j)]
    }
}

/// A correction that makes half a turn, or a whole one, out of something else.
fn no_word_of_wrapped(block: &Block, axis: usize) -> Fault {
    let word = block.word(axes::LETTERS[axis]);
    Fault::new(
        word.map_or(0..block.end, Word::span),
        format!(
            "the corrected word of {}, which is wrapped, would turn it another way",
            axes::name(axis)
        ),
        "write the move as two, each of less than half a turn",
    )
}

/// A letter and its number.
pub(super) fn write_word(to: &mut Vec<u8>, letter: u8, value: f64, decimals: usize, point: bool) {
    to.push(letter);
    number::write(to, value, decimals, 0, point);
}

/// Gives a word another number, if it is another.
pub(in crate::correct) fn replace_number(
    edits: &mut Edits,
    rules: &Rules,
    word: &Word,
    value: f64,
    decimals: usize,
) {
    let point = rules.dialect.table().needs_points;
    let counts = rules.counts(word, false, Units::Millimetre) != 1.0;
    if counts || number::rounded(word.value, 9) != value {
        edits.replace(word.digits(), |to| {
            number::write(to, value, decimals, word.decimals.min(decimals), point)
        });
    }
}

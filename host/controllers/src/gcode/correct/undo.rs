//! A correction taken away: what the corrector has added goes again.

use super::Corrector;
use super::given::{Given, Moving};
use super::piece::{Piece, Shape};
use crate::gcode::axes::{self, COUNT, is_rotary};
use crate::gcode::codes::{self, Code, Group};
use crate::gcode::fault::Fault;
use crate::gcode::moves::{Rate, Straight};
use crate::gcode::trace::Path;
use crate::gcode::travel_directions::TravelDirections;

/// A step at a reversal is shorter (mm and degrees).
const LONGEST_STEP: f64 = 2.0;
/// What words that are rounded, once each, may seem to move on it (mm, degrees): half of their last digits and a little
/// more, of the positions before and behind it in the corrected program, and of that before it in this one.
pub(super) const STANDS: [f64; 2] = [2e-4, 2e-5];

impl Corrector<'_> {
    /// True if a straight move of a corrected program is the step of a reversal: with directions that have turned round
    /// the program stands, with those that hold it would move. The directions are those behind it then.
    pub(super) fn is_step_of_reversal(
        &mut self,
        straight: &Straight,
        rate: Rate,
        moving: &Moving,
    ) -> Result<bool, Fault> {
        let held = self.held(straight, rate);
        let here = self.written.position;
        let apart = self.options.backlash.is_apart() && self.axes_turn() && !self.is_offset();
        let unknown = here
            .missing(self.tables.axes)
            .or(straight.from.missing(self.tables.axes));
        if !apart || self.tables.directional == 0 || straight.with_spindle || unknown.is_some() {
            return Ok(false);
        }
        let (from, to) = (&straight.from.at, &straight.to);
        if from.iter().zip(to).map(|(a, b)| (a - b).abs()).sum::<f64>() > LONGEST_STEP {
            return Ok(false);
        }
        let field = self.field();
        let stands = |ways: &TravelDirections| {
            let mut node = field.node(1.0, to, ways)?;
            self.hold(held, &mut node);
            let near =
                |i: usize| (node.to[i] - here.at[i]).abs() <= STANDS[usize::from(is_rotary(i))];
            Ok((0..COUNT).all(near).then_some(node.moved))
        };
        let mut ways = self.ways.clone();
        let turned = ways.turn_by(self.tables, stands);
        self.ways = ways;
        turned.map_err(|lost| moving.lost(lost))
    }

    /// A line of a corrected program whose motion was added: it is left out, or leads nowhere if there is more in it.
    pub(super) fn stands(
        &mut self,
        given: &Given<'_>,
        straight: &Straight,
        rate: Rate,
        out: &mut Vec<u8>,
    ) -> Result<(), Fault> {
        if self.is_only_motion(given) {
            self.report.lines[1] -= 1;
            return Ok(());
        }
        let shape = match rate {
            Rate::Rapid => Shape::Rapid,
            _ => Shape::Feed,
        };
        let timing = self.timing(rate, &Path::Line(straight.from.at, straight.to));
        let here = self.written.position.at;
        self.write_all(given, &[Piece::of(shape, here, timing)], out)
    }

    /// True if nothing is lost with a line that moves nothing: it has words of a motion alone.
    fn is_only_motion(&self, given: &Given<'_>) -> bool {
        let block = given.block;
        let is_of_motion = |letter: u8, code: Option<Code>| {
            letter == b'F'
                || axes::index(letter).is_some()
                || code.is_some_and(|c| c.group() == Group::Motion || c == Code::MachineCoordinates)
        };
        let mut words = block.words.iter();
        !block.has_text && words.all(|w| is_of_motion(w.letter, codes::code(w, self.rules.dialect)))
    }
}

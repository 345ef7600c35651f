//! A cycle as single moves.

use crate::correct::Corrector;
use crate::correct::given::Given;
use crate::correct::piece::{Piece, Shape, Timing};
use crate::correct::write::Change;
use crate::cycle::{Cycle, Part};
use crate::fault::Fault;
use crate::modal::{Motion, Spindle};
use crate::moves::Rate;
use crate::number;
use crate::trace::{Lost, Path};

impl Corrector<'_> {
    /// The cycle as single moves, the first of them in its line.
    pub(super) fn write_out(
        &mut self,
        given: &Given<'_>,
        cycle: &Cycle,
        parts: &[Part],
    ) -> Result<(), Fault> {
        let given = self.with_end(given);
        let mut at = cycle.from;
        let mut first = true;
        let mut done = 0.0;
        for part in parts {
            let (rate, to) = match part {
                Part::Rapid(to) => (Rate::Rapid, *to),
                Part::Feed(to) => (cycle.rate, *to),
                other => {
                    if let Some(words) = self.words_apart(other) {
                        self.write_apart(&given, &words)?;
                    }
                    continue;
                }
            };
            let path = Path::Line(at, to);
            let timing = self.timing(rate, &path);
            let pieces = self.pieces_of_move(&path, rate)?;
            self.joined = true;
            for piece in pieces {
                let piece = Piece {
                    until: done + piece.until,
                    ..piece
                };
                // Motion words of the line become those of its first move.
                let motion = self.nominal.motion.replace(Motion::Rapid);
                let done = self.write_part(&given, &piece, &timing, first);
                self.nominal.motion = motion;
                done?;
                first = false;
            }
            done += 1.0;
            at = to;
        }
        if given.step.after {
            self.write_after(&given)?;
        }
        Ok(())
    }

    /// What stands between two moves.
    fn words_apart(&self, part: &Part) -> Option<Vec<u8>> {
        match part {
            Part::Dwell(p) => {
                let mut wait = b"G4 P".to_vec();
                number::write(&mut wait, p.value, 6, 0, p.point);
                Some(wait)
            }
            Part::SpindleStops => Some(Spindle::Stands.word().into()),
            // Known, or the cycle was refused.
            Part::SpindleTurns => Some(self.nominal.spindle?.word().into()),
            Part::Rapid(_) | Part::Feed(_) => None,
        }
    }

    /// A move of the cycle corrected: a rapid as a whole, a feed along its path.
    fn pieces_of_move(&mut self, path: &Path, rate: Rate) -> Result<Vec<Piece>, Lost> {
        if rate == Rate::Rapid {
            self.stretches(path)?;
            let end = self.end(&path.at(1.0), 0, false)?;
            return Ok(vec![Piece::whole(Shape::Rapid, end)]);
        }
        self.trace(path)?;
        let (field, limits) = (self.field(), self.limits());
        self.runs(&field, path, &limits)
    }

    /// A move of the cycle, in the line of the program or behind it.
    fn write_part(
        &mut self,
        given: &Given<'_>,
        piece: &Piece,
        timing: &Timing,
        first: bool,
    ) -> Result<(), Fault> {
        if !first {
            return self.write_next(given, piece, timing);
        }
        let change = Change {
            piece,
            timing,
            wanted: 0,
            gone: u16::MAX,
            without: b"RQPLK",
            without_after: given.step.after,
        };
        self.write_first(given, &change)?;
        self.out.extend_from_slice(given.eol);
        Ok(())
    }
}

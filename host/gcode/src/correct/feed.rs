//! Time and feed: every piece takes its part of what the motion takes in the program.

use super::Corrector;
use super::piece::{Piece, Shape, Timing};
use crate::arc::Arc;
use crate::axes::{COUNT, NOTHING, PerLetter, is_rotary};
use crate::moves::Rate;
use crate::trace::Path;

/// How much of its time a move may take more or less.
pub(super) const TIMES: f64 = 0.01;

impl Corrector<'_> {
    /// The unit of the program in mm.
    pub(super) fn unit(&self) -> f64 {
        self.units().mm()
    }

    /// A difference of positions in units of the program.
    fn in_program(&self, by: &PerLetter) -> PerLetter {
        let unit = self.unit();
        if unit == 1.0 {
            return *by;
        }
        std::array::from_fn(|i| if is_rotary(i) { by[i] } else { by[i] / unit })
    }

    /// What a motion takes.
    pub(super) fn timing(&self, rate: Rate, path: &Path) -> Timing {
        let by = path
            .by()
            .map(|by| if by.abs() < NOTHING { 0.0 } else { by });
        let straight = self.in_program(&by);
        let length = match path {
            Path::Line(..) => self.rules.dialect.length(&straight),
            Path::Arc(arc) => {
                let linear = arc.length() / self.unit();
                self.rules.dialect.arc_length(linear, &straight)
            }
        };
        let minutes = match rate {
            Rate::PerMinute(f) | Rate::PerRevolution(f) => length / f,
            Rate::Inverse(f) if length > 0.0 => 1.0 / f,
            Rate::Inverse(_) | Rate::Rapid => 0.0,
        };
        Timing {
            rate,
            minutes,
            turns: (0..COUNT).any(|i| is_rotary(i) && by[i] != 0.0),
        }
    }

    /// The F of a piece: what must hold while it moves.
    pub(super) fn feed(&self, piece: &Piece, timing: &Timing, to: &PerLetter) -> Option<f64> {
        let Some(share) = piece.share else {
            return match timing.rate {
                Rate::Rapid => None,
                Rate::PerMinute(f) | Rate::PerRevolution(f) => Some(f),
                // A twentieth of a second, for a few µm.
                Rate::Inverse(_) => Some(1200.0),
            };
        };
        let (f, minutes) = match timing.rate {
            _ if timing.minutes == 0.0 => return None,
            Rate::Rapid => return None,
            Rate::Inverse(f) => return Some(if share >= 1.0 - 1e-9 { f } else { f / share }),
            Rate::PerMinute(f) | Rate::PerRevolution(f) => (f, timing.minutes * share),
        };
        let by: PerLetter = std::array::from_fn(|i| {
            let by = to[i] - self.written.position.at[i];
            // Rounding does not count as a motion.
            if by.abs() < NOTHING { 0.0 } else { by }
        });
        let by = self.in_program(&by);
        let length = match piece.shape {
            Shape::Arc(arc) => {
                let linear = self.as_written(&arc, to).length() / self.unit();
                self.rules.dialect.arc_length(linear, &by)
            }
            _ => self.rules.dialect.length(&by),
        };
        let needed = length / minutes;
        let turns = timing.turns || (3..6).any(|i| by[i] != 0.0);
        let allowed = if turns { 1e-4 } else { TIMES };
        let same = (needed / f - 1.0).abs() <= allowed;
        Some(if same || !needed.is_finite() || needed <= 0.0 {
            f
        } else {
            needed
        })
    }

    /// An arc between ends that are rounded, which is more than 1 % of a short one; as it is, if they would make another
    /// figure of it.
    fn as_written(&self, arc: &Arc, to: &PerLetter) -> Arc {
        let from = self.written.position.at;
        let clockwise = arc.sweep < 0.0;
        let written = Arc::new(from, *to, arc.axes, arc.centre, clockwise, arc.turns());
        match (written.sweep - arc.sweep).abs() < 0.1 {
            true => written,
            false => *arc,
        }
    }
}

/// True if two feeds are written alike.
pub(super) fn same_feed(a: f64, b: f64) -> bool {
    (a - b).abs() <= 2e-5 * b.abs()
}

//! E of a move that is divided: each piece gets what belongs to its length, and all of them together what the line had.

use crate::correct::Corrector;
use crate::correct::given::Given;
use crate::correct::piece::Piece;
use crate::fault::Fault;
use crate::modal::Distance;
use crate::number;

/// Decimals of E in pieces, at least: 0.01 µm of filament.
const DECIMALS: usize = 5;

/// E of a line while its pieces are written, in units of the program.
#[derive(Clone, Copy, Debug)]
pub(in crate::correct) struct Extrusion {
    /// What the line extrudes.
    by: f64,
    /// Where E is at its end, if E is absolute.
    at: Option<f64>,
    decimals: usize,
}

impl Corrector<'_> {
    /// E of a line that is divided.
    ///
    /// # Errors
    /// An E whose meaning is not known.
    pub(super) fn extrusion(&self, given: &Given<'_>) -> Result<Option<Extrusion>, Fault> {
        let Some(word) = given.block.word(b'E') else {
            return Ok(None);
        };
        let state = &self.nominal;
        let Some(by) = given.step.extruded else {
            let (cause, remedy) = match state.extruder.distance(state.distance) {
                Some(_) => (
                    "an absolute E, and the position of E before it is unknown",
                    "write G92 E0 before it",
                ),
                None => (
                    "E may be absolute or relative here: firmwares differ after G90 and G91",
                    "write M82 or M83 before it, after the last G90 or G91",
                ),
            };
            return Err(word.fault(cause, remedy));
        };
        let absolute = state.extruder.distance(state.distance) == Some(Distance::Absolute);
        Ok(Some(Extrusion {
            by,
            at: state.extruder.at().filter(|_| absolute),
            decimals: word.decimals.clamp(DECIMALS, 9),
        }))
    }

    /// The number of E in a piece and its decimals; `None`: it extrudes nothing.
    pub(super) fn extruder_word(&self, piece: &Piece) -> Option<(f64, usize)> {
        let extrusion = self.extrusion?;
        // Steps onto the corrected path are no part of the length.
        piece.share?;
        let left = extrusion.by * (1.0 - piece.until);
        let written = &self.written.extruder;
        let decimals = extrusion.decimals;
        let (value, before) = match extrusion.at {
            Some(at) => (at - left, written.at()?),
            // From what is written, so that roundings do not add up.
            None => (self.nominal.extruder.ahead_of(written) - left, 0.0),
        };
        let value = number::rounded(value, decimals);
        ((value - before).abs() > number::finest(decimals)).then_some((value, decimals))
    }

    /// Everything that the line extrudes must be there in the end.
    pub(super) fn all_is_extruded(&mut self) -> Result<(), Fault> {
        let done = self.extrusion.take();
        if done.is_none() || self.nominal.extruder.agrees(&self.written.extruder) {
            return Ok(());
        }
        Err(Fault::new(
            0..0,
            "what would be written extrudes another length",
            "this is a mistake of trueaxis: please report the line; nothing is written",
        ))
    }
}

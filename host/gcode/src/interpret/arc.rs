//! Arcs from their words: I, J, K or R, in the plane that holds.

use super::{Asked, whole};
use crate::arc::{Arc, centre_by_radius};
use crate::axes::{COUNT, PerLetter};
use crate::fault::Fault;
use crate::modal::{Distance, Plane, Units};
use crate::state::State;
use crate::words::Word;

/// Least radius (mm): of less, the last digits of words and the steps at reversals are a part that counts.
const LEAST_RADIUS: f64 = 1e-2;
/// How far the radii at both ends may differ for words that seem to be absolute (mm).
const ABSOLUTE: f64 = 0.03;
/// Most turns of a line.
const MOST_TURNS: u32 = 1000;

/// The words of a centre or a radius, in the plane of the arc.
struct CentreWords<'l> {
    radius: Option<&'l Word>,
    /// Along the first and the second axis of the plane.
    offsets: [Option<&'l Word>; 2],
}

impl<'l> CentreWords<'l> {
    /// # Errors
    /// A centre along the normal of the plane.
    fn read(asked: &Asked<'l>, plane: [usize; 3]) -> Result<Self, Fault> {
        // The letters I, J, K belong to X, Y, Z.
        let [first, second, normal] = plane.map(|axis| asked.word(b"IJK"[axis]));
        match normal {
            Some(word) if word.value != 0.0 => Err(word.fault(
                "a centre along the normal of the plane",
                "check the plane: G17, G18 or G19",
            )),
            _ => Ok(Self {
                radius: asked.word(b'R'),
                offsets: [first, second],
            }),
        }
    }

    /// A word of the centre, otherwise that of the radius.
    fn first(&self) -> Option<&'l Word> {
        self.offsets.into_iter().flatten().next().or(self.radius)
    }
}

impl State {
    /// The plane, where it must be known.
    pub(super) fn plane(&self, asked: &Asked<'_>) -> Result<Plane, Fault> {
        let plane = self.plane.ok_or_else(|| {
            asked.fault(
                "the plane is unknown here",
                "write G17, G18 or G19 before it",
            )
        })?;
        if self.offsets.is_turned() && plane != Plane::Xy {
            return Err(asked.fault(
                "an arc or a cycle outside the XY plane under a rotation",
                "write it without rotation",
            ));
        }
        Ok(plane)
    }

    /// G2, G3.
    pub(super) fn arc(&self, asked: &Asked<'_>, clockwise: bool) -> Result<Arc, Fault> {
        if let Some((_, word)) = asked.once {
            // P would be that of both, and I, J, K alone are no motion there.
            return Err(word.fault(
                "an arc in a line with G4 or another word that acts once",
                "write two lines",
            ));
        }
        let plane = self.plane(asked)?.axes();
        if let Some(axis) = self.position.missing(asked.rules.axes) {
            return Err(self.missing(asked, axis));
        }
        let from = self.position.at;
        let to = self.target(asked, asked.free, false)?.at;
        let words = CentreWords::read(asked, plane)?;
        let turns = turns_of_arc(asked)?;
        if let Some(word) = words.first() {
            // Full turns have no words of axes, and are written with them.
            self.needs_system(word)?;
        }
        let centre = self.centre(asked, &words, [&from, &to], plane, clockwise)?;
        let arc = Arc::new(from, to, plane, centre, clockwise, turns);
        self.check_radii(asked, &words, &arc)?;
        Ok(arc)
    }

    /// The centre, from its own words or from the radius.
    fn centre(
        &self,
        asked: &Asked<'_>,
        words: &CentreWords<'_>,
        [from, to]: [&PerLetter; 2],
        [i, j, _]: [usize; 3],
        clockwise: bool,
    ) -> Result<[f64; 2], Fault> {
        let given = words.offsets.into_iter().flatten().next();
        match (words.radius, given) {
            (Some(word), None) => {
                let r = self.length_of(asked, word)?;
                centre_by_radius([from[i], from[j]], [to[i], to[j]], r, clockwise)
                    .map_err(|cause| word.fault(cause, "check the radius and the end"))
            }
            (Some(word), Some(_)) => Err(word.fault("a radius and a centre", "write one of them")),
            (None, None) => {
                Err(asked.fault("an arc without a centre or a radius", "write I, J, K or R"))
            }
            (None, Some(given)) => self.written_centre(asked, from, [i, j], words.offsets, given),
        }
    }

    /// The radii at both ends must agree, and be more than rounding.
    fn check_radii(
        &self,
        asked: &Asked<'_>,
        words: &CentreWords<'_>,
        arc: &Arc,
    ) -> Result<(), Fault> {
        let [r0, r1] = arc.radii();
        let off = (r0 - r1).abs();
        let spiral = asked.rules.dialect.table().spiral;
        let allowed = spiral[usize::from(self.units == Some(Units::Inch))];
        let fits = off <= 0.5 && (off <= allowed || off <= 1e-3 * r0.max(r1));
        let span = words.first().map_or(0..asked.block.end, Word::span);
        if fits && r0.min(r1) < LEAST_RADIUS {
            return Err(Fault::new(
                span,
                format!(
                    "an arc with a radius of {:.4} mm, less than {LEAST_RADIUS} mm: the last digits of words would be its path",
                    r0.min(r1)
                ),
                "check the centre, or write the arc as a straight move",
            ));
        }
        if !fits {
            let remedy = match self.is_absolute(asked, words.offsets, arc) {
                true => {
                    "the words of the centre fit if they are absolute: give the setup [start] arcs = \"G90.1\" if the \
                     controller reads them so, or post the program with I, J and K from the start of the arc"
                }
                false => "check the centre and the end",
            };
            return Err(Fault::new(
                span,
                format!(
                    "the radius does not fit: {r0:.4} mm at the start of the arc, {r1:.4} mm at its end"
                ),
                remedy,
            ));
        }
        Ok(())
    }

    /// True if the words of a centre would fit if they were coordinates of the program.
    fn is_absolute(&self, asked: &Asked<'_>, words: [Option<&Word>; 2], arc: &Arc) -> bool {
        let [i, j, _] = arc.axes;
        let mut program: PerLetter = [0.0; COUNT];
        for (axis, word) in [i, j].into_iter().zip(words) {
            let value = word.map(|word| self.length_of(asked, word));
            match value {
                Some(Ok(value)) => program[axis] = value,
                _ => return false,
            }
        }
        let at = self.offsets.machine(&program);
        let radius = |p: &PerLetter| libm::hypot(p[i] - at[i], p[j] - at[j]);
        self.arc_distance == Distance::Incremental
            && words.iter().flatten().all(|word| word.distance.is_none())
            && (radius(&arc.from) - radius(&arc.to)).abs() < ABSOLUTE
    }

    /// The centre from I, J, K; `given` is the first of the words.
    fn written_centre(
        &self,
        asked: &Asked<'_>,
        from: &PerLetter,
        [i, j]: [usize; 2],
        words: [Option<&Word>; 2],
        given: &Word,
    ) -> Result<[f64; 2], Fault> {
        let mut by = [0.0; 2];
        for (by, word) in by.iter_mut().zip(words) {
            if let Some(word) = word {
                *by = self.length_of(asked, word)?;
            }
        }
        let own = |word: Option<&Word>| word.and_then(|word| word.distance);
        let relative =
            words.map(|word| own(word).unwrap_or(self.arc_distance) == Distance::Incremental);
        if relative == [true; 2] {
            if self.offsets.is_turned() {
                by = self.offsets.turned(by);
            }
            return Ok([from[i] + by[0], from[j] + by[1]]);
        }
        if self.arc_distance == Distance::Absolute && words.contains(&None) {
            return Err(given.fault(
                "one half of a centre under G90.1",
                "write both words of the centre",
            ));
        }
        let mut program: PerLetter = [0.0; COUNT];
        [program[i], program[j]] = by;
        let at = self.offsets.machine(&program);
        let of = |k: usize, axis: usize| match relative[k] {
            true => from[axis] + by[k],
            false => at[axis],
        };
        Ok([of(0, i), of(1, j)])
    }
}

/// How often an arc passes its end: P.
fn turns_of_arc(asked: &Asked<'_>) -> Result<u32, Fault> {
    let Some(word) = asked.word(b'P') else {
        return Ok(1);
    };
    match whole(word)?.max(1) {
        turns if turns > MOST_TURNS => Err(word.fault(
            format!("an arc of more than {MOST_TURNS} turns"),
            "write several arcs",
        )),
        turns => Ok(turns),
    }
}

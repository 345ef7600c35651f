//! The motion of a line.

use super::{Asked, Step, bits, not_known, whole};
use crate::gcode::arc::{Arc, centre_by_radius};
use crate::gcode::axes::{self, COUNT, PerLetter, Position};
use crate::gcode::codes::Code;
use crate::gcode::cycle::{Cycle, Sticky};
use crate::gcode::fault::Fault;
use crate::gcode::modal::{Distance, FeedMode, Motion, Plane};
use crate::gcode::moves::{Move, Rate, Straight};
use crate::gcode::state::{Rules, State};
use crate::gcode::words::{Block, Word};

impl State {
    /// Moves, with the axes that no other word of the line has taken.
    pub(super) fn do_motion(
        &mut self,
        block: &Block,
        rules: &Rules,
        asked: &Asked,
        free: u16,
        step: &mut Step,
    ) -> Result<(), Fault> {
        if let Some(other) = bits(free).find(|axis| rules.axes & (1 << axis) == 0) {
            let letter = axes::name(other);
            let word = block.word(axes::LETTERS[other]);
            return Err(Fault::new(
                word.map_or(0..block.end, Word::span),
                format!("the compensation has no axis {letter}"),
                "give the compensation of the machine that the program is for",
            ));
        }
        match asked.motion {
            Some((Code::NoMotion, place)) => {
                self.motion = None;
                self.cycle = None;
                return match free {
                    0 => Ok(()),
                    _ => Err(Fault::new(
                        block.words[place].span(),
                        "axes in a line with G80",
                        "write two lines",
                    )),
                };
            }
            Some((Code::Probe, place)) => {
                self.not_with_tip(&block.words[place])?;
                bits(free).for_each(|axis| self.position.forget(axis));
                step.passed = Some("probing");
                self.motion = None;
                return Ok(());
            }
            Some((Code::Threading(tenths), place)) => {
                return self.thread(block, rules, tenths, place, free, step);
            }
            _ => {}
        }
        let motion = self.motion_of(asked);
        if let Some((Code::Motion(motion), _)) = asked.motion {
            if !matches!(motion, Motion::Cycle(_)) {
                self.cycle = None;
            }
            self.motion = Some(motion);
        }
        let is_arc = matches!(motion, Some(Motion::Clockwise | Motion::Counterclockwise));
        let has_centre = is_arc
            && [b'I', b'J', b'K', b'R']
                .iter()
                .any(|l| block.word(*l).is_some());
        if free == 0 && !(has_centre && asked.once.is_none()) {
            return Ok(());
        }
        let Some(motion) = motion else {
            return Err(Fault::new(
                self.axis_span(block),
                "axes without a motion word, and none holds",
                "write G0, G1, G2 or G3",
            ));
        };
        let machine = asked.machine_coordinates.is_some();
        if let (true, Some(place)) = (machine, asked.machine_coordinates) {
            let word = &block.words[place];
            if !matches!(motion, Motion::Rapid | Motion::Feed) {
                return Err(Fault::new(
                    word.span(),
                    "G53 without G0 or G1",
                    "write G0 or G1",
                ));
            }
            if self.distance != Some(Distance::Absolute) {
                return Err(Fault::new(
                    word.span(),
                    "G53 under G91",
                    "write G90 before it",
                ));
            }
            self.not_with_tip(word)?;
        }
        match motion {
            Motion::Rapid | Motion::Feed => {
                let from = self.position;
                let to = self.target(block, rules, free, machine)?;
                let rate = match motion {
                    Motion::Rapid => Rate::Rapid,
                    _ => self.rate(block)?,
                };
                let needed = match motion {
                    Motion::Rapid => to.missing(rules.axes),
                    _ => to.missing(rules.axes).or(from.missing(rules.axes)),
                };
                if let Some(axis) = needed {
                    return Err(self.missing(block, axis));
                }
                self.position = to;
                let straight = Straight {
                    from,
                    to: to.at,
                    machine,
                    with_spindle: false,
                };
                step.motion = Some(Move::Straight(straight, rate));
            }
            Motion::Clockwise | Motion::Counterclockwise => {
                let rate = self.rate(block)?;
                let arc = self.arc(block, rules, motion == Motion::Clockwise, free)?;
                self.position.at = arc.to;
                step.motion = Some(Move::Arc(arc, rate));
            }
            Motion::Cycle(code) => {
                let cycle = self.canned(block, rules, code, free)?;
                self.position.at = cycle.to();
                step.motion = Some(Move::Cycle(cycle));
            }
        }
        Ok(())
    }

    fn axis_span(&self, block: &Block) -> std::ops::Range<usize> {
        let word = block.words.iter().find(|w| axes::index(w.letter).is_some());
        word.map_or(0..block.end, Word::span)
    }

    fn missing(&self, block: &Block, axis: usize) -> Fault {
        let span = self.axis_span(block);
        let at = block.words.iter().find(|w| w.start == span.start);
        match at {
            Some(word) => not_known(word, axis),
            None => Fault::new(
                span,
                format!("the position of {} is not known here", axes::name(axis)),
                "give it in the setup",
            ),
        }
    }

    /// Where the words lead.
    fn target(
        &self,
        block: &Block,
        rules: &Rules,
        words: u16,
        machine: bool,
    ) -> Result<Position, Fault> {
        let mut to = self.position;
        let first = block.words.iter().find(|w| axes::index(w.letter).is_some());
        let Some(first) = first else { return Ok(to) };
        if machine {
            for axis in bits(words) {
                to.set(axis, self.value(block, rules, axis)?);
            }
            return Ok(to);
        }
        let Some(distance) = self.distance else {
            return Err(Fault::new(
                first.span(),
                "absolute or incremental: that is not known here",
                "write G90 or G91 before it",
            ));
        };
        self.needs_system(first)?;
        let turned = self.offsets.is_turned() && words & 0b11 != 0;
        let relative = distance == Distance::Incremental;
        if turned {
            // A word of X moves both, so both must be known unless both are given.
            let needed = if relative || words & 0b11 != 0b11 {
                0b11
            } else {
                0
            };
            if let Some(axis) = self.position.missing(needed) {
                return Err(not_known(first, axis));
            }
            let mut program = self.offsets.program(&self.position.at);
            for axis in bits(words & 0b11) {
                let value = self.value(block, rules, axis)?;
                program[axis] = if relative {
                    program[axis] + value
                } else {
                    value
                };
            }
            let at = self.offsets.machine(&program);
            to.set(0, at[0]);
            to.set(1, at[1]);
        }
        let single = if turned { words & !0b11 } else { words };
        for axis in bits(single) {
            let value = self.value(block, rules, axis)?;
            if relative {
                if !self.position.knows(axis) {
                    return Err(not_known(first, axis));
                }
                to.set(axis, self.position.at[axis] + value);
            } else {
                to.set(axis, self.offsets.machine_axis(axis, value));
            }
        }
        Ok(to)
    }

    /// F as it holds for a move.
    fn rate(&self, block: &Block) -> Result<Rate, Fault> {
        let feed = self.feed.filter(|f| *f > 0.0);
        let Some(feed) = feed else {
            let cause = match self.feed_mode {
                FeedMode::InverseTime => "a move without F under G93",
                _ => "a feed that is not known",
            };
            return Err(Fault::new(
                self.axis_span(block),
                cause,
                "write F in this line or before it",
            ));
        };
        Ok(match self.feed_mode {
            FeedMode::InverseTime => Rate::Inverse(feed),
            FeedMode::PerMinute => Rate::PerMinute(feed),
            FeedMode::PerRevolution => Rate::PerRevolution(feed),
        })
    }

    fn plane(&self, block: &Block) -> Result<Plane, Fault> {
        let plane = self.plane.ok_or_else(|| {
            Fault::new(
                self.axis_span(block),
                "the plane is not known here",
                "write G17, G18 or G19 before it",
            )
        })?;
        if self.offsets.is_turned() && plane != Plane::Xy {
            return Err(Fault::new(
                self.axis_span(block),
                "an arc or a cycle outside the XY plane under a rotation",
                "write it without rotation",
            ));
        }
        Ok(plane)
    }

    fn arc(&self, block: &Block, rules: &Rules, clockwise: bool, words: u16) -> Result<Arc, Fault> {
        let plane = self.plane(block)?.axes();
        let [i, j, _] = plane;
        if let Some(axis) = self.position.missing(rules.axes) {
            return Err(self.missing(block, axis));
        }
        let from = self.position.at;
        let to = self.target(block, rules, words, false)?.at;
        // The letters I, J, K belong to X, Y, Z.
        let letters = plane.map(|axis| b"IJK"[axis]);
        if let Some(word) = block.word(letters[2]) {
            return Err(Fault::new(
                word.span(),
                "a centre along the normal of the plane",
                "check the plane: G17, G18 or G19",
            ));
        }
        let turns = match block.word(b'P') {
            Some(word) => whole(word)?.max(1),
            None => 1,
        };
        let radius = block.word(b'R');
        let offsets = [block.word(letters[0]), block.word(letters[1])];
        let given = offsets.iter().flatten().next().copied();
        let centre = match (radius, given) {
            (Some(word), None) => {
                let r = self.length_of(word, rules)?;
                centre_by_radius([from[i], from[j]], [to[i], to[j]], r, clockwise).map_err(
                    |cause| Fault::new(word.span(), cause, "check the radius and the end"),
                )?
            }
            (Some(word), Some(_)) => {
                return Err(Fault::new(
                    word.span(),
                    "a radius and a centre",
                    "write one of them",
                ));
            }
            (None, None) => {
                return Err(Fault::new(
                    self.axis_span(block),
                    "an arc without a centre or a radius",
                    "write I, J, K or R",
                ));
            }
            (None, Some(_)) => self.centre(rules, &from, [i, j], offsets, given)?,
        };
        let arc = Arc::new(from, to, plane, centre, clockwise, turns);
        let [r0, r1] = arc.radii();
        let off = (r0 - r1).abs();
        if r0 < 1e-9 || r1 < 1e-9 || off > 0.5 || (off > 0.005 && off > 1e-3 * r0.max(r1)) {
            return Err(Fault::new(
                given.or(radius).map_or(0..block.end, |w| w.span()),
                format!(
                    "the radius does not fit: {r0:.4} mm at the start of the arc, {r1:.4} mm at its end"
                ),
                "check the centre and the end",
            ));
        }
        Ok(arc)
    }

    /// The centre from I, J, K.
    fn centre(
        &self,
        rules: &Rules,
        from: &PerLetter,
        [i, j]: [usize; 2],
        words: [Option<&Word>; 2],
        given: Option<&Word>,
    ) -> Result<[f64; 2], Fault> {
        let mut by = [0.0; 2];
        for (by, word) in by.iter_mut().zip(words) {
            if let Some(word) = word {
                *by = self.length_of(word, rules)?;
            }
        }
        if self.arc_distance == Distance::Incremental {
            if self.offsets.is_turned() {
                by = self.offsets.turned(by);
            }
            return Ok([from[i] + by[0], from[j] + by[1]]);
        }
        let (Some(_), Some(_)) = (words[0], words[1]) else {
            let span = given.map_or(0..0, Word::span);
            return Err(Fault::new(
                span,
                "one half of a centre under G90.1",
                "write both words of the centre",
            ));
        };
        let mut program: PerLetter = [0.0; COUNT];
        [program[i], program[j]] = by;
        let at = self.offsets.machine(&program);
        Ok([at[i], at[j]])
    }

    /// G33, G33.1.
    fn thread(
        &mut self,
        block: &Block,
        rules: &Rules,
        tenths: u16,
        place: usize,
        free: u16,
        step: &mut Step,
    ) -> Result<(), Fault> {
        let word = &block.words[place];
        if block.word(b'K').is_none() {
            return Err(Fault::new(
                word.span(),
                "G33 without K",
                "write K, the way per revolution",
            ));
        }
        let from = self.position;
        if let Some(axis) = from.missing(rules.axes) {
            return Err(self.missing(block, axis));
        }
        let to = self.target(block, rules, free, false)?;
        let straight = Straight {
            from,
            to: to.at,
            machine: false,
            with_spindle: true,
        };
        self.motion = None;
        self.cycle = None;
        // G33.1 comes back to where it began.
        if tenths == 330 {
            self.position = to;
        }
        step.motion = Some(Move::Straight(straight, Rate::Rapid));
        Ok(())
    }

    fn canned(
        &mut self,
        block: &Block,
        rules: &Rules,
        code: u16,
        words: u16,
    ) -> Result<Cycle, Fault> {
        let plane = self.plane(block)?.axes();
        let n = plane[2];
        if self.tip {
            return Err(Fault::new(
                self.axis_span(block),
                "a cycle under tool-centre-point control",
                "write it out",
            ));
        }
        if let Some(axis) = self.position.missing(rules.axes) {
            return Err(self.missing(block, axis));
        }
        if let Some(axis) = bits(words).find(|axis| !plane.contains(axis)) {
            let span = block
                .word(axes::LETTERS[axis])
                .map_or(0..block.end, Word::span);
            return Err(Fault::new(
                span,
                "an axis outside the plane in a cycle",
                "write a line before",
            ));
        }
        let Some(distance) = self.distance else {
            return Err(Fault::new(
                self.axis_span(block),
                "absolute or incremental: that is not known here",
                "write G90 or G91 before it",
            ));
        };
        let relative = distance == Distance::Incremental;
        let from = self.position.at;
        let before = self.cycle.filter(|c| c.code == code);
        let initial = self.cycle.map_or(from[n], |c| c.initial);
        let word = |letter: u8| block.word(letter);
        let lacking = |what: &str| {
            Fault::new(
                self.axis_span(block),
                format!("a cycle without {what}"),
                format!("write {what}"),
            )
        };
        let length = |letter: u8, sticky: Option<f64>| match word(letter) {
            Some(word) => self.length_of(word, rules).map(Some),
            None => Ok(sticky),
        };
        let r = length(b'R', before.map(|c| c.r))?.ok_or_else(|| lacking("R"))?;
        let letter = axes::LETTERS[n];
        let depth = length(letter, before.map(|c| c.depth))?;
        let depth = depth.ok_or_else(|| lacking(&format!("{}, its depth", char::from(letter))))?;
        let q = length(b'Q', before.and_then(|c| c.q))?;
        let p = word(b'P').map(|w| w.value).or(before.and_then(|c| c.p));
        if matches!(code, 730 | 830) && q.is_none_or(|q| q <= 0.0) {
            return Err(lacking("Q, the depth of a peck, which is positive"));
        }
        if matches!(code, 820 | 860 | 890) && p.is_none() {
            return Err(lacking("P, the time at the bottom"));
        }
        if self.feed.is_none_or(|f| f <= 0.0) || self.feed_mode == FeedMode::InverseTime {
            return Err(Fault::new(
                self.axis_span(block),
                "a cycle without a feed per minute or revolution",
                "write F before it",
            ));
        }
        let repeat = match word(b'L') {
            Some(word) => whole(word)?,
            None => 1,
        };
        if repeat == 0 || repeat > 10_000 {
            return Err(Fault::new(
                word(b'L').map_or(0..block.end, Word::span),
                "a cycle that is done never or too often",
                "write L1 to L10000",
            ));
        }
        let first = self.target(block, rules, words & !(1 << n), false)?.at;
        let (r_at, bottom, by);
        if relative {
            by = std::array::from_fn(|i| first[i] - from[i]);
            r_at = from[n] + r;
            bottom = r_at + depth;
        } else {
            by = [0.0; COUNT];
            r_at = self.offsets.machine_axis(n, r);
            bottom = self.offsets.machine_axis(n, depth);
        }
        if bottom > r_at {
            return Err(Fault::new(
                self.axis_span(block),
                "a cycle whose depth is above R",
                "check R and the depth",
            ));
        }
        self.cycle = Some(Sticky {
            code,
            initial,
            r,
            depth,
            q,
            p,
        });
        Ok(Cycle {
            code,
            axes: plane,
            from,
            first,
            by,
            repeat,
            r: r_at,
            bottom,
            initial,
            retract: self.retract,
            q,
            p,
        })
    }
}

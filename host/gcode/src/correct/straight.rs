//! Straight moves: their corrected ends, and pieces where the correction bends them.

use super::piece::{Piece, Shape};
use super::{Backlash, Corrector};
use crate::axes::{NOTHING, PerLetter};
use crate::cut;
use crate::fault::Fault;
use crate::interpret::bits;
use crate::limits::Limits;
use crate::modal::Cutter;
use crate::moves::{Rate, Straight};
use crate::trace::{Lost, Node, Path};

/// What a bound of corrections may be, in parts of what is allowed: evaluation rounds in f32.
const SURELY: f64 = 0.9;

impl Corrector<'_> {
    /// G0, G1, G33: adds the pieces.
    pub(super) fn straight(
        &mut self,
        straight: &Straight,
        rate: Rate,
        pieces: &mut Vec<Piece>,
    ) -> Result<(), Fault> {
        let is_rapid = rate == Rate::Rapid && !straight.with_spindle;
        let shape = if is_rapid { Shape::Rapid } else { Shape::Feed };
        let (from, to) = (&straight.from, &straight.to);
        let held = self.held(straight, rate);
        let path = Path::Line(from.at, *to);
        let is_known = from.missing(self.tables.axes).is_none();
        let stands = is_known && path.by().iter().all(|by| by.abs() < NOTHING);
        if stands && self.joined {
            pieces.push(Piece::whole(shape, self.written.position.at));
            return Ok(());
        }
        // Of a rapid only the end matters, and only that is known where it comes from an unknown place.
        let is_end_alone = is_rapid || stands || !is_known;
        if is_end_alone || self.goes_on_without_cut(straight) {
            if !is_known {
                self.arrive(to)?;
            } else if is_end_alone {
                self.stretches(&path)?;
            }
            let end = self.end(to, held, is_rapid && straight.machine)?;
            // Where the program stands, a feed only leads onto the corrected path.
            let leads_on = stands && shape == Shape::Feed && !straight.with_spindle;
            pieces.push(match leads_on {
                true => Piece::step(end, 0.0),
                false => Piece::whole(shape, end),
            });
            return Ok(());
        }
        self.trace(&path)?;
        let limits = self.limits();
        let end = self.end(to, held, false)?;
        if straight.with_spindle {
            self.keeps_thread(&limits)?;
        } else if self.is_offset() && !self.may_be_cut() {
            self.note_cutter(&limits);
        } else {
            pieces.extend(self.runs(&self.field(), &path, &limits)?);
            let cuts = pieces.iter().filter(|p| p.share.is_some());
            self.report.cut += u64::from(cuts.count() > 1);
            return Ok(());
        }
        pieces.push(Piece::whole(shape, end));
        Ok(())
    }

    /// A thread is one move: its corrected path must be straight, and no axis reverse along it.
    fn keeps_thread(&self, limits: &Limits) -> Result<(), Fault> {
        let mut runs = self.traced.runs.iter();
        let reverses = runs.any(|(stretch, _)| stretch.travel != self.start_travel);
        if !reverses && cut::is_straight(&self.traced.nodes, limits) {
            return Ok(());
        }
        Err(Fault::of_motion(
            "a thread that would have to be cut into several moves",
            "give a larger --tolerance, or use the compensation in the controller",
        ))
    }

    /// The axes arrive at a place from an unknown one.
    fn arrive(&mut self, to: &PerLetter) -> Result<(), Lost> {
        let field = self.field();
        let q = field.axes(to)?;
        if self.axes_turn() {
            self.ways.come_to(self.tables, &field.middle(&q));
        }
        self.knows_directions()
    }

    /// True for a motion under cutter compensation, and for the one along which the path gets its offset or loses it.
    pub(super) fn is_offset(&self) -> bool {
        self.nominal.under != Cutter::Off
    }

    /// True if cuts change nothing but the correction: an offset that comes or goes would do so within the first piece.
    fn may_be_cut(&self) -> bool {
        self.options.cut_under_cutter && self.nominal.under != Cutter::Changes
    }

    /// True if a move certainly needs no cut, whatever corrections are along it; directions are those at its end then.
    fn goes_on_without_cut(&mut self, straight: &Straight) -> bool {
        let leave = self.options.backlash == Backlash::Leave && self.tables.directional != 0;
        let looks = leave || straight.with_spindle || self.is_offset() || self.nominal.tip;
        if looks || !self.joined {
            return false;
        }
        let by = std::array::from_fn(|i| (straight.to[i] - straight.from.at[i]).abs());
        if !self.bends_little(&by) {
            return false;
        }
        let at = self.field().middle(&straight.to);
        self.ways.goes_on(self.tables, &at)
    }

    /// True if corrections along a move by so much (not negative) certainly keep the straight line between their ends.
    fn bends_little(&mut self, by: &PerLetter) -> bool {
        // A bound grows with the way of each axis: what is within a move that is known to be straight is straight.
        let is_within = by.iter().zip(&self.uncut).all(|(by, most)| by <= most);
        if is_within {
            return true;
        }
        let limits = self.limits();
        let keeps = |by: &PerLetter| {
            limits.of_lengths(self.tables.bend.at_most(by)) <= SURELY
                && self.tables.keeps_straight(by)
        };
        if !keeps(by) {
            return false;
        }
        let both = std::array::from_fn(|i| by[i].max(self.uncut[i]));
        if keeps(&both) {
            self.uncut = both;
        }
        true
    }

    /// Axes (bits) that stay where they are during a rapid, without a word: those that neither the program has commanded
    /// yet nor this one has. Nobody knows where they stand when it runs.
    pub(super) fn held(&self, straight: &Straight, rate: Rate) -> u16 {
        if !matches!(rate, Rate::Rapid) || straight.with_spindle {
            return 0;
        }
        let moved = match straight.machine {
            true => straight.due,
            false => self.nominal.together(straight.due | self.written.commanded),
        };
        self.tables.axes & !moved
    }

    /// Axes that are held stay where they are.
    fn hold(&self, held: u16, node: &mut Node) {
        for axis in bits(held) {
            node.to[axis] = self.written.position.at[axis];
            if !self.nominal.tip {
                node.moved[axis] = node.to[axis];
            }
        }
    }

    /// The corrected end of a motion, by the directions that hold.
    pub(super) fn end(
        &mut self,
        to: &PerLetter,
        held: u16,
        retracts: bool,
    ) -> Result<PerLetter, Lost> {
        let field = self.field();
        let mut node = field.node(1.0, to, &self.ways.travel)?;
        self.hold(held, &mut node);
        if retracts {
            field.within_travel(&mut node);
        }
        field.reaches(&node)?;
        self.corrected(&node);
        Ok(node.to)
    }

    /// End points under cutter compensation: what it costs that their moves are not cut.
    fn note_cutter(&mut self, limits: &Limits) {
        self.report.under_cutter += 1;
        let nodes = &self.traced.nodes;
        let (Some(first), Some(last)) = (nodes.first(), nodes.last()) else {
            return;
        };
        let mut off = 0.0_f64;
        for node in nodes {
            let part: PerLetter = std::array::from_fn(|i| {
                node.to[i]
                    - node.q[i]
                    - (1.0 - node.t) * (first.to[i] - first.q[i])
                    - node.t * (last.to[i] - last.q[i])
            });
            off = off.max(limits.of(&part) * limits.linear);
        }
        self.report.under_cutter_off = self.report.under_cutter_off.max(off);
    }
}

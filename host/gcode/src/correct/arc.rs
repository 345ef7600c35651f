//! Arcs: one that is fitted to the corrected path where it keeps the tolerance, otherwise several.

use super::Corrector;
use super::piece::{Piece, Shape};
use crate::arc::Arc;
use crate::axes::PerLetter;
use crate::cut;
use crate::fault::Fault;
use crate::limits::Limits;
use crate::trace::{Lost, Node, Path};
use std::f64::consts::{PI, SQRT_2};
use trueaxis_model::numbers::by;

/// What is farther from an arc, in parts of the radius, is another figure, and the end of one its beginning.
const LARGEST: f64 = 0.1;
/// Bits of rotary axes: they take half of a tolerance.
const ROTARY: u16 = 0b111 << 3;
/// An arc under cutter compensation that is farther off is another one: in parts of the radius, and mm more.
const OTHER: [f64; 2] = [0.1, 0.01];
/// What rounding its two words moves a centre at most, in last digits.
const CENTRE: f64 = 0.5 * SQRT_2;
/// An arc is fitted to so many places within it, at least.
const PLACES: usize = 8;

/// A stretch of an arc while it is divided.
struct Dividing<'d> {
    arc: &'d Arc,
    /// The corrected place at a part of the way.
    place: &'d dyn Fn(f64) -> Result<Node, Lost>,
    /// The nodes of the stretch.
    nodes: &'d [Node],
    limits: &'d Limits,
    /// How far rounding its words moves a centre at most (mm), where limits have no reserve for it.
    centre: f64,
    /// How many chords it would become.
    chords: usize,
    /// Their sagitta (mm).
    sagitta: f64,
}

impl Corrector<'_> {
    /// G2, G3.
    pub(super) fn arc(&mut self, arc: &Arc) -> Result<Vec<Piece>, Fault> {
        let path = Path::Arc(*arc);
        self.trace(&path)?;
        let field = self.field();
        let [r0, r1] = arc.radii();
        // Where words have fewer decimals an arc begins so far beside its place.
        let begins = 0.4 * self.options.rounding(self.units());
        let limits = match self.uses_all() {
            true => self.limits().of_arcs(self.options.tolerance),
            false => self.limits(),
        };
        let limits = limits.plus(begins).within(LARGEST * r0.min(r1));
        if self.is_offset() {
            return self.in_one(arc, &limits);
        }
        let pieces = self.runs(&field, &path, &limits)?;
        let is_chord = |piece: &Piece| piece.share.is_some() && piece.shape == Shape::Feed;
        self.report.arcs[usize::from(pieces.iter().any(is_chord))] += 1;
        Ok(pieces)
    }

    /// True if arcs may use all that rounding leaves of the tolerance: what fewer decimals cost is added to the limits, and
    /// rotary axes turn what is between the nodes.
    fn uses_all(&self) -> bool {
        self.tables.axes & ROTARY == 0 && self.options.decimals.is_none()
    }

    /// An arc that must stay one: under cutter compensation, whatever that costs.
    fn in_one(&mut self, arc: &Arc, limits: &Limits) -> Result<Vec<Piece>, Fault> {
        let from = self.written.position.at;
        let nodes = &self.traced.nodes;
        let fitted = match self.nominal.tip {
            true => None,
            false => cut::fitted(arc, &from, nodes),
        };
        let off = fitted.map(|fitted| cut::off_arc(&fitted, nodes, limits) * limits.linear);
        // Ends of nearly a full turn say little of its centre.
        let most = OTHER[0] * arc.radii()[0] + OTHER[1];
        let (Some(fitted), Some(off)) = (fitted, off.filter(|off| *off <= most)) else {
            return Err(Fault::of_motion(
                "an arc under cutter compensation that cannot stay one",
                "write the path out without G41 and G42",
            ));
        };
        self.report.under_cutter += 1;
        self.report.under_cutter_off = self.report.under_cutter_off.max(off);
        self.report.arcs[0] += 1;
        Ok(vec![Piece::whole(Shape::Arc(fitted), fitted.to)])
    }

    /// Arcs along the nodes of a stretch, and chords where no arc keeps it; returns where they end.
    pub(super) fn arcs(
        &mut self,
        arc: &Arc,
        place: &dyn Fn(f64) -> Result<Node, Lost>,
        nodes: &[Node],
        from: PerLetter,
        limits: &Limits,
        pieces: &mut Vec<Piece>,
    ) -> Result<PerLetter, Lost> {
        let [r0, r1] = arc.radii();
        let sagitta = self.options.chord.min(LARGEST * r0.min(r1));
        let chord = 2.0 * libm::acos(1.0 - sagitta / r0.max(r1));
        let part = nodes[nodes.len() - 1].t - nodes[0].t;
        // An arc uses all of the tolerance, so that its deviation must be known between the nodes too.
        let mut close = Vec::with_capacity(2 * nodes.len());
        for pair in nodes.windows(2) {
            close.push(pair[0]);
            close.push(place(0.5 * (pair[0].t + pair[1].t))?);
        }
        close.push(nodes[nodes.len() - 1]);
        let dividing = Dividing {
            arc,
            place,
            nodes: &close,
            limits,
            centre: match self.uses_all() {
                true => CENTRE * self.options.resolution(0, self.units()),
                false => 0.0,
            },
            chords: (part * arc.sweep.abs() / chord).ceil().max(1.0) as usize,
            sagitta,
        };
        self.divide(&dividing, from, pieces)
    }

    /// A stretch as arcs, each as long as it keeps the path, and chords where none does.
    fn divide(
        &mut self,
        dividing: &Dividing<'_>,
        mut from: PerLetter,
        pieces: &mut Vec<Piece>,
    ) -> Result<PerLetter, Lost> {
        let mut begin = 0;
        while begin < dividing.chords {
            if let Some((end, piece)) = dividing.longest(begin, &from)? {
                pieces.push(piece);
                (begin, from) = (end, piece.to);
                continue;
            }
            let nodes = dividing.nodes([begin, begin + 1])?;
            let limits = dividing.limits.plus(dividing.sagitta);
            self.lines(&nodes, &limits, pieces);
            (begin, from) = (begin + 1, nodes[nodes.len() - 1].to);
        }
        Ok(from)
    }
}

impl Dividing<'_> {
    /// The longest arc that keeps the path from a chord on, and the chord at which it ends: the whole stretch, otherwise
    /// in strides that double while they hold, then in ones that halve. So of many turns each arc looks at what it may be,
    /// not at all that is left.
    fn longest(&self, begin: usize, from: &PerLetter) -> Result<Option<(usize, Piece)>, Lost> {
        if begin == 0
            && let Some(piece) = self.fit([begin, self.chords], from)?
        {
            return Ok(Some((self.chords, piece)));
        }
        let (mut good, mut step, mut grows) = (None, 1, true);
        while step > 0 {
            let at = good.map_or(begin, |(end, _)| end);
            let end = (at + step).min(self.chords);
            let fits = match end > at {
                true => self.fit([begin, end], from)?,
                false => break,
            };
            grows &= fits.is_some();
            good = fits.map(|piece| (end, piece)).or(good);
            step = if grows { 2 * step } else { (end - at) / 2 };
        }
        Ok(good)
    }

    /// The part from one chord to another as one arc, if it is one.
    fn fit(&self, [a, b]: [usize; 2], from: &PerLetter) -> Result<Option<Piece>, Lost> {
        let nodes = self.nodes([a, b])?;
        let fitted = cut::fitted(self.arc, from, &nodes);
        let fitted = fitted.filter(|fitted| {
            // The ends stay, so the arc bulges by what its centre moves: nothing at its ends, twice as much opposite.
            let half = (0.5 * fitted.sweep.abs()).min(PI);
            let bulge = self.centre * (1.0 - libm::cos(half));
            let limits = self.limits.within((self.limits.linear - bulge).max(0.0));
            cut::off_arc(fitted, &nodes, &limits) <= 1.0
        });
        let (first, last) = (&nodes[0], &nodes[nodes.len() - 1]);
        Ok(fitted.map(|fitted| Piece {
            shape: Shape::Arc(fitted),
            to: fitted.to,
            until: last.t,
            share: Some(last.t - first.t),
        }))
    }

    /// Corrected places from one chord to another.
    fn nodes(&self, [a, b]: [usize; 2]) -> Result<Vec<Node>, Lost> {
        let [first, last] = [&self.nodes[0], &self.nodes[self.nodes.len() - 1]];
        let end = |chord: usize| match chord {
            0 => Ok(*first),
            chord if chord == self.chords => Ok(*last),
            chord => (self.place)(first.t + (last.t - first.t) * chord as f64 / self.chords as f64),
        };
        let (begin, end) = (end(a)?, end(b)?);
        let [after, before] = [
            self.nodes.partition_point(|node| node.t <= begin.t),
            self.nodes.partition_point(|node| node.t < end.t),
        ];
        let within = self.nodes.get(after..before).unwrap_or_default();
        let mut nodes = Vec::with_capacity(within.len() + PLACES + 2);
        nodes.push(begin);
        nodes.extend_from_slice(within);
        if within.len() < PLACES {
            for k in 1..=PLACES {
                let part = k as f64 / (PLACES + 1) as f64;
                nodes.push((self.place)(begin.t + part * (end.t - begin.t))?);
            }
            nodes = by(nodes, |node| node.t);
        }
        nodes.push(end);
        Ok(nodes)
    }
}

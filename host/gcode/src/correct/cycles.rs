//! Canned cycles: shifted as a whole by the correction at the bottom of the hole, single moves where that does not hold.

mod shifted;
mod written_out;

use super::Corrector;
use super::given::Given;
use crate::axes::PerLetter;
use crate::cycle::{Cycle, Part};
use crate::fault::Fault;
use crate::interpret::bits;
use crate::limits::displacement;
use crate::modal::{Retract, Spindle};
use crate::trace::{Field, Lost, Node};
use crate::travel_directions::TravelDirections;

/// Heights at which a hole is looked at, besides its bottom.
const HEIGHTS: usize = 8;

/// A hole of a cycle.
struct Hole {
    /// Corrected bottom of the hole.
    bottom: Node,
    /// How far any place in it is off, if the hole is shifted by the correction of its bottom (mm).
    off: f64,
}

impl Corrector<'_> {
    pub(super) fn cycle(&mut self, given: &Given<'_>, cycle: &Cycle) -> Result<(), Fault> {
        let field = self.field();
        let before = self.ways.clone();
        let holes = self.holes(&field, cycle)?;
        self.knows_directions()?;
        let off = holes.iter().map(|hole| hole.off).fold(0.0, f64::max);
        let keeps_place = off <= self.options.hole_tolerance;
        if keeps_place && self.keeps_level(cycle, &holes) {
            self.report.cycles[0] += 1;
            self.report.holes_off = self.report.holes_off.max(off);
            // Above the hole it has the correction of the bottom.
            self.joined = false;
            return self.shifted(given, cycle, &holes);
        }
        let why = self.why_written_out(off);
        let code = cycle.code / 10;
        let Some(parts) = cycle.parts() else {
            return Err(Fault::of_motion(
                format!("G{code} cannot be written out, and {why}"),
                "give a larger --hole-tolerance, or use the compensation in the controller",
            ));
        };
        if parts.contains(&Part::SpindleStops) {
            self.needs_spindle(cycle, &why)?;
        }
        self.report.write_out(self.line, format!("G{code}: {why}"));
        self.ways = before;
        self.write_out(given, cycle, &parts)
    }

    /// Why a cycle does not stay one whose places are so far off (mm).
    fn why_written_out(&self, off: f64) -> String {
        let most = self.options.hole_tolerance;
        match off <= most {
            true => "the level to which it returns is another one than that before it".to_owned(),
            false => format!(
                "the correction changes by {:.1} µm along it, more than the {:.1} µm of --hole-tolerance",
                off * 1e3,
                most * 1e3
            ),
        }
    }

    /// What stops the spindle starts it again: it must be known how.
    fn needs_spindle(&self, cycle: &Cycle, why: &str) -> Result<(), Fault> {
        match self.nominal.spindle {
            Some(Spindle::Clockwise | Spindle::Counterclockwise) => Ok(()),
            Some(Spindle::Stands) | None => Err(Fault::of_motion(
                format!(
                    "{why}, and G{} is written out only where the spindle is known to turn",
                    cycle.code / 10
                ),
                "write M3 or M4 before it, after the last tool change, or give a larger --hole-tolerance",
            )),
        }
    }

    /// The holes of a cycle, each with the directions of travel on its way down. Afterwards the directions are those at the
    /// end of the cycle.
    fn holes(&mut self, field: &Field<'_>, cycle: &Cycle) -> Result<Vec<Hole>, Lost> {
        let mut holes = Vec::new();
        let mut ways = self.ways.clone();
        for at in cycle.holes() {
            let hole = hole(field, cycle, &at, &mut ways)?;
            field.reaches(&hole.bottom)?;
            self.corrected(&hole.bottom);
            holes.push(hole);
        }
        self.ways = ways;
        Ok(holes)
    }

    /// False if the cycle cannot go on with its series, and would not return to the level any more that was before that.
    fn keeps_level(&self, cycle: &Cycle, holes: &[Hole]) -> bool {
        let level = |initial: f64| initial.max(cycle.r);
        let goes_on = self.written.cycle.is_some()
            && holes.iter().all(|hole| self.outside(cycle, hole).is_none());
        let begins = self.written.cycle.is_none() && cycle.from[cycle.axes[2]] == cycle.initial;
        let same = level(cycle.from[cycle.axes[2]]) == level(cycle.initial);
        goes_on || begins || cycle.retract == Retract::Plane || same
    }

    /// Where rotary axes and others outside the plane have to go before the hole, if they do not stand there.
    fn outside(&self, cycle: &Cycle, hole: &Hole) -> Option<PerLetter> {
        let here = self.written.position.at;
        let mut off = [0.0; crate::axes::COUNT];
        for axis in bits(self.tables.axes).filter(|axis| !cycle.axes.contains(axis)) {
            off[axis] = hole.bottom.to[axis] - here[axis];
        }
        self.is_beside(&off, &self.limits())
            .then(|| std::array::from_fn(|i| here[i] + off[i]))
    }
}

/// The hole at a place; directions go down into it and out again.
fn hole(
    field: &Field<'_>,
    cycle: &Cycle,
    at: &PerLetter,
    ways: &mut TravelDirections,
) -> Result<Hole, Lost> {
    let place = |height: f64| {
        let mut place = *at;
        place[cycle.axes[2]] = height;
        place
    };
    let come = |ways: &mut TravelDirections, height: f64| {
        if field.turns {
            ways.come_to(field.tables, &field.middle(&place(height)));
        }
    };
    let normal = cycle.axes[2];
    come(ways, at[normal].max(cycle.r));
    come(ways, cycle.bottom);
    let bottom = field.node(1.0, &place(cycle.bottom), &ways.travel)?;
    let mut off = 0.0_f64;
    let mut look = |ways: &TravelDirections, is_out: bool| -> Result<(), Lost> {
        for k in 0..=HEIGHTS {
            let part = k as f64 / HEIGHTS as f64;
            let node = field.node(
                1.0,
                &place(cycle.r + (cycle.bottom - cycle.r) * part),
                &ways.travel,
            )?;
            let mut by: PerLetter =
                std::array::from_fn(|i| (node.to[i] - node.q[i]) - (bottom.to[i] - bottom.q[i]));
            if is_out {
                // Out again it is at the same place, but for where along its axis it has come.
                by[normal] = 0.0;
            }
            off = off.max(displacement(&by));
        }
        Ok(())
    };
    look(ways, false)?;
    come(ways, cycle.clear());
    if cycle.feeds_out() {
        look(ways, true)?;
    }
    Ok(Hole { bottom, off })
}

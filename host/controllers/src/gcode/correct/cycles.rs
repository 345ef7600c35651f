//! Canned cycles: corrected words where that is right, single moves where it is not.

mod shifted;
mod written_out;

use super::Corrector;
use super::feed::TIMES;
use super::given::{Given, Moving};
use crate::gcode::axes::PerLetter;
use crate::gcode::cycle::{Cycle, Part};
use crate::gcode::fault::Fault;
use crate::gcode::interpret::bits;
use crate::gcode::modal::{Distance, Retract, Spindle, Units};
use crate::gcode::number;
use crate::gcode::trace::{Field, Lost, Node};

/// Heights at which a hole is looked at.
const HEIGHTS: usize = 9;

/// Half of the last digit of two words (mm).
const DIGIT: f64 = 1e-4;

impl Corrector<'_> {
    pub(super) fn cycle(
        &mut self,
        given: &Given<'_>,
        cycle: &Cycle,
        moving: &Moving,
        out: &mut Vec<u8>,
    ) -> Result<(), Fault> {
        let single = cycle.repeat == 1 && self.written_out != Some(cycle.code);
        let straight = self.tables.directional & (1 << cycle.axes[2]) == 0
            && !self.nominal.offsets.is_turned()
            && self.nominal.distance == Some(Distance::Absolute);
        let field = self.field();
        let (mut stays, mut takes) = (single && straight, None);
        if stays {
            let keeps = || Ok(self.feeds_to_r(&field, cycle)? && self.is_constant(&field, cycle)?);
            stays = keeps().map_err(|lost| moving.lost(lost))?;
            if stays {
                takes = self
                    .takes_otherwise(&field, cycle)
                    .map_err(|lost| moving.lost(lost))?;
                stays = takes.is_none();
            }
        }
        let in_series = self.written.cycle.is_some() || self.written_out.is_none();
        if stays && in_series && self.keeps_level(&field, cycle, moving)? {
            self.written_out = None;
            self.report.cycles[0] += 1;
            // Above the hole it has the correction of the bottom.
            self.joined = false;
            return self.shifted(given, cycle, moving, out);
        }
        let Some(parts) = cycle.parts() else {
            let code = cycle.code / 10;
            let (cause, remedy) = match takes {
                Some([planned, now]) => (
                    format!(
                        "G{code} would feed {now:.4} mm in the place of {planned:.4} mm, more than {} % of its time, and \
                         cannot be written out",
                        TIMES * 100.0
                    ),
                    "write G99, or use the compensation in the controller",
                ),
                None => (
                    format!(
                        "the correction changes over this hole, and G{code} cannot be written out"
                    ),
                    "give a larger --tolerance, or use the compensation in the controller",
                ),
            };
            return Err(Fault::new(moving.span.clone(), cause, remedy));
        };
        if parts.contains(&Part::SpindleStops) {
            self.needs_spindle(cycle, moving)?;
        }
        self.written_out = Some(cycle.code);
        self.report.cycles[1] += 1;
        self.write_out(given, cycle, &parts, moving, out)
    }

    /// What stops the spindle starts it again: it must be known how.
    fn needs_spindle(&self, cycle: &Cycle, moving: &Moving) -> Result<(), Fault> {
        match self.nominal.spindle {
            Some(Spindle::Clockwise | Spindle::Counterclockwise) => Ok(()),
            Some(Spindle::Stands) | None => Err(Fault::new(
                moving.span.clone(),
                format!(
                    "the correction changes over this hole, and G{} is written out only where the spindle is known \
                     to turn",
                    cycle.code / 10
                ),
                "write M3 or M4 before it, after the last tool change",
            )),
        }
    }

    /// False if the cycle needs a line before it, which ends its series, and would not return to the level any more that
    /// was before that.
    fn keeps_level(
        &self,
        field: &Field<'_>,
        cycle: &Cycle,
        moving: &Moving,
    ) -> Result<bool, Fault> {
        let level = |initial: f64| initial.max(cycle.r);
        let from = cycle.from[cycle.axes[2]];
        if cycle.retract == Retract::Plane || level(from) == level(cycle.initial) {
            return Ok(true);
        }
        let bottom = self.in_hole(field, cycle, cycle.bottom);
        let bottom = bottom.map_err(|lost| moving.lost(lost))?;
        Ok(self.outside(cycle, &bottom.to).is_none())
    }

    /// Where rotary axes and others outside the plane have to go before the hole, if they do not stand there.
    fn outside(&self, cycle: &Cycle, to: &PerLetter) -> Option<PerLetter> {
        let mut before = self.written.position.at;
        let mut moves = false;
        for axis in bits(self.tables.axes).filter(|axis| !cycle.axes.contains(axis)) {
            let finest = number::finest(number::decimals(axis, Units::Millimetre));
            if (to[axis] - before[axis]).abs() >= finest {
                before[axis] = to[axis];
                moves = true;
            }
        }
        moves.then_some(before)
    }

    /// False for G89 that feeds out beyond R, to the level before its series: what is corrected there is not the hole. Two
    /// that are the same become two that are not, where the correction of the level is that of another place.
    fn feeds_to_r(&self, field: &Field<'_>, cycle: &Cycle) -> Result<bool, Lost> {
        if !cycle.feeds_to_level() {
            return Ok(true);
        }
        let bottom = self.in_hole(field, cycle, cycle.bottom)?;
        let level = self.level(cycle, &bottom.to);
        let top = self.in_hole(field, cycle, cycle.r)?.to[cycle.axes[2]];
        Ok(cycle.clear() <= cycle.r && level - top + DIGIT <= self.options.tolerance)
    }

    /// Where the corrected program is before the series of a cycle with this bottom.
    fn level(&self, cycle: &Cycle, bottom: &PerLetter) -> f64 {
        let series = self.written.cycle.map(|written| written.initial);
        let stays = series.filter(|_| self.outside(cycle, bottom).is_none());
        stays.unwrap_or(self.written.position.at[cycle.axes[2]])
    }

    /// `None` if its feeds take as long as those of the program; otherwise how far (mm) one of them goes there, and
    /// corrected. Down and out of a thread are one.
    fn takes_otherwise(&self, field: &Field<'_>, cycle: &Cycle) -> Result<Option<[f64; 2]>, Lost> {
        let bottom = self.in_hole(field, cycle, cycle.bottom)?.to;
        let top = self.in_hole(field, cycle, cycle.r)?.to[cycle.axes[2]];
        let level = match cycle.retract {
            Retract::Initial => self.level(cycle, &bottom).max(top),
            Retract::Plane => top,
        };
        let [planned, now] = [
            [cycle.r - cycle.bottom, cycle.clear() - cycle.r],
            [top - bottom[cycle.axes[2]], level - top],
        ];
        let feeds = |[depth, out]: [f64; 2]| match cycle.code {
            890 if cycle.feeds_to_level() => [depth, depth + out],
            _ if cycle.parts().is_none() => [2.0 * depth + out; 2],
            _ => [depth; 2],
        };
        let mut pairs = feeds(planned).into_iter().zip(feeds(now));
        let differs = |[planned, now]: &[f64; 2]| {
            *planned > 0.0 && (now - planned).abs() + 2.0 * DIGIT > TIMES * planned
        };
        Ok(pairs.find_map(|(planned, now)| Some([planned, now]).filter(differs)))
    }

    /// True if one correction across the hole, and one straight line along it, hold over its depth.
    fn is_constant(&self, field: &Field<'_>, cycle: &Cycle) -> Result<bool, Lost> {
        let limits = self.limits();
        let n = cycle.axes[2];
        let bottom = self.in_hole(field, cycle, cycle.bottom)?;
        let top = self.in_hole(field, cycle, cycle.r)?;
        for k in 0..HEIGHTS {
            let part = k as f64 / HEIGHTS as f64;
            let node = self.in_hole(field, cycle, cycle.r + (cycle.bottom - cycle.r) * part)?;
            let mut off: PerLetter =
                std::array::from_fn(|i| (node.to[i] - node.q[i]) - (bottom.to[i] - bottom.q[i]));
            off[n] = node.to[n] - top.to[n] - part * (bottom.to[n] - top.to[n]);
            if limits.of(&off) > 1.0 {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The corrected position in the first hole of a cycle.
    fn in_hole(&self, field: &Field<'_>, cycle: &Cycle, height: f64) -> Result<Node, Lost> {
        let mut hole = cycle.first;
        hole[cycle.axes[2]] = height;
        let mut ways = self.ways.clone();
        if self.axes_turn() {
            ways.come_to(self.tables, &hole);
        }
        let node = field.node(1.0, &hole, &ways)?;
        field.reaches(&node)?;
        Ok(node)
    }
}

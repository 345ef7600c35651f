//! Whether a motion arrives where another one does.

use super::CheckError;
use crate::gcode::axes::{COUNT, PerLetter, is_rotary};
use crate::gcode::correct::Options;
use crate::gcode::interpret::bits;
use crate::gcode::moves::Rate;
use crate::gcode::program::{Event, Program, Segment};
use crate::gcode::trace::Path;
use std::f64::consts::TAU;
use std::io::BufRead;

/// How near it must arrive: half of the last digit that is written, of all axes together (mm, degrees).
pub(super) const NEAR: [f64; 2] = [1.5e-4, 2e-5];

/// What rounding words leaves, in parts of that, and a little more.
pub(super) const ROUNDED: f64 = 0.4;

/// Whether a written motion ends where one of the program does. A cycle that stays one has the correction of its
/// bottom everywhere: within the tolerance while it feeds, and over the hole as it comes. A full turn ends where it
/// began, as far as the tolerance lets it.
pub(super) fn arrives(
    segment: &Segment,
    written: &Segment,
    at: &PerLetter,
    end: &PerLetter,
    options: &Options,
) -> bool {
    if !(segment.in_cycle && written.in_cycle) {
        let is_full = matches!(written.path, Path::Arc(arc) if arc.sweep.abs() > 0.999 * TAU);
        let allowed = match is_full {
            true => [options.tolerance + NEAR[0], NEAR[1]],
            false => NEAR,
        };
        let mut due = bits(segment.due | written.due);
        return due.all(|i| (at[i] - end[i]).abs() <= allowed[usize::from(is_rotary(i))]);
    }
    let allowed = match segment.rate {
        Rate::Rapid => OVER_HOLE,
        _ if segment.above => OVER_HOLE,
        _ => options.tolerance + 2.0 * NEAR[0],
    };
    (segment.rate == Rate::Rapid) == (written.rate == Rate::Rapid)
        && segment.above == written.above
        && (0..COUNT).all(|i| (at[i] - end[i]).abs() <= allowed)
}

/// How far a rapid within a cycle may end from its own correction (mm): what corrections may differ over a hole.
const OVER_HOLE: f64 = 0.5;

/// True if it is a motion of a cycle over its hole that goes no farther than corrections differ: to the place of a hole,
/// to its R, or from there to the level before the series, where the program has no motion, for there both are the same.
pub(super) fn over_hole(written: &Segment) -> bool {
    let by = written.path.by();
    let is_over = written.rate == Rate::Rapid || written.above;
    written.in_cycle && is_over && by.iter().all(|by| by.abs() <= OVER_HOLE)
}

/// True if a cycle that stays one has no motion for one of the program: one that goes no farther than corrections
/// differ, up to an R that is the level already once both are corrected. `at` is where the corrected program stands, and
/// `in_cycle` is true if its last motion was one of a cycle: where cycles are written out each motion has its own.
pub(super) fn is_needless<R: BufRead>(
    segment: &Segment,
    after: &mut Program<'_, R>,
    (at, in_cycle): (&PerLetter, bool),
    end: &PerLetter,
    options: &Options,
) -> Result<bool, CheckError> {
    if !over_hole(segment) || (0..COUNT).any(|i| (at[i] - end[i]).abs() > OVER_HOLE) {
        return Ok(false);
    }
    let Some(Event::Moved(next)) = after.peek().map_err(CheckError::Corrected)? else {
        // The last motion, or the last before one that passes.
        return Ok(in_cycle);
    };
    let stays = in_cycle || next.in_cycle || is_before_cycle(segment, &next);
    Ok(stays && !arrives(segment, &next, &next.to(), end, options))
}

/// True for axes outside a cycle that go to its hole before it, in a line of their own.
pub(super) fn is_before_cycle(segment: &Segment, written: &Segment) -> bool {
    let by = written.path.by();
    let stays = (0..3).all(|i| by[i] == 0.0);
    segment.in_cycle && !written.in_cycle && written.rate == Rate::Rapid && stays
}

/// `None` if it is near enough; otherwise the axis that is farthest off, and by how much.
pub(super) fn near(at: &PerLetter, end: &PerLetter) -> Option<(usize, f64)> {
    near_in(u16::MAX, at, end)
}

/// The same of some axes (bits).
pub(super) fn near_in(due: u16, at: &PerLetter, end: &PerLetter) -> Option<(usize, f64)> {
    let off = bits(due).map(|i| (i, off_by(i, at, end)));
    let (axis, off) = off.max_by(|a, b| a.1.total_cmp(&b.1))?;
    (off > 1.0).then(|| (axis, off * NEAR[usize::from(is_rotary(axis))]))
}

/// How far some axes (bits) are off at most, in parts of what is near enough.
pub(super) fn off(due: u16, at: &PerLetter, end: &PerLetter) -> f64 {
    bits(due).map(|i| off_by(i, at, end)).fold(0.0, f64::max)
}

fn off_by(axis: usize, at: &PerLetter, end: &PerLetter) -> f64 {
    (at[axis] - end[axis]).abs() / NEAR[usize::from(is_rotary(axis))]
}

/// True if a motion is written only because words are rounded: it goes no farther than where it is near enough, and the
/// last digits of its words.
pub(super) fn is_tiny(written: &Segment) -> bool {
    matches!(written.path, Path::Line(..)) && no_farther(&written.path, 1.5)
}

/// True if nothing need be written for a motion of the program: all that becomes tiny, as its words are rounded once
/// more.
pub(super) fn stands(segment: &Segment) -> bool {
    no_farther(&segment.path, 2.5)
        && match &segment.path {
            Path::Arc(arc) => arc.length() < 2.5 * NEAR[0],
            Path::Line(..) => true,
        }
}

fn no_farther(path: &Path, times: f64) -> bool {
    let by = path.by();
    (0..COUNT).all(|i| by[i].abs() < times * NEAR[usize::from(is_rotary(i))])
}

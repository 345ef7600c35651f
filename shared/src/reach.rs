//! How far the inputs of a compensation may go, computed once at load.

use crate::contents::Contents;
use crate::description::{AUXILIARIES, AuxiliaryKind, Direction};
use crate::guard::{larger, smaller};
use crate::inputs::Inputs;
use crate::room::{List, Room};

/// Maximum distance of an input from 0, in periods of an endless axis or of a modulo table. Beyond it, f32 no longer
/// resolves the position within the turn.
pub const MOST_PERIODS: f32 = 8192.0;

/// Limits of the inputs, and which inputs matter.
#[derive(Clone)]
pub(crate) struct Reach<C: Room> {
    /// Limit of each axis.
    pub axes: C::AxisList<f32>,
    auxiliaries: [f32; AUXILIARIES],
    /// Range of the tables of each temperature that matters; without end for other auxiliaries.
    pub ranges: [[f32; 2]; AUXILIARIES],
    /// All axes, bit 0 is the first.
    pub all_axes: u16,
    /// Axes that feed an active term or a grid, bit 0 is the first.
    pub used_axes: u16,
    /// Axes with direction-dependent tables.
    pub directional: u16,
    /// Auxiliaries that feed an active term or a grid.
    pub used_auxiliaries: u8,
    /// Auxiliaries that are temperatures.
    pub temperatures: u8,
    /// Those that feed something, and temperatures.
    pub watched: u8,
}

impl<C: Room> Reach<C> {
    pub(crate) const EMPTY: Self = Self {
        axes: C::AxisList::EMPTY,
        auxiliaries: [0.0; AUXILIARIES],
        ranges: [[0.0; 2]; AUXILIARIES],
        all_axes: 0,
        used_axes: 0,
        directional: 0,
        used_auxiliaries: 0,
        temperatures: 0,
        watched: 0,
    };

    /// Finds the limits for these contents. `used`: one bit per input (axes, then auxiliaries) on which a correction
    /// depends.
    pub(crate) fn find(contents: &Contents<'_, C>, used: u32) -> Self {
        let mut reach = Self::EMPTY;
        reach.auxiliaries = [f32::MAX; AUXILIARIES];
        reach.ranges = [[-f32::MAX, f32::MAX]; AUXILIARIES];
        let axes = contents.axes.len();
        reach.all_axes = ((1_u32 << axes) - 1) as u16;
        reach.used_axes = (used & ((1 << axes) - 1)) as u16;
        reach.used_auxiliaries = (used >> axes) as u8;
        for (number, auxiliary) in contents.auxiliaries.iter().enumerate() {
            reach.temperatures |= u8::from(auxiliary.kind == AuxiliaryKind::Temperature) << number;
        }
        reach.watched = reach.used_auxiliaries | reach.temperatures;
        for bank in contents.banks.iter() {
            if bank.direction != Direction::Both {
                reach.directional |= 1 << bank.input;
            }
        }
        reach.find_ranges(contents);
        for axis in contents.axes.iter() {
            reach.axes.append(if axis.period > 0.0 {
                MOST_PERIODS * axis.period
            } else {
                f32::MAX
            });
        }
        let banks = contents
            .banks
            .iter()
            .map(|b| (b.input, b.points, b.step, b.modulo));
        let grids = contents.grids.iter().flat_map(|grid| &grid.axes);
        let all = banks.chain(grids.map(|a| (a.input, a.points, a.step, a.modulo)));
        for (input, points, step, _) in all.filter(|&(.., modulo)| modulo) {
            let period = points as f32 * step;
            let input = usize::from(input);
            let limit = match input.checked_sub(axes) {
                Some(auxiliary) => &mut reach.auxiliaries[auxiliary],
                None => &mut reach.axes[input],
            };
            *limit = limit.min(MOST_PERIODS * period);
        }
        reach
    }

    /// The range in which all tables and grids of a temperature have no end yet.
    fn find_ranges(&mut self, contents: &Contents<'_, C>) {
        let axes = contents.axes.len();
        let banks = contents.banks.iter().filter(|b| !b.modulo);
        let banks = banks.map(|b| (b.input, b.start, b.end()));
        let grids = contents.grids.iter().flat_map(|grid| &grid.axes);
        let grids = grids.filter(|a| !a.modulo);
        let grids = grids.map(|a| {
            let end = a.start + a.points.saturating_sub(1) as f32 * a.step;
            (a.input, a.start, end)
        });
        for (input, start, end) in banks.chain(grids) {
            let Some(number) = usize::from(input).checked_sub(axes) else {
                continue;
            };
            let auxiliary = contents.auxiliaries.get(number);
            let is_temperature = auxiliary.is_some_and(|a| a.kind == AuxiliaryKind::Temperature);
            if is_temperature && self.used_auxiliaries >> number & 1 != 0 {
                // Without an index, which could panic as far as the compiler knows.
                if let Some([low, high]) = self.ranges.get_mut(number) {
                    *low = larger(*low, start);
                    *high = smaller(*high, end);
                }
            }
        }
    }

    /// Whether the axes that are used or referenced (bit 0 is the first) are within reach.
    pub(crate) fn holds_axes(&self, inputs: &Inputs<C::Axes<f32>>, referenced: u16) -> bool {
        let mut matters = self.used_axes | referenced;
        for (&q, &limit) in inputs.axes.as_ref().iter().zip(self.axes.iter()) {
            if matters & 1 != 0 && !near(q, limit) {
                return false;
            }
            matters >>= 1;
        }
        true
    }

    /// Whether all auxiliaries that matter are finite, within reach, and not among the `bad` ones.
    #[inline(never)]
    pub(crate) fn holds_auxiliaries(&self, inputs: &Inputs<C::Axes<f32>>, bad: u8) -> bool {
        self.used_auxiliaries == 0 || (self.used_auxiliaries & bad == 0 && self.holds_used(inputs))
    }

    #[inline(always)]
    fn holds_used(&self, inputs: &Inputs<C::Axes<f32>>) -> bool {
        let mut holds = true;
        let mut used = self.used_auxiliaries;
        for (&x, &limit) in inputs.auxiliaries.iter().zip(&self.auxiliaries) {
            if used == 0 {
                break;
            }
            holds &= used & 1 == 0 || near(x, limit);
            used >>= 1;
        }
        holds
    }

    /// Whether two sets of auxiliaries are bitwise identical in the entries that matter, apart from temperatures.
    #[inline(never)]
    pub(crate) fn same_lengths(&self, a: &[f32; AUXILIARIES], b: &[f32; AUXILIARIES]) -> bool {
        let mut same = true;
        let mut used = self.used_auxiliaries & !self.temperatures;
        for (a, b) in a.iter().zip(b) {
            if used == 0 {
                break;
            }
            same &= used & 1 == 0 || a.to_bits() == b.to_bits();
            used >>= 1;
        }
        same
    }
}

/// False for NaN.
fn near(x: f32, limit: f32) -> bool {
    x <= limit && x >= -limit
}

#[cfg(all(test, feature = "encode"))]
mod tests {
    use alloc::vec;

    use super::*;
    use crate::room::Holds;
    use crate::specimen::{bank, bare, everything, term};
    use crate::{AlignedBlob, Compensation};

    type C<'a> = Compensation<'a, Holds<4, 4, 4, 4, 1>>;

    /// Tables with a modulo of 360 over the last axis and 8 over the second of two auxiliaries; only these two inputs
    /// are used.
    fn blob() -> AlignedBlob {
        let mut draft = bare();
        draft.auxiliaries = vec![everything().auxiliaries[0].clone(); 2];
        let modulo = |input, step| {
            let mut bank = bank(input, 0.0, step, vec![vec![0.0, 0.1, 0.0, -0.1]]);
            bank.modulo = true;
            bank
        };
        draft.banks = vec![modulo(2, 90.0), modulo(4, 2.0)];
        draft.terms = vec![term(0, 1.0, &[0]), term(0, 1.0, &[1])];
        draft.encode().unwrap()
    }

    #[test]
    fn axes_that_are_used_or_referenced_are_within_reach() {
        let blob = blob();
        let c = C::from_blob(&blob).unwrap();
        let most = MOST_PERIODS * 360.0;
        let holds = |axes: [f32; 3], referenced| {
            let [x, y, z] = axes;
            // The capacity includes an axis that the compensation does not have.
            let inputs = Inputs::at([x, y, z, f32::NAN]);
            c.reach().holds_axes(&inputs, referenced)
        };
        for referenced in [0b000, 0b011, 0b111] {
            for (axes, expected) in [
                ([1e9, -1e9, most], true),
                ([1e9, -1e9, -most], true),
                ([0.0, 0.0, most.next_up()], false),
                ([0.0, 0.0, -most.next_up()], false),
                ([f32::NAN, f32::INFINITY, 0.0], referenced & 0b011 == 0),
                ([0.0, 0.0, f32::NAN], false),
            ] {
                assert_eq!(
                    holds(axes, referenced),
                    expected,
                    "{axes:?}, {referenced:b}"
                );
            }
        }
        // While unused, it matters only if it is referenced.
        let mut draft = bare();
        draft.axes[1].travel = [-f32::MAX, f32::MAX];
        draft.axes[1].period = 360.0;
        let blob = draft.encode().unwrap();
        let c = C::from_blob(&blob).unwrap();
        let inputs = Inputs::at([1e9, 1e9, 1e9, f32::NAN]);
        for (referenced, expected) in [(0b000, true), (0b101, true), (0b010, false)] {
            assert_eq!(c.reach().holds_axes(&inputs, referenced), expected);
        }
    }

    #[test]
    fn auxiliaries_that_are_used_are_within_reach() {
        let blob = blob();
        let c = C::from_blob(&blob).unwrap();
        let most = MOST_PERIODS * 8.0;
        for (first, second, expected) in [
            (f32::NAN, most, true),
            (f32::NAN, -most, true),
            (0.0, most.next_up(), false),
            (0.0, -most.next_up(), false),
            (0.0, f32::NAN, false),
        ] {
            let mut inputs = Inputs::at([0.0; 4]);
            inputs.auxiliaries = [f32::NAN; AUXILIARIES];
            inputs.auxiliaries[..2].copy_from_slice(&[first, second]);
            assert_eq!(c.reach().holds_auxiliaries(&inputs, 0), expected);
        }
    }
}

//! A validated compensation, ready to be evaluated.

use core::fmt;

use crate::blob;
use crate::contents::Contents;
use crate::description::{Auxiliary, Axis, Bank, Grid, Policy, SampleFormat};
use crate::format::HEADER;
use crate::header::{self, Held};
use crate::inputs::{Inputs, Travel, Travelling};
use crate::kernel;
use crate::load_error::LoadError;
use crate::magnitude;
use crate::plan::{FIXED, Plan};
use crate::reach::Reach;
use crate::room::{List, Room, Row, Usual};
use crate::weights::Weights;
use crate::work;

/// Tables, terms and grids that turn positions into corrections. The samples stay in the blob.
///
/// Only [`load`](Self::load), [`load_slot`](Self::load_slot) and [`decode`](Self::decode) fill one, and they check
/// everything: evaluation cannot fail or panic, and needs no further checks.
///
/// `C` states the capacities: see [`Holds`](crate::Holds).
// `repr(C)`: the fields read by every evaluation come first, within reach of single instructions.
#[derive(Clone)]
#[repr(C)]
pub struct Compensation<'a, C: Room = Usual> {
    plan: Plan<'a, C>,
    reach: Reach<C>,
    contents: Contents<'a, C>,
    /// Length of the blob in bytes.
    length: u32,
    /// Largest magnitude of each table.
    peaks: C::TableList<f32>,
}

/// A term as stored, see [`Term`](crate::Term).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TermView<'c> {
    /// Index of the output axis.
    pub output: u8,
    /// Stored weight.
    pub weight: f32,
    /// Lower and upper limit of the weight if it is adjustable.
    pub limits: Option<[f32; 2]>,
    /// Indices of the tables, in the order of multiplication.
    pub factors: &'c [u8],
}

impl<'a, C: Room> Compensation<'a, C> {
    /// An empty compensation: no axes, all corrections zero. Meant for a `static` or a `Box` to load into. It is all
    /// zero bytes, so a `static` takes no flash.
    #[must_use]
    pub const fn empty() -> Self {
        // Capacities that exceed the masks or index types fail to compile.
        const { assert!(C::AXES + C::BANKS + C::TABLES + C::TERMS + C::GRIDS > 0) };
        Self {
            plan: Plan::EMPTY,
            reach: Reach::EMPTY,
            contents: Contents::EMPTY,
            length: 0,
            peaks: C::TableList::EMPTY,
        }
    }

    /// Makes `self` [empty](Self::empty) in place.
    #[inline(never)]
    fn clear(&mut self) {
        self.plan.clear();
        self.reach = Reach::EMPTY;
        self.contents.clear();
        self.length = 0;
        self.peaks.clear();
    }

    /// Reads a file: `blob` must have exactly the stated length and start at a multiple of 4 bytes.
    ///
    /// The samples are used in place. On error `self` is left [empty](Self::empty).
    ///
    /// # Errors
    /// See [`LoadError`].
    pub fn load(&mut self, blob: &'a [u8]) -> Result<(), LoadError> {
        self.load_held(blob, Held::Exactly)
    }

    /// Like [`load`](Self::load), from a flash slot: bytes after the stated length are ignored.
    ///
    /// # Errors
    /// See [`LoadError`].
    pub fn load_slot(&mut self, slot: &'a [u8]) -> Result<(), LoadError> {
        self.load_held(slot, Held::AtLeast)
    }

    /// Like [`load`](Self::load), but returns the compensation by value. This needs stack for twice its size;
    /// [`empty`](Self::empty) followed by `load` needs none.
    ///
    /// # Errors
    /// See [`LoadError`].
    pub fn from_blob(blob: &'a [u8]) -> Result<Self, LoadError> {
        let mut compensation = Self::empty();
        match compensation.load(blob) {
            Ok(()) => Ok(compensation),
            Err(error) => Err(error),
        }
    }

    fn load_held(&mut self, bytes: &'a [u8], held: Held) -> Result<(), LoadError> {
        self.clear();
        let result = self.take(bytes, held);
        if result.is_err() {
            self.clear();
        }
        result
    }

    /// Fills an empty compensation.
    fn take(&mut self, bytes: &'a [u8], held: Held) -> Result<(), LoadError> {
        let bytes = header::open(bytes, held)?;
        self.length = bytes.len() as u32;
        // The notes at the end are for hosts, which read them with `Notes::of`.
        let noted = header::noted(bytes);
        let end = bytes.len().wrapping_sub(noted.into());
        let bytes = bytes.get(..end).filter(|bytes| bytes.len() >= HEADER);
        let bytes = bytes.ok_or(LoadError::Notes { stated: noted })?;
        let contents = &mut self.contents;
        self.plan
            .fill(bytes, |filling| blob::read(bytes, filling, contents))?;
        magnitude::measure(&self.plan, &self.contents, &mut self.peaks)?;
        self.reach = Reach::find(&self.contents, self.inputs_used());
        Ok(())
    }

    /// All f32 samples.
    fn floats(&self) -> &'a [f32] {
        self.plan.floats().unwrap_or_default()
    }

    /// All i16 samples.
    fn shorts(&self) -> &'a [i16] {
        self.plan.shorts().unwrap_or_default()
    }

    /// How far the inputs may go, and which of them matter.
    pub(crate) fn reach(&self) -> &Reach<C> {
        &self.reach
    }

    /// Name of the machine.
    #[must_use]
    pub fn machine(&self) -> &'a str {
        self.contents.machine.unwrap_or_default()
    }

    /// How the rotary corrections were solved.
    #[must_use]
    pub fn policy(&self) -> Policy {
        self.contents.policy
    }

    /// The axes, in the order of inputs and outputs.
    #[must_use]
    pub fn axes(&self) -> &[Axis] {
        &self.contents.axes
    }

    /// The auxiliary inputs; their numbers follow those of the axes.
    #[must_use]
    pub fn auxiliaries(&self) -> &[Auxiliary] {
        &self.contents.auxiliaries
    }

    /// The banks; tables are numbered consecutively through them.
    #[must_use]
    pub fn banks(&self) -> &[Bank] {
        &self.contents.banks
    }

    /// The grids.
    #[must_use]
    pub fn grids(&self) -> &[Grid] {
        &self.contents.grids
    }

    /// Number of tables.
    #[must_use]
    pub fn tables(&self) -> usize {
        usize::from(self.plan.tables())
    }

    /// Number of samples in both formats.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.floats().len() + self.shorts().len()
    }

    /// Length of the blob in bytes, including the header but not what follows it in its slot; 0 when empty.
    #[must_use]
    pub fn blob_len(&self) -> usize {
        self.length as usize
    }

    /// The terms, in stored order.
    pub fn terms(&self) -> impl ExactSizeIterator<Item = TermView<'_>> + '_ {
        self.plan.terms().iter().map(|term| TermView {
            output: term.output,
            weight: term.weight,
            limits: self.plan.weights().limits_at(term.place),
            factors: term.factors.get(..term.count.into()).unwrap_or_default(),
        })
    }

    /// The stored weights, to be adjusted and passed to [`evaluate`](Self::evaluate).
    #[must_use]
    pub fn weights(&self) -> Weights {
        *self.plan.weights()
    }

    /// Largest magnitude that table `table` can reach.
    #[must_use]
    pub fn peak(&self, table: usize) -> Option<f32> {
        self.peaks.get(..self.tables())?.get(table).copied()
    }

    /// Sample `point` of table `table`, including the scale: the table's value there or, for a cubic table, a
    /// coefficient.
    #[must_use]
    pub fn sample(&self, table: usize, point: usize) -> Option<f32> {
        let mut column = table;
        for bank in self.contents.banks.iter() {
            let tables = usize::from(bank.tables);
            if column < tables {
                if point >= bank.points as usize {
                    return None;
                }
                let place = bank.first as usize + point * tables + column;
                return match bank.format {
                    SampleFormat::F32 => self.floats().get(place).copied(),
                    SampleFormat::I16 => {
                        let raw = f32::from(*self.shorts().get(place)?);
                        Some(raw * self.plan.scales()[table])
                    }
                };
            }
            column -= tables;
        }
        None
    }

    /// What the stored samples of table `table` are multiplied by: 1 for samples of f32.
    #[must_use]
    pub fn scale(&self, table: usize) -> Option<f32> {
        self.plan.scales().get(table).copied()
    }

    /// Value of output `output` (its index in [`Grid::outputs`]) at node `node` of grid `grid`.
    #[must_use]
    pub fn grid_sample(&self, grid: usize, node: usize, output: usize) -> Option<f32> {
        let grid = self.contents.grids.get(grid)?;
        let width = grid.outputs.len();
        if output >= width || node as u64 >= grid.nodes() {
            return None;
        }
        let place = grid.first as usize + node * width + output;
        match grid.format {
            SampleFormat::F32 => self.floats().get(place).copied(),
            SampleFormat::I16 => {
                Some(f32::from(*self.shorts().get(place)?) * grid.scales.get(output)?)
            }
        }
    }

    /// Largest distance of axis `axis` from 0, mm or degrees: [`MOST_PERIODS`](crate::MOST_PERIODS) of its own period
    /// and of every modulo table and grid on it, or `f32::MAX` if there are none. A position beyond it is a bad input.
    #[must_use]
    pub fn farthest(&self, axis: usize) -> Option<f32> {
        self.reach.axes.get(axis).copied()
    }

    /// The range (K) within which a temperature, by its number among the auxiliaries, is in all its tables; without end if
    /// no correction depends on it or it is not a temperature. `None` if there is no such auxiliary.
    #[must_use]
    pub fn range(&self, auxiliary: usize) -> Option<[f32; 2]> {
        let ranges = self.reach.ranges.get(..self.auxiliaries().len())?;
        ranges.get(auxiliary).copied()
    }

    /// One bit per input (axes, then auxiliaries) on which a correction depends: through a grid, or through a table of
    /// a term that is adjustable or has a non-zero weight.
    #[must_use]
    pub fn inputs_used(&self) -> u32 {
        let mut active = [false; 256];
        for term in self.plan.terms().iter() {
            work::count(1);
            if term.weight != 0.0 || term.place != FIXED {
                for &factor in term.factors.iter().take(term.count.into()) {
                    work::count(1);
                    active[usize::from(factor)] = true;
                }
            }
        }
        let mut used = 0;
        let mut table = 0;
        for bank in self.contents.banks.iter() {
            let tables = table..table + usize::from(bank.tables);
            table = tables.end;
            work::count(usize::from(bank.tables));
            if active.get(tables).is_some_and(|used| used.contains(&true)) {
                used |= 1 << bank.input;
            }
        }
        for axis in self.contents.grids.iter().flat_map(|grid| &grid.axes) {
            used |= 1 << axis.input;
        }
        used
    }

    /// Corrections Δq, mm or degrees, to be *added* to the commands, before any limit.
    ///
    /// `travel` selects the directional tables, `weights` sets the adjustable terms (of this compensation, from
    /// [`weights`](Self::weights)). Corrections are finite for any input: beyond the ends of a table its end value
    /// holds, and NaN counts as the first point. Entries beyond the last axis are 0.
    ///
    /// # Operations
    /// Per bank one subtraction, one multiplication and a comparison; per table two additions
    /// and one multiplication (cubic: six and three); per term one multiplication per factor and
    /// one addition; per output of a grid seven times a table. f32 `+ − ×` and casts in a fixed
    /// order: the same blob gives the same bits on every target.
    ///
    /// # Memory
    /// `4 · (TABLES + 2 + AXES)` bytes of stack and a few registers; reads two rows per bank (cubic:
    /// four), eight nodes per grid.
    ///
    /// # Timing
    /// Independent of the positions, except for modulo inputs, directional banks, and the ends of tables, which take a
    /// call instead of an interpolation. A grid of three f32 outputs over three inputs takes longer beyond its ends.
    #[must_use]
    #[inline(always)]
    pub fn evaluate(
        &self,
        inputs: &Inputs<C::Axes<f32>>,
        travel: &Travelling<C::Axes<Travel>>,
        weights: &Weights,
    ) -> C::Axes<f32> {
        let mut corrections = C::Axes::<f32>::all(0.0);
        self.evaluate_into(inputs, travel, weights, &mut corrections);
        corrections
    }

    /// Like [`evaluate`](Self::evaluate), but writes the result in place, which saves a copy. Entries beyond the last
    /// axis stay unchanged or become 0.
    #[inline(always)]
    pub fn evaluate_into(
        &self,
        inputs: &Inputs<C::Axes<f32>>,
        travel: &Travelling<C::Axes<Travel>>,
        weights: &Weights,
        corrections: &mut C::Axes<f32>,
    ) {
        kernel::evaluate(&self.plan, inputs, travel, weights, corrections);
    }
}

impl<C: Room> Compensation<'_, C> {
    /// Like [`evaluate`](Self::evaluate), at each of several positions with the same directions and weights, such as a
    /// path ahead or a map. Returns the number evaluated: the length of the shorter slice. Further corrections stay
    /// unchanged.
    pub fn evaluate_each(
        &self,
        inputs: &[Inputs<C::Axes<f32>>],
        travel: &Travelling<C::Axes<Travel>>,
        weights: &Weights,
        corrections: &mut [C::Axes<f32>],
    ) -> usize {
        let pairs = inputs.iter().zip(corrections);
        pairs
            .map(|(inputs, to)| *to = self.evaluate(inputs, travel, weights))
            .count()
    }
}

impl<'a> Compensation<'a, Usual> {
    /// [Empty](Self::empty), with the default capacities.
    #[must_use]
    pub const fn new() -> Self {
        Self::empty()
    }

    /// Reads a file by value, with the default capacities: see [`from_blob`](Self::from_blob).
    ///
    /// # Errors
    /// See [`LoadError`].
    pub fn decode(blob: &'a [u8]) -> Result<Self, LoadError> {
        Self::from_blob(blob)
    }
}

impl<C: Room> Default for Compensation<'_, C> {
    fn default() -> Self {
        Self::empty()
    }
}

/// Prints a summary and sizes, not the contents.
impl<C: Room> fmt::Debug for Compensation<'_, C> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Compensation")
            .field("machine", &self.machine())
            .field("axes", &self.contents.axes.len())
            .field("tables", &self.plan.tables())
            .field("terms", &self.plan.terms().len())
            .field("grids", &self.contents.grids.len())
            .field("bytes", &self.length)
            .finish_non_exhaustive()
    }
}

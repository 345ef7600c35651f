//! A validated compensation, ready to be evaluated.

use core::fmt;

use crate::description::{AUXILIARIES, Auxiliary, Axis, Bank, Grid, Policy, SampleFormat};
use crate::inputs::{Inputs, Travel, Travelling};
use crate::kernel;
use crate::lookup::{
    BankLookup, FIXED, GridLookup, Head, Kind, PAIRED, PackedTerm, group, pair_up,
};
use crate::reach::Reach;
use crate::room::{List, Room, Row, Usual};
use crate::weights::Weights;
use crate::work;

/// Tables, terms and grids that turn positions into corrections; the samples stay in the blob.
///
/// Only [`load`](Self::load), [`load_slot`](Self::load_slot) and [`decode`](Self::decode) fill one,
/// and they check everything: evaluation cannot fail, cannot panic and needs no further checks.
///
/// `C` is what there is room for: [`Holds`](crate::Holds).
// `repr(C)`: what every evaluation reads stands in front, where single instructions reach it.
#[derive(Clone)]
#[repr(C)]
pub struct Compensation<'a, C: Room = Usual> {
    /// Nothing but one plain grid.
    pub(crate) one_cell: bool,
    /// Whether there are terms other than `pairs`.
    pub(crate) runs: bool,
    pub(crate) tables: u16,
    pub(crate) length: u32,
    pub(crate) floats: Option<&'a [f32]>,
    pub(crate) shorts: Option<&'a [i16]>,
    /// What the kernel adds first, see `pair_up`.
    pub(crate) heads: C::AxisList<Head>,
    pub(crate) reach: Reach<C>,
    pub(crate) axes: C::AxisList<Axis>,
    pub(crate) machine: Option<&'a str>,
    pub(crate) policy: Policy,
    pub(crate) weights: Weights,
    pub(crate) auxiliaries: heapless::Vec<Auxiliary, AUXILIARIES>,
    /// One per bank.
    pub(crate) lookups: C::BankList<BankLookup>,
    pub(crate) grids: C::GridList<Grid>,
    /// One per grid.
    pub(crate) grid_lookups: C::GridList<GridLookup>,
    /// One per table; 1 for tables of f32 samples.
    pub(crate) scales: C::TableList<f32>,
    pub(crate) pairs: C::TermList<u32>,
    pub(crate) terms: C::TermList<PackedTerm>,
    pub(crate) banks: C::BankList<Bank>,
    /// Largest magnitude of each table.
    pub(crate) peaks: C::TableList<f32>,
}

/// A term as stored, see [`Term`](crate::Term).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TermView<'c> {
    /// Number of the output axis.
    pub output: u8,
    /// Stored weight.
    pub weight: f32,
    /// Limits of the weight if it is adjustable.
    pub limits: Option<[f32; 2]>,
    /// Numbers of the tables, in the order of multiplication.
    pub factors: &'c [u8],
}

impl<'a, C: Room> Compensation<'a, C> {
    /// Nothing: no axes, all corrections zero. For a `static` or a `Box` to load into; all of it is
    /// zeros, so that a `static` takes no flash.
    #[must_use]
    pub const fn empty() -> Self {
        // What does not fit the masks and numbers does not compile.
        const { assert!(C::AXES + C::BANKS + C::TABLES + C::TERMS + C::GRIDS > 0) };
        Self {
            machine: None,
            policy: Policy::Orientation,
            axes: C::AxisList::EMPTY,
            auxiliaries: heapless::Vec::new(),
            banks: C::BankList::EMPTY,
            lookups: C::BankList::EMPTY,
            scales: C::TableList::EMPTY,
            peaks: C::TableList::EMPTY,
            tables: 0,
            terms: C::TermList::EMPTY,
            heads: C::AxisList::EMPTY,
            pairs: C::TermList::EMPTY,
            runs: false,
            one_cell: false,
            weights: Weights::empty(),
            grids: C::GridList::EMPTY,
            grid_lookups: C::GridList::EMPTY,
            floats: None,
            shorts: None,
            length: 0,
            reach: Reach::EMPTY,
        }
    }

    /// Makes `self` [empty](Self::empty) in place.
    #[inline(never)]
    pub(crate) fn clear(&mut self) {
        self.machine = None;
        self.policy = Policy::Orientation;
        self.axes.clear();
        self.auxiliaries.clear();
        self.banks.clear();
        self.lookups.clear();
        self.scales.clear();
        self.peaks.clear();
        self.tables = 0;
        self.terms.clear();
        self.heads.clear();
        self.pairs.clear();
        self.runs = false;
        self.one_cell = false;
        self.weights = Weights::empty();
        self.grids.clear();
        self.grid_lookups.clear();
        self.floats = None;
        self.shorts = None;
        self.length = 0;
        self.reach = Reach::EMPTY;
    }

    /// All samples of the format f32.
    pub(crate) fn floats(&self) -> &'a [f32] {
        self.floats.unwrap_or_default()
    }

    /// All samples of the format i16.
    pub(crate) fn shorts(&self) -> &'a [i16] {
        self.shorts.unwrap_or_default()
    }

    /// Last step of loading: prepares the terms for the kernel and the inputs for the servo.
    pub(crate) fn finish(&mut self) {
        let floats = self.floats();
        for bank in self.lookups.iter_mut() {
            if bank.kind == Kind::Straight {
                let first = bank.first as usize;
                let (a, b) = (floats[first], floats[first + 1]);
                bank.line = [a, b - a];
            }
        }
        pair_up::<C>(
            self.axes.len(),
            &mut self.terms,
            &mut self.heads,
            &mut self.pairs,
        );
        self.one_cell =
            self.terms.is_empty() && self.grids.len() == 1 && self.grid_lookups[0].plain;
        self.runs = self.terms.iter().any(|term| term.most != PAIRED);
        group(&mut self.terms);
        self.find_reach();
    }

    /// Name of the machine.
    #[must_use]
    pub fn machine(&self) -> &'a str {
        self.machine.unwrap_or_default()
    }

    /// How the rotary corrections were solved.
    #[must_use]
    pub fn policy(&self) -> Policy {
        self.policy
    }

    /// The axes, in the order of inputs and outputs.
    #[must_use]
    pub fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// The auxiliary inputs, numbered on after the axes.
    #[must_use]
    pub fn auxiliaries(&self) -> &[Auxiliary] {
        &self.auxiliaries
    }

    /// The banks; tables are numbered through them in order.
    #[must_use]
    pub fn banks(&self) -> &[Bank] {
        &self.banks
    }

    /// The grids.
    #[must_use]
    pub fn grids(&self) -> &[Grid] {
        &self.grids
    }

    /// Number of tables.
    #[must_use]
    pub fn tables(&self) -> usize {
        usize::from(self.tables)
    }

    /// Number of samples, of both formats.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.floats().len() + self.shorts().len()
    }

    /// Bytes of the blob, header included, without what follows it in its slot; 0 when empty.
    #[must_use]
    pub fn blob_len(&self) -> usize {
        self.length as usize
    }

    /// The terms, in stored order.
    pub fn terms(&self) -> impl ExactSizeIterator<Item = TermView<'_>> + '_ {
        self.terms.iter().map(|term| TermView {
            output: term.output,
            weight: term.weight,
            limits: self.weights.limits_at(term.place),
            factors: &term.factors[..usize::from(term.count)],
        })
    }

    /// The weights as stored, to be adjusted and passed to [`evaluate`](Self::evaluate).
    #[must_use]
    pub fn weights(&self) -> Weights {
        self.weights
    }

    /// Largest magnitude that table `table` can take.
    #[must_use]
    pub fn peak(&self, table: usize) -> Option<f32> {
        self.peaks.get(..self.tables())?.get(table).copied()
    }

    /// Value of table `table` at its point `point`, scale included.
    #[must_use]
    pub fn sample(&self, table: usize, point: usize) -> Option<f32> {
        let mut column = table;
        for bank in self.banks.iter() {
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
                        Some(raw * self.scales[table])
                    }
                };
            }
            column -= tables;
        }
        None
    }

    /// Value of output `output` (its place in [`Grid::outputs`]) at node `node` of grid `grid`.
    #[must_use]
    pub fn grid_sample(&self, grid: usize, node: usize, output: usize) -> Option<f32> {
        let grid = self.grids.get(grid)?;
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

    /// One bit per input (axes, then auxiliaries) on which a correction depends: through a grid,
    /// or through a table of a term that is adjustable or has a weight other than 0.
    #[must_use]
    pub fn inputs_used(&self) -> u32 {
        let mut active = [false; 256];
        for term in self.terms.iter() {
            work::count(1);
            if term.weight != 0.0 || term.place != FIXED {
                for &factor in &term.factors[..usize::from(term.count)] {
                    work::count(1);
                    active[usize::from(factor)] = true;
                }
            }
        }
        let mut used = 0;
        let mut table = 0;
        for bank in self.banks.iter() {
            let tables = table..table + usize::from(bank.tables);
            table = tables.end;
            work::count(usize::from(bank.tables));
            if active[tables].contains(&true) {
                used |= 1 << bank.input;
            }
        }
        for axis in self.grids.iter().flat_map(|grid| &grid.axes) {
            used |= 1 << axis.input;
        }
        used
    }

    /// Corrections Δq, mm or degrees, to be *added* to the commands, before any guard rail.
    ///
    /// `travel` selects the directional tables, `weights` those of the adjustable terms (of this
    /// compensation, from [`weights`](Self::weights)). Any input gives finite corrections: beyond
    /// the ends of a table its end value holds, not-a-number counts as the first point.
    /// Entries beyond the last axis are 0.
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
    /// Independent of the positions except for modulo inputs, directional banks, and the ends of
    /// tables, which take a call instead of an interpolation; a grid of three f32 outputs over three
    /// inputs takes longer beyond its ends.
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

    /// As [`evaluate`](Self::evaluate), into a place, which saves copying; entries beyond the last
    /// axis stay as they are or become 0.
    #[inline(always)]
    pub fn evaluate_into(
        &self,
        inputs: &Inputs<C::Axes<f32>>,
        travel: &Travelling<C::Axes<Travel>>,
        weights: &Weights,
        corrections: &mut C::Axes<f32>,
    ) {
        if self.one_cell {
            kernel::evaluate_cell(self, inputs, corrections);
        } else {
            kernel::evaluate_tables(self, inputs, travel, weights, corrections);
        }
    }
}

impl<C: Room> Default for Compensation<'_, C> {
    fn default() -> Self {
        Self::empty()
    }
}

/// What it is and how large; not its contents.
impl<C: Room> fmt::Debug for Compensation<'_, C> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Compensation")
            .field("machine", &self.machine())
            .field("axes", &self.axes.len())
            .field("tables", &self.tables)
            .field("terms", &self.terms.len())
            .field("grids", &self.grids.len())
            .field("bytes", &self.length)
            .finish_non_exhaustive()
    }
}

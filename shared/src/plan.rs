//! What evaluation reads, and all that the unsafe code of the kernel rests on.
//!
//! A [`Plan`] is either empty or [filled](Plan::fill), in one go and from one blob. Its fields are
//! private to this module; everybody else gets shared references. So these guarantees hold of every plan,
//! wherever one is met; each stands with the function of [`Filling`] that checks or makes it:
//!
//! 1. *Inputs* (`slot`, `bank`). `span.slot < AXES + AUXILIARIES`, and `< AXES` for directional banks.
//! 2. *Spans* (`Span::new`). `1 ≤ last < 2²⁴` (0 for the missing inputs of a grid, at least 3 for cubic
//!    banks), `after ≤ last`; `limit` and `beyond` are the number of intervals: `last`, for cubic banks
//!    `last − 2`; or, with modulo, `limit` is `last + 1` and `beyond` is 0.
//! 3. *Samples* (`take_samples`, `finish`). `first + (last + 1) · tables` is at most the length of the
//!    bank's section; of a grid, `first + strides[0] · (spans[0].last + 1)`, with each stride the product
//!    of the counts behind it and `width`.
//! 4. *Tables* (`OpenBank::end`, `end_banks`). The banks together have at least `tables` tables, each once,
//!    and at most `TABLES ≤ 255`; there is a scale for each.
//! 5. *Terms* (`term`, `OpenTerm::factor`). Each used factor of a term is `< tables`, each unused one is
//!    `TABLES`; `count ≤ FACTORS`; `output < AXES`; adjustable terms have consecutive places
//!    `< ADJUSTABLE`.
//! 6. *Runs* (`group`). `run` of the first term, and of each term that follows a run, is at least 1 and
//!    stays within the terms; all terms of a run share `output`, are all fixed or all adjustable, and have
//!    at most as many factors as `most` says.
//! 7. *Grids* (`OpenGrid::output`, `OpenGrid::end`, `finish`). Every grid has `width ≤ GRID_OUTPUTS`
//!    outputs `< AXES`; a plain one has three inputs without modulo and `PLAIN_WIDTH` f32 outputs.
//!    `one_cell` means that there is a plain one.
//! 8. *Heads* (`pair_up`). They have outputs `< AXES`, by their place in bytes, and as many words of `pairs`
//!    as they say, one head's behind the other's; each word, and each `first`, names tables as a term does, or
//!    the 1 or the 0 behind them, by its place in bytes. `bare[0] ≤ bare[1]`: the heads before have pairs,
//!    those between neither pairs nor single values, those behind single values.
//! 9. *Sections* (`finish`). Where there are banks or grids, there are both sections of samples, though
//!    one may be empty.
//!
//! 10. *Order of banks* (`order`). `linear[0] ≤ linear[1]`: the banks before are straight, those
//!     between linear, those behind of another kind.
//!
//! A plan that is not empty has at most `AXES` axes, `BANKS` banks, `TABLES` tables, `TERMS` terms and `GRIDS`
//! grids: what does not fit is counted while the plan is filled, and `finish` refuses it.
//!
//! Nothing of a plan changes after that. Weights that are set at run time are not part of it: the kernel
//! reads as many as there can be, whosever they are.
//!
//! What else a blob must fulfil (bounds of axes, magnitudes) is checked where it is read, in `blob.rs`
//! and `magnitude.rs`: it matters for what comes out, not for what is accessed.

mod filling;
mod lookup;
mod span;
mod terms;

use crate::load_error::LoadError;
use crate::room::{List, Room};
use crate::weights::Weights;

pub(crate) use filling::Filling;
pub(crate) use lookup::{BankLookup, GridLookup, PLAIN_WIDTH};
pub(crate) use span::Span;
pub(crate) use terms::{FIXED, Head, PAIRED, PackedTerm};

/// Tables, terms and grids, checked and prepared; the samples stay in the blob.
// `repr(C)`: what every evaluation reads stands in front, where single instructions reach it.
#[derive(Clone)]
#[repr(C)]
pub(crate) struct Plan<'a, C: Room> {
    /// Nothing but one plain grid.
    one_cell: bool,
    /// Whether there is more than banks and the first `bare[1]` heads.
    more: bool,
    /// Whether there are terms other than those of `heads`.
    runs: bool,
    tables: u16,
    /// Where among `banks` the linear ones begin and end.
    linear: [u16; 2],
    /// Where among `heads` those without pairs and single values begin and end.
    bare: [u16; 2],
    floats: Option<&'a [f32]>,
    shorts: Option<&'a [i16]>,
    /// What the kernel adds first, see `pair_up`.
    heads: C::AxisList<Head>,
    /// One per bank, in the order of evaluation.
    banks: C::BankList<BankLookup>,
    /// One per grid.
    grids: C::GridList<GridLookup>,
    /// One per table; 1 for tables of f32 samples.
    scales: C::TableList<f32>,
    pairs: C::TermList<u32>,
    terms: C::TermList<PackedTerm>,
    /// As stored.
    weights: Weights,
}

impl<'a, C: Room> Plan<'a, C> {
    /// Nothing: all zeros.
    pub(crate) const EMPTY: Self = Self {
        one_cell: false,
        more: false,
        linear: [0; 2],
        bare: [0; 2],
        runs: false,
        tables: 0,
        floats: None,
        shorts: None,
        heads: C::AxisList::EMPTY,
        banks: C::BankList::EMPTY,
        grids: C::GridList::EMPTY,
        scales: C::TableList::EMPTY,
        pairs: C::TermList::EMPTY,
        terms: C::TermList::EMPTY,
        weights: Weights::empty(),
    };

    /// Makes it [empty](Self::EMPTY) in place.
    #[inline(never)]
    pub(crate) fn clear(&mut self) {
        self.one_cell = false;
        self.more = false;
        self.linear = [0; 2];
        self.bare = [0; 2];
        self.runs = false;
        self.tables = 0;
        self.floats = None;
        self.shorts = None;
        self.heads.clear();
        self.banks.clear();
        self.grids.clear();
        self.scales.clear();
        self.pairs.clear();
        self.terms.clear();
        self.weights = Weights::empty();
    }

    /// Fills it, in place; the only way to a plan that is not empty. `read` puts in what the description of
    /// `blob` says and returns how many bytes of it are described; the samples follow them.
    ///
    /// # Errors
    /// Those of `read`, of its calls of [`Filling`], and what is wrong with the sections of samples; then
    /// the plan is empty.
    pub(crate) fn fill(
        &mut self,
        blob: &'a [u8],
        read: impl FnOnce(&mut Filling<'_, 'a, C>) -> Result<usize, LoadError>,
    ) -> Result<(), LoadError> {
        self.clear();
        let mut filling = Filling::new(self);
        let described = read(&mut filling)?;
        filling.finish(blob, described)
    }

    /// Whether there is nothing but one plain grid.
    #[inline(always)]
    pub(crate) fn one_cell(&self) -> bool {
        self.one_cell
    }

    /// Whether there is more to evaluate than banks and the heads up to the end of those without pairs and
    /// single values.
    #[inline(always)]
    pub(crate) fn has_more(&self) -> bool {
        self.more
    }

    /// Whether there are terms other than those of `heads`.
    #[inline(always)]
    pub(crate) fn has_runs(&self) -> bool {
        self.runs
    }

    /// Number of tables.
    pub(crate) fn tables(&self) -> u16 {
        self.tables
    }

    /// All samples of the format f32; none in an empty plan.
    #[inline(always)]
    pub(crate) fn floats(&self) -> Option<&'a [f32]> {
        self.floats
    }

    /// All samples of the format i16; none in an empty plan.
    #[inline(always)]
    pub(crate) fn shorts(&self) -> Option<&'a [i16]> {
        self.shorts
    }

    /// What the kernel begins each output with, and where those without pairs and single values begin and end.
    #[inline(always)]
    pub(crate) fn heads(&self) -> (&[Head], [usize; 2]) {
        // `map` is a loop where code is to be small.
        let [bare, singles] = self.bare;
        (&self.heads, [usize::from(bare), usize::from(singles)])
    }

    /// The pairs of all heads.
    #[inline(always)]
    pub(crate) fn pairs(&self) -> &[u32] {
        &self.pairs
    }

    /// The banks, in the order of evaluation, and where the linear ones begin and end.
    #[inline(always)]
    pub(crate) fn banks(&self) -> (&[BankLookup], [usize; 2]) {
        let [linear, other] = self.linear;
        (&self.banks, [usize::from(linear), usize::from(other)])
    }

    /// The grids.
    #[inline(always)]
    pub(crate) fn grids(&self) -> &[GridLookup] {
        &self.grids
    }

    /// The scale of each table.
    #[inline(always)]
    pub(crate) fn scales(&self) -> &[f32] {
        &self.scales
    }

    /// All terms, in stored order.
    #[inline(always)]
    pub(crate) fn terms(&self) -> &[PackedTerm] {
        &self.terms
    }

    /// The weights of the adjustable terms as stored.
    pub(crate) fn weights(&self) -> &Weights {
        &self.weights
    }
}

#[cfg(all(test, feature = "encode"))]
mod tests;

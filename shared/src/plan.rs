//! What evaluation reads, and all that the unsafe code of the kernel rests on.
//!
//! A [`Plan`] is either empty or [filled](Plan::fill), in one go and from one blob. Its fields are
//! private to this module; everybody else gets shared references. So these guarantees hold of every plan,
//! wherever one is met; each stands with the function of [`Filling`] that checks or makes it:
//!
//! 1. *Inputs* (`slot`, `bank`). `span.slot < AXES + AUXILIARIES`, and `< AXES` for directional banks.
//! 2. *Spans* (`Span::new`). `1 ≤ last < 2²⁴` (0 for the missing inputs of a grid, at least 3 for cubic
//!    banks), `after ≤ last`; `limit` and `beyond` are the number of intervals: `last`, for cubic banks
//!    `last − 2`; or, with modulo, `limit` is `last + 1` and `beyond` is 0. `direct` is 0, or it is `last`
//!    and the span is one of a linear bank of f32 samples for both directions, or of a plain grid, without
//!    modulo.
//! 3. *Samples* (`take_samples`, `finish`). `first + (last + 1) · tables` is at most the length of the
//!    bank's section; of a grid, `first + strides[0] · (spans[0].last + 1)`, with each stride the product
//!    of the counts behind it and `width`.
//! 4. *Tables* (`OpenBank::end`, `end_banks`). The tables of the banks follow each other: the first bank has
//!    `table` 0, and each next one the sum of both numbers of the one before. There are `tables` in all, at
//!    most `TABLES ≤ 255`, and there is a scale for each.
//! 5. *Terms* (`term`, `OpenTerm::factor`). Each of the `count ≤ FACTORS` factors of a term is `< tables`;
//!    `output < AXES`; the place of an adjustable term is `< ADJUSTABLE`.
//! 6. *Other terms* (`divide`). `others`, and `next` of each term that is reached from it, is 0 or the number
//!    of a term counted from 1, each larger than the one before.
//! 7. *Grids* (`OpenGrid::output`, `OpenGrid::end`, `finish`). Every grid has `width ≤ GRID_OUTPUTS`
//!    outputs `< AXES`; a plain one has three inputs and `PLAIN_WIDTH` outputs of f32 samples.
//! 8. *Sums* (`divide`). There is one for each axis, at most `AXES`, or none if there are no terms; all
//!    together have as many products as there are. Both halves of a product, and each `first`, are four times a number `< tables`, or `TABLES` or `TABLES + 1`
//!    for the 1 and the 0 after the table values.
//! 9. *Sections* (`finish`). Where there are banks or grids, there are both sections of samples, though
//!    one may be empty.
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
pub(crate) use terms::{FIXED, PackedTerm, Product, Sum};

/// Tables, terms and grids, checked and prepared; the samples stay in the blob.
// `repr(C)`: what every evaluation reads comes first, where single instructions reach it.
#[derive(Clone)]
#[repr(C)]
pub(crate) struct Plan<'a, C: Room> {
    // `None` in an empty plan, which is all zeros so that a `static` takes no flash.
    floats: Option<&'a [f32]>,
    shorts: Option<&'a [i16]>,
    tables: u16,
    /// The first term that is added by itself, counted from 1, or 0.
    others: u16,
    /// One per axis; none without terms.
    sums: C::AxisList<Sum>,
    /// One per bank.
    banks: C::BankList<BankLookup>,
    /// One per grid.
    grids: C::GridList<GridLookup>,
    products: C::TermList<Product>,
    terms: C::TermList<PackedTerm>,
    /// One per table; 1 for tables of f32 samples.
    scales: C::TableList<f32>,
    /// As stored.
    weights: Weights,
}

impl<'a, C: Room> Plan<'a, C> {
    /// Nothing: all zeros.
    pub(crate) const EMPTY: Self = Self {
        sums: C::AxisList::EMPTY,
        products: C::TermList::EMPTY,
        others: 0,
        terms: C::TermList::EMPTY,
        banks: C::BankList::EMPTY,
        grids: C::GridList::EMPTY,
        scales: C::TableList::EMPTY,
        tables: 0,
        floats: None,
        shorts: None,
        weights: Weights::empty(),
    };

    /// Makes it [empty](Self::EMPTY) in place.
    #[inline(never)]
    pub(crate) fn clear(&mut self) {
        self.sums.clear();
        self.products.clear();
        self.others = 0;
        self.terms.clear();
        self.banks.clear();
        self.grids.clear();
        self.scales.clear();
        self.tables = 0;
        self.floats = None;
        self.shorts = None;
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

    /// The sum of each axis; none without terms.
    #[inline(always)]
    pub(crate) fn sums(&self) -> &[Sum] {
        &self.sums
    }

    /// The products of all sums, one after the other.
    #[inline(always)]
    pub(crate) fn products(&self) -> &[Product] {
        &self.products
    }

    /// The first term that is added by itself, counted from 1, or 0.
    #[inline(always)]
    pub(crate) fn others(&self) -> u16 {
        self.others
    }

    /// The banks.
    #[inline(always)]
    pub(crate) fn banks(&self) -> &[BankLookup] {
        &self.banks
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

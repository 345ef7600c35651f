//! The data that evaluation reads, and the basis of all unsafe code in the kernel.
//!
//! A [`Plan`] is either empty or [filled](Plan::fill), in a single pass and from one blob. Its fields are private to
//! this module; everything else gets shared references. So every plan satisfies these guarantees. Each is listed with
//! the function of [`Filling`] that checks or establishes it:
//!
//! 1. *Inputs* (`slot`, `bank`). `span.slot < AXES + AUXILIARIES`, and `< AXES` for directional banks.
//! 2. *Spans* (`Span::new`). `1 ≤ last < 2²⁴` (0 for the missing inputs of a grid, at least 3 for cubic banks), `after
//!    ≤ last`; `limit` and `beyond` are the number of intervals: `last`, for cubic banks `last − 2`; or, with modulo,
//!    `limit` is `last + 1` and `beyond` is 0. `direct` is 0, or it is `last` and the span belongs to a linear bank of
//!    f32 samples for both directions, or to a plain grid, without modulo.
//! 3. *Samples* (`take_samples`, `finish`). `first + (last + 1) · tables` is at most the length of the bank's section;
//!    for a grid, `first + strides[0] · (spans[0].last + 1)`, with each stride the product of the counts after it and
//!    `width`.
//! 4. *Tables* (`OpenBank::end`, `end_banks`). The tables of the banks are consecutive: `table` is 0 for the first
//!    bank, and for each further one the sum of both numbers of the previous one. There are `tables` in all, at most
//!    `TABLES ≤ 255`, and there is a scale for each.
//! 5. *Terms* (`term`, `OpenTerm::factor`). Each of the `count ≤ FACTORS` factors of a term is `< tables`; `output <
//!    AXES`; the place of an adjustable term is `< ADJUSTABLE`.
//! 6. *Other terms* (`divide`). `others`, and `next` of each term reached from it, is 0 or the number of a term counted
//!    from 1, each larger than the previous one.
//! 7. *Grids* (`OpenGrid::output`, `OpenGrid::end`, `finish`). Every grid has `width ≤ GRID_OUTPUTS` outputs `< AXES`;
//!    a plain one has three inputs and `PLAIN_WIDTH` outputs of f32 samples.
//! 8. *Sums* (`divide`). There is one for each axis, at most `AXES`, or none if there are no terms. The product counts
//!    of all sums add up to the number of stored products. Both halves of a product, and each `first`, are four times a
//!    number `< tables`, or four times `TABLES` or `TABLES + 1` for the 1 and the 0 after the table values.
//! 9. *Sections* (`finish`). If there are banks or grids, both sections of samples exist, though one may be empty.
//!
//! A non-empty plan has at most `AXES` axes, `BANKS` banks, `TABLES` tables, `TERMS` terms and `GRIDS` grids: whatever
//! does not fit is counted while the plan is filled, and `finish` refuses it.
//!
//! A plan never changes after that. Weights set at run time are not part of it: the kernel reads the maximum number of
//! them, whichever compensation they belong to.
//!
//! The other requirements for a blob (bounds of axes, magnitudes) are checked where they are read, in `blob.rs` and
//! `magnitude.rs`: they affect the results, not memory accesses.

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

/// Tables, terms and grids, checked and prepared for evaluation; the samples stay in the blob.
// `repr(C)`: the fields read by every evaluation come first, within reach of single instructions.
#[derive(Clone)]
#[repr(C)]
pub(crate) struct Plan<'a, C: Room> {
    // `None` in an empty plan, which is all zeros so that a `static` takes no flash.
    floats: Option<&'a [f32]>,
    shorts: Option<&'a [i16]>,
    tables: u16,
    /// The first term that is added separately, counted from 1, or 0.
    others: u16,
    /// One per axis; empty if there are no terms.
    sums: C::AxisList<Sum>,
    /// One per bank.
    banks: C::BankList<BankLookup>,
    /// One per grid.
    grids: C::GridList<GridLookup>,
    products: C::TermList<Product>,
    terms: C::TermList<PackedTerm>,
    /// One per table; 1 for tables of f32 samples.
    scales: C::TableList<f32>,
    /// Stored weights.
    weights: Weights,
}

impl<'a, C: Room> Plan<'a, C> {
    /// Empty: all zeros.
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

    /// Fills the plan in place; this is the only way to a non-empty plan. `read` adds the items described in `blob` and
    /// returns the length of the description in bytes; the samples follow it.
    ///
    /// # Errors
    /// Those of `read`, of its calls of [`Filling`], and errors in the sections of samples. In each case the plan is
    /// left empty.
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

    /// All f32 samples; empty in an empty plan.
    #[inline(always)]
    pub(crate) fn floats(&self) -> Option<&'a [f32]> {
        self.floats
    }

    /// All i16 samples; empty in an empty plan.
    #[inline(always)]
    pub(crate) fn shorts(&self) -> Option<&'a [i16]> {
        self.shorts
    }

    /// The sum of each axis; empty if there are no terms.
    #[inline(always)]
    pub(crate) fn sums(&self) -> &[Sum] {
        &self.sums
    }

    /// The products of all sums, consecutively.
    #[inline(always)]
    pub(crate) fn products(&self) -> &[Product] {
        &self.products
    }

    /// The first term that is added separately, counted from 1, or 0.
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

    /// The stored weights of the adjustable terms.
    pub(crate) fn weights(&self) -> &Weights {
        &self.weights
    }
}

#[cfg(all(test, feature = "encode"))]
mod tests;

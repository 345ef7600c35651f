//! The description stored in a blob, for queries; evaluation reads the plan.

use crate::description::{AUXILIARIES, Auxiliary, Axis, Bank, Grid, Policy};
use crate::room::{List, Room};

/// The description of a blob without its terms.
#[derive(Clone)]
pub(crate) struct Contents<'a, C: Room> {
    pub axes: C::AxisList<Axis>,
    pub machine: Option<&'a str>,
    pub policy: Policy,
    pub auxiliaries: heapless::Vec<Auxiliary, AUXILIARIES>,
    pub grids: C::GridList<Grid>,
    pub banks: C::BankList<Bank>,
}

impl<C: Room> Contents<'_, C> {
    /// Empty: all zeros.
    pub(crate) const EMPTY: Self = Self {
        axes: C::AxisList::EMPTY,
        machine: None,
        policy: Policy::Orientation,
        auxiliaries: heapless::Vec::new(),
        grids: C::GridList::EMPTY,
        banks: C::BankList::EMPTY,
    };

    /// Makes this [empty](Self::EMPTY) in place.
    pub(crate) fn clear(&mut self) {
        self.axes.clear();
        self.machine = None;
        self.policy = Policy::Orientation;
        self.auxiliaries.clear();
        self.grids.clear();
        self.banks.clear();
    }
}

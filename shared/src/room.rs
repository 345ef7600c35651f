//! How much a compensation has room for: all capacities as one type.

use core::fmt::Debug;
use core::ops::DerefMut;

/// Most axes that there can be room for.
pub(crate) const MOST_AXES: usize = 16;

/// Capacities of a [`Compensation`](crate::Compensation) and of what belongs to it: a type, so that all memory
/// is there when the program is built. [`Holds`] is the only implementation.
pub trait Room: Copy + Debug + PartialEq + Sized + sealed::Sealed + 'static {
    /// Axes.
    const AXES: usize;
    /// Banks of tables.
    const BANKS: usize;
    /// Tables, of all banks.
    const TABLES: usize;
    /// Terms.
    const TERMS: usize;
    /// Grids.
    const GRIDS: usize;

    /// A value for each axis: `[T; AXES]`.
    type Axes<T: Copy + Debug + PartialEq + 'static>: Row<T>;
    /// `[f32; TABLES]`
    #[doc(hidden)]
    type TableValues: Copy;
    #[doc(hidden)]
    type AxisList<T: Clone>: List<T>;
    #[doc(hidden)]
    type BankList<T: Clone>: List<T>;
    #[doc(hidden)]
    type TableList<T: Clone>: List<T>;
    #[doc(hidden)]
    type TermList<T: Clone>: List<T>;
    #[doc(hidden)]
    type GridList<T: Clone>: List<T>;
}

/// Room for so many axes, banks, tables, terms and grids.
///
/// | | at most |
/// |---|---|
/// | `AXES` | 16 |
/// | `BANKS` | 255 |
/// | `TABLES`, of all banks | 255 |
/// | `TERMS` | 65 535 |
/// | `GRIDS` | 65 535 |
///
/// ```
/// use trueaxis::{Compensation, Holds, Room};
///
/// // Five axes, 8 banks with 32 tables, 64 terms, a grid.
/// type Mill = Holds<5, 8, 32, 64, 1>;
/// static TABLES: Compensation<'_, Mill> = Compensation::<Mill>::empty();
/// assert_eq!(Mill::TABLES, 32);
/// assert_eq!(TABLES.tables(), 0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Holds<
    const AXES: usize,
    const BANKS: usize,
    const TABLES: usize,
    const TERMS: usize,
    const GRIDS: usize,
> {}

/// What a compensation has room for unless told otherwise: eight axes, 32 banks with 96 tables, 256
/// terms, two grids.
pub type Usual = Holds<8, 32, 96, 256, 2>;

impl<
    const AXES: usize,
    const BANKS: usize,
    const TABLES: usize,
    const TERMS: usize,
    const GRIDS: usize,
> Room for Holds<AXES, BANKS, TABLES, TERMS, GRIDS>
{
    const AXES: usize = {
        assert!(AXES >= 1 && AXES <= MOST_AXES, "masks of axes have 16 bits");
        AXES
    };
    const BANKS: usize = {
        assert!(BANKS <= 255, "more banks than tables can be");
        BANKS
    };
    const TABLES: usize = {
        assert!(TABLES <= 255, "factors number tables with 8 bits");
        TABLES
    };
    const TERMS: usize = {
        assert!(TERMS <= 65_535, "terms are numbered with 16 bits");
        TERMS
    };
    const GRIDS: usize = {
        assert!(GRIDS <= 65_535, "grids are numbered with 16 bits");
        GRIDS
    };

    type Axes<T: Copy + Debug + PartialEq + 'static> = [T; AXES];
    type TableValues = [f32; TABLES];
    type AxisList<T: Clone> = heapless::Vec<T, AXES>;
    type BankList<T: Clone> = heapless::Vec<T, BANKS>;
    type TableList<T: Clone> = heapless::Vec<T, TABLES>;
    type TermList<T: Clone> = heapless::Vec<T, TERMS>;
    type GridList<T: Clone> = heapless::Vec<T, GRIDS>;
}

/// One value for each axis: an array.
pub trait Row<T>:
    Copy + Debug + PartialEq + AsRef<[T]> + AsMut<[T]> + sealed::Sealed + 'static
{
    /// The same for all axes.
    fn all(value: T) -> Self;
}

impl<T: Copy + Debug + PartialEq + 'static, const N: usize> Row<T> for [T; N] {
    #[inline(always)]
    fn all(value: T) -> Self {
        [value; N]
    }
}

/// A list in place, with a capacity.
#[doc(hidden)]
pub trait List<T>: Clone + DerefMut<Target = [T]> + sealed::Sealed {
    const EMPTY: Self;

    /// Appends `value` if there is room.
    fn append(&mut self, value: T);

    fn clear(&mut self);
}

impl<T: Clone, const N: usize> List<T> for heapless::Vec<T, N> {
    const EMPTY: Self = Self::new();

    #[inline(always)]
    fn append(&mut self, value: T) {
        let _ = self.push(value);
    }

    fn clear(&mut self) {
        self.truncate(0);
    }
}

mod sealed {
    pub trait Sealed {}

    impl<const A: usize, const B: usize, const T: usize, const N: usize, const G: usize> Sealed
        for super::Holds<A, B, T, N, G>
    {
    }
    impl<T, const N: usize> Sealed for [T; N] {}
    impl<T, const N: usize> Sealed for heapless::Vec<T, N> {}
}

//! Capacities of a compensation as one type.

use core::fmt::{self, Debug};
use core::ops::DerefMut;

/// Upper limit of the axis capacity.
pub(crate) const MOST_AXES: usize = 16;

/// Capacities of a [`Compensation`](crate::Compensation) and of the types that belong to it. Because this is a type,
/// all memory is reserved at compile time. [`Holds`] is the only implementation.
pub trait Room: Copy + Debug + PartialEq + Sized + sealed::Sealed + 'static {
    /// Maximum number of axes.
    const AXES: usize;
    /// Maximum number of banks of tables.
    const BANKS: usize;
    /// Maximum number of tables in all banks.
    const TABLES: usize;
    /// Maximum number of terms.
    const TERMS: usize;
    /// Maximum number of grids.
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

/// Capacities for axes, banks, tables, terms and grids; [`capacities!`](crate::capacities) writes this type with named
/// values.
///
/// | | at least | at most |
/// |---|---|---|
/// | `AXES` | 1 | 16 |
/// | `BANKS` | 0 | 255 |
/// | `TABLES`, of all banks | 0 | 255 |
/// | `TERMS` | 0 | 65 535 |
/// | `GRIDS` | 0 | 65 535 |
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Holds<
    const AXES: usize,
    const BANKS: usize,
    const TABLES: usize,
    const TERMS: usize,
    const GRIDS: usize,
> {}

/// The type [`Holds`], with a name for each capacity.
///
/// `trueaxis inspect` prints the capacities that a blob needs in this form.
///
/// ```
/// use trueaxis::{Compensation, Room};
///
/// type Mill = trueaxis::capacities!(axes: 5, banks: 8, tables: 32, terms: 64, grids: 1);
/// static TABLES: Compensation<'_, Mill> = Compensation::<Mill>::empty();
/// assert_eq!(Mill::TABLES, 32);
/// assert_eq!(TABLES.tables(), 0);
/// ```
#[macro_export]
macro_rules! capacities {
    (
        axes: $axes:expr, banks: $banks:expr, tables: $tables:expr, terms: $terms:expr, grids: $grids:expr $(,)?
    ) => {
        $crate::Holds<{ $axes }, { $banks }, { $tables }, { $terms }, { $grids }>
    };
}

#[cfg(feature = "encode")]
pub(crate) use capacities;

/// The default capacities: eight axes, 32 banks with 96 tables, 256 terms, two grids.
pub type Usual = capacities!(axes: 8, banks: 32, tables: 96, terms: 256, grids: 2);

/// Numbers of axes, banks, tables, terms and grids: the requirements of a blob, or the capacities of a target.
///
/// Displays as the [`capacities!`](crate::capacities) to write.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "link", derive(serde::Serialize, serde::Deserialize))]
pub struct Counts {
    /// Number of axes.
    pub axes: u32,
    /// Number of banks of tables.
    pub banks: u32,
    /// Number of tables in all banks.
    pub tables: u32,
    /// Number of terms.
    pub terms: u32,
    /// Number of grids.
    pub grids: u32,
}

impl Counts {
    /// The capacities `C`.
    #[must_use]
    pub const fn of<C: Room>() -> Self {
        Self {
            axes: C::AXES as u32,
            banks: C::BANKS as u32,
            tables: C::TABLES as u32,
            terms: C::TERMS as u32,
            grids: C::GRIDS as u32,
        }
    }

    /// Whether `held` is sufficient in every respect.
    #[must_use]
    pub const fn fits(self, held: Self) -> bool {
        self.axes <= held.axes
            && self.banks <= held.banks
            && self.tables <= held.tables
            && self.terms <= held.terms
            && self.grids <= held.grids
    }

    fn named(self) -> [(&'static str, u32); 5] {
        [
            ("axes", self.axes),
            ("banks", self.banks),
            ("tables", self.tables),
            ("terms", self.terms),
            ("grids", self.grids),
        ]
    }

    /// Every capacity in `held` that is too small: its name, the number needed, the number held.
    pub fn shortages(self, held: Self) -> impl Iterator<Item = (&'static str, u32, u32)> {
        let both = self.named().into_iter().zip(held.named());
        both.filter_map(|((what, needed), (_, held))| {
            (needed > held).then_some((what, needed, held))
        })
    }

    /// The elementwise maximum.
    #[must_use]
    pub fn larger(self, other: Self) -> Self {
        Self {
            axes: self.axes.max(other.axes),
            banks: self.banks.max(other.banks),
            tables: self.tables.max(other.tables),
            terms: self.terms.max(other.terms),
            grids: self.grids.max(other.grids),
        }
    }
}

impl fmt::Display for Counts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("trueaxis::capacities!(")?;
        for (place, (what, count)) in self.named().into_iter().enumerate() {
            let comma = if place == 0 { "" } else { ", " };
            write!(f, "{comma}{what}: {count}")?;
        }
        f.write_str(")")
    }
}

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
    /// This value for all axes.
    fn all(value: T) -> Self;
}

impl<T: Copy + Debug + PartialEq + 'static, const N: usize> Row<T> for [T; N] {
    #[inline(always)]
    fn all(value: T) -> Self {
        [value; N]
    }
}

/// A list stored in place, with a capacity.
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

//! The inputs of an evaluation.

use crate::description::AUXILIARIES;
use crate::room::Row;

/// Positions and auxiliary values of one servo period; `A` is `[f32; AXES]`.
///
/// `axes` are the uncorrected commands in machine coordinates, mm or degrees, in the order of
/// [`Compensation::axes`](crate::Compensation::axes); never a corrected or measured position,
/// which would close a loop. `auxiliaries` are in the order of
/// [`Compensation::auxiliaries`](crate::Compensation::auxiliaries). Entries beyond those are ignored.
// `repr(C)`: the kernel reads both arrays as one, see `kernel::input`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Inputs<A> {
    /// Commanded positions, mm or degrees.
    pub axes: A,
    /// Tool length in mm, temperatures as differences from their references in K; for a servo as read, for an evaluation
    /// with their [lags](crate::Lag) applied. A value that was never set is NaN; a servo reports a fault if a correction
    /// depends on it.
    pub auxiliaries: [f32; AUXILIARIES],
}

impl<A> Inputs<A> {
    /// Inputs with these positions; the auxiliaries are not set (NaN).
    #[must_use]
    pub const fn at(axes: A) -> Self
    where
        A: Copy,
    {
        Self {
            axes,
            auxiliaries: [f32::NAN; AUXILIARIES],
        }
    }
}

impl<A: Row<f32>> Default for Inputs<A> {
    fn default() -> Self {
        Self::at(A::all(0.0))
    }
}

/// Direction in which an axis last moved, in the user's sign convention.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
// As generated C reads it.
#[repr(i8)]
pub enum Travel {
    /// Not moved yet: all directional tables are 0.
    #[default]
    Unknown = 0,
    /// Last moved positive.
    Positive = 1,
    /// Last moved negative.
    Negative = -1,
}

/// Direction of each axis (`A` is `[Travel; AXES]`), in the order of [`Compensation::axes`](crate::Compensation::axes).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Travelling<A>(pub A);

impl<A: Row<Travel>> Default for Travelling<A> {
    fn default() -> Self {
        Self(A::all(Travel::Unknown))
    }
}

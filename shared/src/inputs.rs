//! What an evaluation is given.

use crate::description::AUXILIARIES;

/// Positions and auxiliary values of one servo period.
///
/// `axes` are the uncorrected commands in machine coordinates, mm or degrees, in the order of
/// [`Compensation::axes`](crate::Compensation::axes); never a corrected or measured position,
/// which would close a loop. `auxiliaries` are in the order of
/// [`Compensation::auxiliaries`](crate::Compensation::auxiliaries). Entries beyond those are ignored.
// `repr(C)`: the kernel reads both arrays as one, see `kernel::input`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Inputs<const AXES: usize = 8> {
    /// Commanded positions, mm or degrees.
    pub axes: [f32; AXES],
    /// Tool length in mm, temperatures as K difference to their references. What was never set
    /// is not a number: for a servo a fault if a correction depends on it.
    pub auxiliaries: [f32; AUXILIARIES],
}

impl<const AXES: usize> Inputs<AXES> {
    /// These positions; the auxiliaries have not been set: they are not numbers.
    #[must_use]
    pub const fn at(axes: [f32; AXES]) -> Self {
        Self {
            axes,
            auxiliaries: [f32::NAN; AUXILIARIES],
        }
    }
}

impl<const AXES: usize> Default for Inputs<AXES> {
    fn default() -> Self {
        Self::at([0.0; AXES])
    }
}

/// Direction in which an axis last moved, as the user counts it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Travel {
    /// Not moved yet: all directional tables are 0.
    #[default]
    Unknown,
    /// Last moved positive.
    Positive,
    /// Last moved negative.
    Negative,
}

/// Direction of each axis, in the order of [`Compensation::axes`](crate::Compensation::axes).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Travelling<const AXES: usize = 8>(pub [Travel; AXES]);

impl<const AXES: usize> Default for Travelling<AXES> {
    fn default() -> Self {
        Self([Travel::Unknown; AXES])
    }
}

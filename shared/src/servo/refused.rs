//! Why a servo does not take a compensation.

use core::fmt;

/// Why a compensation was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "link", derive(serde::Serialize, serde::Deserialize))]
pub enum Refused {
    /// The change before it is not finished: try again when [`Servo::is_swapping`](crate::Servo::is_swapping) is false.
    Busy,
    /// It has other axes (number, order, letters, travel or period).
    Axes,
    /// The auxiliary inputs differ in number, kind, name or reference.
    Auxiliaries,
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Busy => "the previous change of compensation is not finished",
            Self::Axes => "the axes differ in number, order, letter, travel or period",
            Self::Auxiliaries => "the auxiliary inputs differ in number, kind, name or reference",
        })
    }
}

impl core::error::Error for Refused {}

/// A compensation that a servo does not take.
pub struct NotTaken<H> {
    /// Why.
    pub why: Refused,
    /// What was to be taken.
    pub handle: H,
}

impl<H> fmt::Debug for NotTaken<H> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("NotTaken").field(&self.why).finish()
    }
}

impl<H> fmt::Display for NotTaken<H> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.why.fmt(f)
    }
}

impl<H> core::error::Error for NotTaken<H> {}

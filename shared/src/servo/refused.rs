//! Why a servo refuses a compensation.

use core::fmt;

/// Why a compensation was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "link", derive(serde::Serialize, serde::Deserialize))]
pub enum Refused {
    /// The previous change is not complete: try again when [`Servo::is_swapping`](crate::Servo::is_swapping) is false.
    Busy,
    /// The axes differ (number, order, letters, travel or period).
    Axes,
    /// The auxiliary inputs differ in number, kind, name, reference or lag.
    Auxiliaries,
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Busy => "the previous change of compensation is not finished",
            Self::Axes => "the axes differ in number, order, letter, travel or period",
            Self::Auxiliaries => {
                "the auxiliary inputs differ in number, kind, name, reference or lag"
            }
        })
    }
}

impl core::error::Error for Refused {}

/// A compensation refused by a servo.
pub struct NotTaken<H> {
    /// The reason.
    pub why: Refused,
    /// The handle passed in.
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

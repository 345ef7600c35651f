//! How fast a motion is.

/// How fast.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rate {
    /// G0.
    Rapid,
    /// F per minute, in the unit of the program.
    PerMinute(f64),
    /// F per revolution.
    PerRevolution(f64),
    /// One over the minutes of the move.
    Inverse(f64),
}

//! Classes of machines.

use std::fmt;

/// A class of machines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// X, Y and Z.
    ThreeAxis,
    /// Two rotary axes beside them, along the axes of the machine.
    TwoRotary,
    /// One of them tilted by 20° to 50°.
    Tilted,
    /// Two rotary axes, and motions of every axis in every direction, with waves that no polynomial of degree 3 has.
    Rich,
    /// A milling machine that warms up.
    Thermal,
    /// Three rotary axes, or two and a quill.
    SixAxes,
}

impl Class {
    /// All classes, in the order in which the machines take them.
    pub const ALL: [Self; 6] = [
        Self::ThreeAxis,
        Self::TwoRotary,
        Self::Tilted,
        Self::Rich,
        Self::Thermal,
        Self::SixAxes,
    ];

    /// The class of a machine by its number.
    #[must_use]
    pub const fn of(number: usize) -> Self {
        Self::ALL[number % Self::ALL.len()]
    }
}

impl fmt::Display for Class {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::ThreeAxis => "three axes",
            Self::TwoRotary => "two rotary",
            Self::Tilted => "tilted",
            Self::Rich => "rich motions",
            Self::Thermal => "thermal",
            Self::SixAxes => "six axes",
        })
    }
}

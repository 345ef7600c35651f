//! What holds until another word of the same group.

/// The unit of lengths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Units {
    /// G21.
    #[cfg_attr(feature = "clap", value(name = "mm", help = None))]
    Millimetre,
    /// G20.
    #[cfg_attr(feature = "clap", value(help = None))]
    Inch,
}

impl Units {
    /// A unit in mm.
    #[must_use]
    pub fn mm(self) -> f64 {
        match self {
            Self::Millimetre => 1.0,
            Self::Inch => 25.4,
        }
    }
}

/// What words of axes count from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Distance {
    /// G90.
    Absolute,
    /// G91.
    Incremental,
}

/// The plane of arcs and cycles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plane {
    /// G17.
    Xy,
    /// G18.
    Zx,
    /// G19.
    Yz,
}

impl Plane {
    /// First and second axis and its normal, right-handed.
    #[must_use]
    pub fn axes(self) -> [usize; 3] {
        match self {
            Self::Xy => [0, 1, 2],
            Self::Zx => [2, 0, 1],
            Self::Yz => [1, 2, 0],
        }
    }
}

/// What F means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FeedMode {
    /// G93: one over the minutes of the move.
    InverseTime,
    /// G94: length per minute.
    PerMinute,
    /// G95: length per revolution.
    PerRevolution,
}

/// The motion that words of axes alone go on with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// G0.
    Rapid,
    /// G1.
    Feed,
    /// G2.
    Clockwise,
    /// G3.
    Counterclockwise,
    /// A canned cycle, in tenths: G81 is 810.
    Cycle(u16),
}

impl Motion {
    /// Word.
    #[must_use]
    pub fn word(self) -> String {
        match self {
            Self::Rapid => "G0".to_owned(),
            Self::Feed => "G1".to_owned(),
            Self::Clockwise => "G2".to_owned(),
            Self::Counterclockwise => "G3".to_owned(),
            Self::Cycle(tenths) => format!("G{}", tenths / 10),
        }
    }
}

/// What the spindle does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spindle {
    /// M5.
    Stands,
    /// M3.
    Clockwise,
    /// M4.
    Counterclockwise,
}

impl Spindle {
    /// Word.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Stands => "M5",
            Self::Clockwise => "M3",
            Self::Counterclockwise => "M4",
        }
    }
}

/// How a motion goes by G40, G41 and G42.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cutter {
    /// The tip goes where the program says.
    Off,
    /// The path gets its offset, another one, or loses it, along all of the motion.
    Changes,
    /// Beside the path of the program.
    On,
}

/// Where a cycle ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Retract {
    /// G98: where the normal axis was before the first cycle of a series.
    Initial,
    /// G99: at R.
    Plane,
}

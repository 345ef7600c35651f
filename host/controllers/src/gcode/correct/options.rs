//! How a program is corrected.

/// What becomes of the step where an axis turns round.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Backlash {
    /// A move of its own before the reversal.
    #[default]
    Move,
    /// Part of the next move.
    Blend,
    /// Left out.
    ///
    /// Corrections are those of the direction before, which the first motion tells where it is not known.
    Leave,
}

impl Backlash {
    /// As the command has it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Move => "move",
            Self::Blend => "blend",
            Self::Leave => "leave",
        }
    }

    /// True if a step that is taken is a move of its own.
    #[must_use]
    pub(crate) fn is_apart(self) -> bool {
        self != Self::Blend
    }
}

/// How a program is corrected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// How far straight moves may be from the corrected path (mm).
    pub tolerance: f64,
    /// How far the direction of the tool may be (rad).
    pub direction: f64,
    /// Sagitta of the chords that arcs become (mm).
    pub chord: f64,
    /// Reversals.
    pub backlash: Backlash,
    /// Cut moves under G41 and G42 too.
    pub cut_under_cutter: bool,
}

impl Default for Options {
    /// 0.5 µm, 1 µrad, chords of 1 µm.
    fn default() -> Self {
        Self {
            tolerance: 0.5e-3,
            direction: 1e-6,
            chord: 1e-3,
            backlash: Backlash::Move,
            cut_under_cutter: false,
        }
    }
}

//! How a program is corrected.

use crate::axes::{COUNT, PerLetter, is_rotary};
use crate::modal::Units;
use crate::number;

/// What becomes of the step where an axis reverses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Backlash {
    /// A move of its own, before the one that reverses, unless the tolerance lets that straight move make it up.
    #[default]
    Move,
    /// Taken up over the first millimetre of the move that reverses.
    Blend,
    /// Left out.
    ///
    /// Corrections are those of the direction before, which the first motion tells where it is not known.
    Leave,
}

/// How a program is corrected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// How far moves may be from the corrected path (mm).
    pub tolerance: f64,
    /// How far a hole of a canned cycle may be from its corrected place, anywhere along it (mm).
    pub hole_tolerance: f64,
    /// How far the direction of the tool may be (rad).
    pub direction: f64,
    /// Sagitta of the chords that replace what no arc can follow (mm).
    pub chord: f64,
    /// Reversals.
    pub backlash: Backlash,
    /// Divide moves under G41 and G42 too.
    pub cut_under_cutter: bool,
    /// Decimals of words in mm, if they are not 4; inches get one more.
    pub decimals: Option<usize>,
    /// Inserted lines get a sub-number of their line: N10.1.
    pub sub_numbers: bool,
}

impl Default for Options {
    /// 0.5 µm, holes 5 µm, 1 µrad, chords of 1 µm.
    fn default() -> Self {
        Self {
            tolerance: 0.5e-3,
            hole_tolerance: 5e-3,
            direction: 1e-6,
            chord: 1e-3,
            backlash: Backlash::Move,
            cut_under_cutter: false,
            decimals: None,
            sub_numbers: false,
        }
    }
}

impl Options {
    /// Decimals of an axis' words.
    #[must_use]
    pub fn decimals(&self, axis: usize, units: Units) -> usize {
        match (self.decimals, is_rotary(axis), units) {
            (None, ..) => number::decimals(axis, units),
            (Some(decimals), false, Units::Inch) => decimals + 1,
            (Some(decimals), ..) => decimals,
        }
    }

    /// The last digit of an axis' words (mm, degrees).
    #[must_use]
    pub fn resolution(&self, axis: usize, units: Units) -> f64 {
        let unit = if is_rotary(axis) { 1.0 } else { units.mm() };
        unit * number::last_digit(self.decimals(axis, units))
    }

    /// Like `resolution`, of every axis, in the units where it is coarser.
    #[must_use]
    pub fn resolutions(&self) -> PerLetter {
        std::array::from_fn::<f64, COUNT, _>(|axis| {
            let [mm, inch] = [Units::Millimetre, Units::Inch];
            self.resolution(axis, mm).max(self.resolution(axis, inch))
        })
    }

    /// What rounding the words of X, Y and Z costs at most (mm), where fewer decimals than usual are asked for.
    #[must_use]
    pub fn rounding(&self, units: Units) -> f64 {
        match self.decimals {
            None => 0.0,
            // Half of the last digit of words, and all of it of axes that are left as they are.
            Some(_) => 3_f64.sqrt() * self.resolution(0, units),
        }
    }

    /// Like `rounding`, in the units where it is more.
    #[must_use]
    pub fn coarsest_rounding(&self) -> f64 {
        let [mm, inch] = [Units::Millimetre, Units::Inch];
        self.rounding(mm).max(self.rounding(inch))
    }

    /// Like `coarsest_rounding`, of the words of two rotary axes (rad).
    #[must_use]
    pub fn angle_rounding(&self) -> f64 {
        match self.decimals {
            None => 0.0,
            Some(_) => (2_f64.sqrt() * self.resolution(3, Units::Millimetre)).to_radians(),
        }
    }
}

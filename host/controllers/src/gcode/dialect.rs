//! What differs between controllers.

use super::axes::{self, NOTHING, PerLetter};

/// Whose language a program is in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Dialect {
    /// LinuxCNC.
    #[default]
    #[cfg_attr(feature = "clap", value(name = "linuxcnc", help = None))]
    LinuxCnc,
    /// Grbl.
    #[cfg_attr(feature = "clap", value(help = None))]
    Grbl,
    /// grblHAL: Grbl with canned cycles, tool lengths and feeds per revolution.
    #[cfg_attr(feature = "clap", value(name = "grblhal", help = None))]
    GrblHal,
    /// Fanuc, Haas and their kin.
    #[cfg_attr(feature = "clap", value(help = None))]
    Fanuc,
}

impl Dialect {
    /// The length (mm, degrees) that a feed per minute counts, of a straight move by so much on each axis.
    ///
    /// LinuxCNC counts X, Y and Z if any of them moves, otherwise U, V and W, otherwise A, B and C; the others
    /// count every axis that moves, degrees as if they were mm.
    #[must_use]
    pub fn length(self, by: &PerLetter) -> f64 {
        let moves = |d: &&f64| d.abs() >= NOTHING;
        let norm = |from: usize, to: usize| {
            let squares = by[from..to].iter().filter(moves).map(|d| d * d);
            squares.sum::<f64>().sqrt()
        };
        match self {
            Self::LinuxCnc => {
                let linear = norm(0, 3);
                let others = norm(6, 9);
                if linear > 0.0 {
                    linear
                } else if others > 0.0 {
                    others
                } else {
                    norm(3, 6)
                }
            }
            Self::Grbl | Self::GrblHal | Self::Fanuc => norm(0, axes::COUNT),
        }
    }

    /// The same of an arc or helix whose way in X, Y and Z is so long, while all axes together move by so much.
    #[must_use]
    pub(crate) fn arc_length(self, linear: f64, by: &PerLetter) -> f64 {
        match self {
            Self::LinuxCnc => linear,
            Self::Grbl | Self::GrblHal | Self::Fanuc => {
                by[3..].iter().fold(linear, |sum, d| sum.hypot(*d))
            }
        }
    }

    /// Most bytes of a line that is written.
    #[must_use]
    pub(crate) fn longest_line(self) -> usize {
        match self {
            Self::LinuxCnc | Self::GrblHal => 255,
            Self::Grbl => 79,
            Self::Fanuc => 200,
        }
    }
}

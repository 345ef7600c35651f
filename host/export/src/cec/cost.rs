//! Permitted costs of a plan, and what a plan costs.

use super::axes::NamedAxes;
use serde::Serialize;
use std::fmt;

/// What to do with products of functions of more than two axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum LongProducts {
    /// Write nothing and print what they would cost.
    Refuse,
    /// Leave them out.
    Drop,
}

/// Permitted difference between a file and the compensation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CecTolerance {
    /// On linear axes.
    pub um: f64,
    /// On rotary axes.
    pub urad: f64,
}

/// A product of functions of more than two axes, and the error without it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Long {
    /// Letter of the corrected axis.
    pub output: char,
    /// The axes.
    pub inputs: Vec<char>,
    /// Error if it is left out (µm, µrad).
    pub dropped: f64,
    /// `µm` or `µrad`.
    pub unit: &'static str,
}

/// Costs of a plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Note {
    /// A curve, or a product of functions of one axis, was sampled at new points.
    Resampled {
        /// Letter of the corrected axis.
        output: char,
        /// Letter of the axis of the table.
        input: char,
        /// Values of the table.
        points: usize,
        /// Largest error (µm or µrad).
        cost: f64,
        /// `µm` or `µrad`.
        unit: &'static str,
    },
    /// A product was left out.
    Dropped(Long),
    /// A weight can no longer be set.
    Fixed {
        /// Letter of the corrected axis.
        output: char,
        /// The weight.
        weight: f64,
    },
}

impl Note {
    /// `µm` or `µrad`.
    pub(super) fn unit(axes: &NamedAxes, output: usize) -> &'static str {
        if axes.is_rotary(output) {
            "µrad"
        } else {
            "µm"
        }
    }
}

impl fmt::Display for Long {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let inputs: Vec<String> = self.inputs.iter().map(char::to_string).collect();
        let (output, inputs) = (self.output, inputs.join(" and "));
        write!(
            f,
            "d{output} by {inputs}: {:.3} {} if dropped",
            self.dropped, self.unit
        )
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Resampled {
                output,
                input,
                points,
                cost,
                unit,
            } => write!(
                f,
                "d{output} by {input} is resampled at {points} points: {cost:.4} {unit} at most"
            ),
            Self::Dropped(long) => write!(f, "dropped: d{long}"),
            Self::Fixed { output, weight } => {
                write!(
                    f,
                    "d{output} has the weight {weight} for good: the controller changes those of single tables, by a factor"
                )
            }
        }
    }
}

//! Options for reading a file.

use super::FactorTables;
use super::axes::NamedAxes;

/// The unit of lengths in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum LengthUnit {
    /// mm.
    Metric,
    /// 25.4 mm.
    Inch,
}

impl LengthUnit {
    /// Millimetres per unit.
    pub(super) fn mm(self) -> f64 {
        match self {
            Self::Metric => 1.0,
            Self::Inch => 25.4,
        }
    }
}

/// The meaning of the values of a measuring-system compensation (`$AA_ENC_COMP`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum EncoderValues {
    /// Added to the command.
    ///
    /// Like those of the other tables.
    Corrections,
    /// Added to the measured position, so the command is corrected by the opposite.
    Opposite,
}

/// Options for reading a file.
#[derive(Clone, Copy, Debug)]
pub struct ReadOptions<'a> {
    /// The axes and their names.
    pub axes: &'a NamedAxes,
    /// Whether factor tables are also added.
    pub factor_tables: FactorTables,
    /// Unit of lengths, if the file does not specify it.
    pub units: Option<LengthUnit>,
    /// The meaning of the values of `$AA_ENC_COMP`, if there are any.
    pub encoder: Option<EncoderValues>,
}

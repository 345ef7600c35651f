//! How a file is to be read.

use super::FactorTables;
use super::axes::Axes;

/// The unit of lengths in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Units {
    /// mm.
    Metric,
    /// 25.4 mm.
    Inch,
}

impl Units {
    /// Millimetres per unit.
    pub(super) fn mm(self) -> f64 {
        match self {
            Self::Metric => 1.0,
            Self::Inch => 25.4,
        }
    }
}

/// What the values of a measuring-system compensation (`$AA_ENC_COMP`) are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum EncoderValues {
    /// To be added to the command.
    ///
    /// Like those of the other tables.
    Corrections,
    /// The position that is read is corrected by them: the command by the opposite.
    Opposite,
}

/// How a file is to be read.
#[derive(Clone, Copy, Debug)]
pub struct Reading<'a> {
    /// The axes and their names.
    pub axes: &'a Axes,
    /// Whether factor tables are added, too.
    pub factor_tables: FactorTables,
    /// Unit of lengths, if the file does not say.
    pub units: Option<Units>,
    /// What the values of `$AA_ENC_COMP` are, if there are any.
    pub encoder: Option<EncoderValues>,
}

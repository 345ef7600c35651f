//! Why a blob was refused.

mod message;

use core::fmt;

use crate::room::Counts;

/// A part of the description, with its index where there are several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "link", derive(serde::Serialize, serde::Deserialize))]
pub enum Part {
    /// Name of the machine.
    Machine,
    /// Correction policy.
    Policy,
    /// Numbers of samples.
    SampleCounts,
    /// The axes as a whole: their number.
    Axes,
    /// One axis.
    Axis(u16),
    /// The auxiliaries as a whole: their number.
    Auxiliaries,
    /// One auxiliary input.
    Auxiliary(u16),
    /// The banks as a whole: their number.
    Banks,
    /// One bank.
    Bank(u16),
    /// The terms as a whole: their number.
    Terms,
    /// One term.
    Term(u16),
    /// The grids as a whole: their number.
    Grids,
    /// One grid.
    Grid(u16),
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Machine => f.write_str("machine name"),
            Self::Policy => f.write_str("policy"),
            Self::SampleCounts => f.write_str("sample counts"),
            Self::Axes => f.write_str("number of axes"),
            Self::Axis(i) => write!(f, "axis {i}"),
            Self::Auxiliaries => f.write_str("number of auxiliaries"),
            Self::Auxiliary(i) => write!(f, "auxiliary {i}"),
            Self::Banks => f.write_str("number of banks"),
            Self::Bank(i) => write!(f, "bank {i}"),
            Self::Terms => f.write_str("number of terms"),
            Self::Term(i) => write!(f, "term {i}"),
            Self::Grids => f.write_str("number of grids"),
            Self::Grid(i) => write!(f, "grid {i}"),
        }
    }
}

/// Why a blob was refused. Indices count from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "link", derive(serde::Serialize, serde::Deserialize))]
pub enum LoadError {
    /// Fewer bytes than a header.
    NoHeader,
    /// The first four bytes are not `TRAX`.
    BadMagic,
    /// A format version that this build does not know.
    UnknownVersion {
        /// The version found.
        found: u16,
    },
    /// The header states more bytes of notes than there are.
    Notes {
        /// Length of the notes stated in the header.
        stated: u16,
    },
    /// The length stated in the header differs from the number of bytes.
    WrongLength {
        /// Length stated in the header.
        stated: u32,
        /// Actual number of bytes.
        held: u32,
    },
    /// The checksum does not match.
    BadChecksum,
    /// The blob does not start at a multiple of 4 bytes, so its samples cannot be read in place.
    Misaligned,
    /// The blob ends within this part.
    Truncated {
        /// The part that is cut off.
        part: Part,
    },
    /// This part is not valid postcard (text that is not UTF-8, an overlong integer, a name that
    /// is too long, a flag that is neither 0 nor 1).
    Malformed {
        /// The malformed part.
        part: Part,
    },
    /// A variant of an enumeration that is unknown to this version.
    UnknownVariant {
        /// The part that contains it.
        part: Part,
        /// The variant found.
        found: u32,
    },
    /// The target holds fewer axes, banks, tables, terms or grids than the blob needs. All rules that do not depend on
    /// capacities have already been checked.
    TooSmall {
        /// What the blob needs.
        needed: Counts,
        /// Capacities of the target.
        held: Counts,
    },
    /// More tables than a factor can index (255).
    TooManyTables {
        /// Number of tables.
        found: u32,
    },
    /// More auxiliaries than [`AUXILIARIES`](crate::AUXILIARIES).
    TooManyAuxiliaries {
        /// Number of auxiliaries.
        found: u32,
    },
    /// More adjustable terms than [`ADJUSTABLE`](crate::ADJUSTABLE); reports the first one in excess.
    TooManyAdjustable {
        /// Index of the term.
        term: u16,
    },
    /// There are no axes.
    NoAxes,
    /// The name of an axis is not an ASCII letter.
    AxisName {
        /// Index of the axis.
        axis: u16,
    },
    /// An earlier axis has the same name.
    DuplicateAxis {
        /// Index of the later axis.
        axis: u16,
    },
    /// The travel of an axis is not finite, or its lower end is not below its upper end.
    Travel {
        /// Index of the axis.
        axis: u16,
    },
    /// The value bound of an axis is not a number from 1e-9 to 1e9.
    ValueBound {
        /// Index of the axis.
        axis: u16,
    },
    /// The rate bound of an axis is not a number from 1e-9 to 1e9.
    RateBound {
        /// Index of the axis.
        axis: u16,
    },
    /// The reversal threshold of an axis is not a number from 0 to 1e9.
    ReversalThreshold {
        /// Index of the axis.
        axis: u16,
    },
    /// The ramp rate of an axis is not a number from 1e-9 to 1e9.
    RampRate {
        /// Index of the axis.
        axis: u16,
    },
    /// The reference of an auxiliary is not finite.
    Reference {
        /// Index of the auxiliary.
        auxiliary: u16,
    },
    /// A bank or grid refers to an input that does not exist.
    Input {
        /// The bank or grid.
        part: Part,
        /// The input it names.
        input: u8,
    },
    /// The position of the first or last point is not finite.
    Start {
        /// The bank or grid.
        part: Part,
    },
    /// The step is zero, negative, not finite, or so small that its inverse is not finite.
    Step {
        /// The bank or grid.
        part: Part,
    },
    /// Fewer than 2 points, or more than 2²⁴.
    Points {
        /// The bank or grid.
        part: Part,
        /// Actual number of points.
        points: u32,
    },
    /// The period `points · step` of a modulo input or its inverse is not finite.
    Period {
        /// The bank or grid.
        part: Part,
    },
    /// A bank depends on the direction of an auxiliary input, which has no direction.
    DirectionOfAuxiliary {
        /// Index of the bank.
        bank: u16,
    },
    /// A bank without tables.
    EmptyBank {
        /// Index of the bank.
        bank: u16,
    },
    /// Integer samples need one scale per table (bank) or output (grid), other samples none.
    ScaleCount {
        /// The bank or grid.
        part: Part,
        /// Actual number of scales.
        found: u32,
    },
    /// A scale is not a number from 1e-30 to 1e9.
    Scale {
        /// The bank or grid.
        part: Part,
        /// Index of the scale within it.
        index: u16,
    },
    /// The samples do not start where the previous ones end: they overlap or leave a gap.
    SamplesMisplaced {
        /// The bank or grid.
        part: Part,
    },
    /// The samples end outside their section.
    SamplesOutside {
        /// The bank or grid.
        part: Part,
    },
    /// Samples that belong to no bank or grid.
    UnusedSamples,
    /// A sample of a table is not finite.
    TableSample {
        /// Index of the table, counted through all banks.
        table: u16,
        /// Index of the point.
        point: u32,
    },
    /// A sample of a grid is not finite.
    GridSample {
        /// Index of the grid.
        grid: u16,
        /// Index of the node.
        node: u32,
    },
    /// A value of a table may exceed 1e15.
    TableMagnitude {
        /// Index of the table, counted through all banks.
        table: u16,
    },
    /// A term names an output axis that does not exist.
    TermOutput {
        /// Index of the term.
        term: u16,
    },
    /// The weight of a term is not finite.
    Weight {
        /// Index of the term.
        term: u16,
    },
    /// The limits of a term are not finite, or the lower is above the upper.
    Limits {
        /// Index of the term.
        term: u16,
    },
    /// The weight of a term is outside its limits.
    WeightOutsideLimits {
        /// Index of the term.
        term: u16,
    },
    /// A product has more tables than [`FACTORS`](crate::FACTORS).
    TooManyFactors {
        /// Index of the term.
        term: u16,
        /// Number of tables.
        found: u32,
    },
    /// A term names a table that does not exist.
    Factor {
        /// Index of the term.
        term: u16,
        /// The table it names.
        table: u8,
    },
    /// A product of a term may exceed 1e15.
    TermMagnitude {
        /// Index of the term.
        term: u16,
    },
    /// The sum of an output axis may exceed 1e15.
    OutputMagnitude {
        /// Index of the axis.
        axis: u16,
    },
    /// The number of inputs of a grid is not one to three.
    GridInputs {
        /// Index of the grid.
        grid: u16,
        /// Number of inputs.
        found: u32,
    },
    /// The number of outputs of a grid is not one to six, or it names an axis twice or one that does not exist.
    GridOutputs {
        /// Index of the grid.
        grid: u16,
    },
    /// The padding after the description is not zero.
    PaddingNotZero,
    /// The length computed from the description and the sample counts differs from the one stated in the header.
    SectionLength {
        /// Length stated in the header, without the notes.
        stated: u32,
        /// Computed length; `u32::MAX` if it is larger.
        computed: u32,
    },
    /// The period of an axis is neither 0 nor a number from 1e-9 to 1e9.
    AxisPeriod {
        /// Index of the axis.
        axis: u16,
    },
    /// An axis has a period, so it is endless, but its travel has an end.
    EndlessTravel {
        /// Index of the axis.
        axis: u16,
    },
    /// The period of a modulo input does not divide that of its axis, so the input would have two values at the same
    /// place.
    PeriodMismatch {
        /// The bank or grid.
        part: Part,
    },
    /// The damping of the policy is not a number from 0.01 to 1.
    Damping,
    /// The header states more than [`LARGEST_BLOB`](crate::LARGEST_BLOB) bytes.
    TooLong {
        /// Length stated in the header.
        stated: u32,
    },
    /// The rate of a lag is neither 0 nor a number from 1e-7 to 1 per s.
    LagRate {
        /// Index of the auxiliary.
        auxiliary: u16,
    },
    /// The rate or the acceleration with which an axis makes up a reversal is not a number from 1e-9 to 1e9.
    Reversal {
        /// Index of the axis.
        axis: u16,
    },
    /// The rate of a temperature is not a number from 0.01 to 10 K/s, its reference or its plausible range goes beyond
    /// ±1000 °C, or the range is empty.
    Sensor {
        /// Index of the auxiliary.
        auxiliary: u16,
    },
}

impl core::error::Error for LoadError {}

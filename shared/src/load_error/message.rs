//! Refusals in words.

use core::fmt;

use super::{LoadError, Part};
use crate::description::{ADJUSTABLE, AUXILIARIES, FACTORS};
use crate::format::{LARGEST_BLOB, VERSION};

impl fmt::Display for LoadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.of_whole(), self.of_part()) {
            (Some(fault), _) => f.write_str(fault),
            (_, Some((part, fault))) => write!(f, "{part}: {fault}"),
            _ => self.write_numbers(f),
        }
    }
}

impl LoadError {
    /// What is wrong with the blob as a whole.
    fn of_whole(self) -> Option<&'static str> {
        Some(match self {
            Self::NoHeader => "fewer than the 16 bytes of a header",
            Self::BadMagic => "not a compensation: it does not start with TRAX",
            Self::BadChecksum => "the checksum does not match: the bytes are damaged",
            Self::Misaligned => "the blob must start at a multiple of 4 bytes",
            Self::NoAxes => "no axes",
            Self::UnusedSamples => "some samples belong to no bank or grid",
            Self::Damping => "the damping must be a number from 0.01 to 1",
            Self::PaddingNotZero => "the padding after the description is not zero",
            _ => return None,
        })
    }

    /// A part, and what is wrong with it.
    fn of_part(self) -> Option<(Part, &'static str)> {
        let axis = |axis, fault| (Part::Axis(axis), fault);
        let auxiliary = |auxiliary, fault| (Part::Auxiliary(auxiliary), fault);
        let term = |term, fault| (Part::Term(term), fault);
        Some(match self {
            Self::AxisName { axis: i } => axis(i, "the name must be an ASCII letter"),
            Self::Travel { axis: i } => axis(i, "the travel must be finite, lower end first"),
            Self::AxisPeriod { axis: i } => axis(i, "the period must be 0, or from 1e-9 to 1e9"),
            Self::ValueBound { axis: i } => axis(i, "the value bound must be from 1e-9 to 1e9"),
            Self::RateBound { axis: i } => axis(i, "the rate bound must be from 1e-9 to 1e9"),
            Self::ReversalThreshold { axis: i } => {
                axis(i, "the reversal threshold must be from 0 to 1e9")
            }
            Self::RampRate { axis: i } => axis(i, "the ramp rate must be from 1e-9 to 1e9"),
            Self::Reversal { axis: i } => axis(
                i,
                "rate and acceleration of a reversal must be from 1e-9 to 1e9",
            ),
            Self::OutputMagnitude { axis: i } => axis(i, "the sum of its terms may exceed 1e15"),
            Self::Reference { auxiliary: i } => auxiliary(i, "the reference must be finite"),
            Self::LagRate { auxiliary: i } => {
                auxiliary(i, "the rate of its lag must be 0, or from 1e-7 to 1")
            }
            Self::Sensor { auxiliary: i } => {
                auxiliary(i, "it must be followed at 0.01 to 10 K/s, within ±1000 °C")
            }
            Self::Start { part } => (part, "first and last point must be finite"),
            Self::Step { part } => (part, "the step must be positive and finite"),
            Self::Period { part } => (part, "the period must be finite"),
            Self::PeriodMismatch { part } => (part, "the period must divide that of the axis"),
            Self::DirectionOfAuxiliary { bank } => {
                (Part::Bank(bank), "an auxiliary input has no direction")
            }
            Self::SamplesMisplaced { part } => {
                (part, "the samples do not start where those before them end")
            }
            Self::SamplesOutside { part } => (part, "the samples end outside the blob"),
            Self::TermOutput { term: i } => term(i, "the output axis does not exist"),
            Self::Weight { term: i } => term(i, "the weight is not finite"),
            Self::Limits { term: i } => term(i, "the limits must be finite, the lower first"),
            Self::WeightOutsideLimits { term: i } => term(i, "the weight is outside its limits"),
            Self::TermMagnitude { term: i } => term(i, "its product may exceed 1e15"),
            Self::GridOutputs { grid } => (
                Part::Grid(grid),
                "must have 1 to 6 different, existing outputs",
            ),
            _ => return None,
        })
    }

    /// Writes what is wrong in numbers; nothing for the errors above.
    fn write_numbers(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::UnknownVersion { found } => {
                write!(
                    f,
                    "format version {found} is unknown here (known: {VERSION})"
                )
            }
            Self::Notes { stated } => {
                write!(
                    f,
                    "the header states {stated} bytes of notes, more than there are"
                )
            }
            Self::WrongLength { stated, held } => {
                write!(f, "the header states {stated} bytes, there are {held}")
            }
            Self::TooLong { stated } => write!(
                f,
                "the header states {stated} bytes, a blob has at most {LARGEST_BLOB}"
            ),
            Self::Truncated { part } => write!(f, "the description ends within: {part}"),
            Self::Malformed { part } => write!(f, "the encoding is not valid: {part}"),
            Self::UnknownVariant { part, found } => {
                write!(f, "variant {found} is unknown: {part}")
            }
            Self::TooSmall { needed, held } => {
                f.write_str("too large for this target: ")?;
                for (what, needed, held) in needed.shortages(held) {
                    write!(f, "{needed} {what}, of which it holds {held}; ")?;
                }
                write!(f, "raise its capacities to {}", needed.larger(held))
            }
            Self::TooManyTables { found } => {
                write!(f, "{found} tables, at most 255 can be numbered")
            }
            Self::TooManyAuxiliaries { found } => {
                write!(f, "{found} auxiliaries, at most {AUXILIARIES}")
            }
            Self::TooManyAdjustable { term } => write!(
                f,
                "term {term} is one adjustable term too many, at most {ADJUSTABLE}"
            ),
            Self::DuplicateAxis { axis } => {
                write!(f, "axis {axis} has the name of an earlier axis")
            }
            Self::EndlessTravel { axis } => write!(
                f,
                "axis {axis} has a period: its travel must be without end"
            ),
            Self::Input { part, input } => write!(f, "{part}: input {input} does not exist"),
            Self::Points { part, points } => {
                write!(f, "{part}: {points} points, must be 2 to 16777216")
            }
            Self::EmptyBank { bank } => write!(f, "bank {bank} has no tables"),
            Self::ScaleCount { part, found } => {
                write!(f, "{part}: {found} scales do not fit its samples")
            }
            Self::Scale { part, index } => {
                write!(f, "{part}: scale {index} must be from 1e-30 to 1e9")
            }
            Self::TableSample { table, point } => {
                write!(f, "table {table}: point {point} is not finite")
            }
            Self::GridSample { grid, node } => write!(f, "grid {grid}: node {node} is not finite"),
            Self::TableMagnitude { table } => write!(f, "table {table} may exceed 1e15"),
            Self::TooManyFactors { term, found } => {
                write!(f, "term {term}: {found} factors, at most {FACTORS}")
            }
            Self::Factor { term, table } => write!(f, "term {term}: table {table} does not exist"),
            Self::GridInputs { grid, found } => {
                write!(f, "grid {grid}: {found} inputs, must be 1 to 3")
            }
            Self::SectionLength { stated, computed } => write!(
                f,
                "the header states {stated} bytes, description and samples take {computed}"
            ),
            _ => Ok(()),
        }
    }
}

//! Why a compensation cannot be exported.

use super::cost::Long;
use trueaxis_model::numbers::by;

/// Why the tables of the controller cannot hold a compensation.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CecError {
    /// The compensation has grids, which have two or three inputs.
    #[error("the compensation has a grid, and a table of the controller has one input")]
    Grid,
    /// There would be no tables.
    #[error("the compensation corrects nothing that tables of the controller can")]
    Nothing,
    /// More axes than this program supports.
    #[error("the compensation has {0} axes, more than a machine")]
    Axes(usize),
    /// A tool length was given, but is not an input.
    #[error(
        "the tool length is not an input of the compensation: its tables are for one tool already"
    )]
    NoLength,
    /// A tool length outside those that the compensation is for.
    #[error("the tool length {length} mm is not between {} and {} mm, for which the compensation is", .range[0], .range[1])]
    Length {
        /// The length (mm).
        length: f64,
        /// The shortest and the longest (mm).
        range: [f64; 2],
    },
    /// Products of functions of more than two axes.
    #[error("{} of more than two tables, and the controller multiplies two: {}", count(.0), list(.0))]
    Long(Vec<Long>),
    /// Not enough tables.
    #[error("the compensation takes {needed} tables, and there are {room} from number {first} on")]
    Tables {
        /// Tables needed.
        needed: usize,
        /// Tables available.
        room: usize,
        /// Number of the first table.
        first: usize,
    },
    /// Products are too large for the limit of factors.
    #[error(
        "the products of axis {axis} cannot be written with factor tables of at most {limit}: that takes {least:.4}"
    )]
    Factor {
        /// Letter of the axis.
        axis: char,
        /// The limit.
        limit: f64,
        /// A limit that works for all axes, rounded up to four decimals.
        least: f64,
    },
    /// A modulo table multiplied by one with another period, on an axis without limits.
    #[error(
        "tables of the axis {0} with different periods are multiplied, or one without a period"
    )]
    Periods(char),
}

/// Number of products listed, the most expensive ones.
const SHOWN: usize = 4;

fn count(long: &[Long]) -> String {
    match long.len() {
        1 => "a product".to_owned(),
        n => format!("{n} products"),
    }
}

fn list(long: &[Long]) -> String {
    let sorted = by(long.iter().collect::<Vec<&Long>>(), |one| -one.dropped);
    let (shown, rest) = sorted.split_at(sorted.len().min(SHOWN));
    let mut each: Vec<String> = shown.iter().map(ToString::to_string).collect();
    if !rest.is_empty() {
        let most = rest[0].dropped;
        each.push(format!("{} more of at most {most:.3} each", rest.len()));
    }
    each.join("; ")
}

impl CecError {
    /// What to do about the error.
    #[must_use]
    pub fn remedy(&self) -> String {
        let remedy = match self {
            Self::Grid => "compile it with --scheme exact, which makes products of tables",
            Self::Nothing => "look at it with `trueaxis inspect`",
            Self::Axes(_) => "give a compensation that trueaxis has compiled",
            Self::NoLength => {
                "leave out --tool-length, or compile with length_range_mm in the machine file"
            }
            Self::Length { .. } => {
                "give a length in between, or compile with another length_range_mm in the machine file"
            }
            Self::Long(_) => {
                "accept the stated cost with --long-products drop, or compile with a larger \
                 --tolerance or --policy position"
            }
            Self::Tables { .. } => {
                "compile with a larger --tolerance, leave errors out that matter little (`trueaxis report` lists their shares), or raise --tables if the controller has more"
            }
            Self::Factor { least, .. } => {
                return format!(
                    "give --factor-limit {least:.4} or more: it bounds what a wrong --factor-tables could do"
                );
            }
            Self::Periods(_) => "compile it again with a larger --tolerance",
        };
        remedy.to_owned()
    }
}

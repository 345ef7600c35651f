//! Sinumerik 840D: a compensation as tables of the *interpolatory compensation* (CEC), and back.
//!
//! A controller with these tables adds to the commanded position of an axis the values of all tables for that axis,
//! each a function of the commanded position of one axis, and products of two of them. Rules (source document,
//! §2.4.5.3 and Figure 7.3; manual *Extended Functions*):
//!
//! - One input axis and one output axis per table; values at `MIN + k · STEP`, linear interpolation, the first and
//!   the last value held outside.
//! - `MULT_BY_TABLE` of a table is the *number* of another one with the same output, its index + 1: the product of
//!   both is added. Whether the other table is also added by itself is not settled: [`FactorTables`].
//! - `IS_MODULO`: the period is `MAX − MIN`, and both ends are stored, with equal values.
//! - `DIRECTION` 1 or −1: the table only applies for that direction of travel of its input.
//! - The table weight multiplies its values; here it is 1, and read only of tables that are not part of a product.
//!
//! [`read()`] and [`print()`] handle the language, [`plan()`] adapts a compensation to the rules, [`draft()`] makes
//! one from tables, [`prove()`] compares both.

mod axes;
mod collect;
mod controller;
mod cost;
mod draft;
mod error;
mod extent;
mod function;
mod head;
mod limit;
mod literal;
mod multiplied;
mod plan;
mod plausibility;
mod print;
mod probe;
mod prove;
mod raw;
mod read;
mod reading;
mod source;
mod spacing;
mod statement;
mod terms;
mod variable;

#[cfg(test)]
mod dialects;
#[cfg(test)]
mod oracle;
#[cfg(test)]
mod plan_cost;
#[cfg(test)]
mod round_trip;
#[cfg(test)]
mod specimen;

pub use axes::{AxesError, NamedAxes, is_name};
pub use controller::TableLimits;
pub use cost::{CecTolerance, Long, LongProducts, Note};
pub use draft::draft;
pub use error::CecError;
pub use head::{comments, for_tool};
pub use limit::{CorrectionLimit, Limited};
pub use plan::{CecOptions, CecPlan, plan};
pub use print::print;
pub use probe::probe;
pub use prove::{AxisDifference, CecProof, ProveError, prove};
pub use read::{CecContent, read};
pub use reading::{EncoderValues, LengthUnit, ReadOptions};

pub use spacing::Spacing;

use serde::Serialize;
use std::collections::BTreeMap;

/// Whether a table that another one names by `MULT_BY_TABLE` is added by itself in addition to being a factor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum FactorTables {
    /// A table that another one is multiplied by is also added.
    ///
    /// f·g + f.
    Added,
    /// It is not added.
    ///
    /// f·g.
    NotAdded,
}

impl FactorTables {
    /// Name of the option.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Added => "added",
            Self::NotAdded => "not-added",
        }
    }

    /// The other interpretation.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::Added => Self::NotAdded,
            Self::NotAdded => Self::Added,
        }
    }
}

/// The direction of travel of its input for which a table applies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum TravelDirection {
    /// Always.
    Both,
    /// While the input last moved positive.
    Positive,
    /// While the input last moved negative.
    Negative,
}

/// One table of the controller.
#[derive(Clone, Debug, PartialEq)]
pub struct CecTable {
    /// Index of the axis that is its input.
    pub input: usize,
    /// Index of the corrected axis.
    pub output: usize,
    /// Points of the table.
    pub spacing: Spacing,
    /// Values at the points: mm or degrees, or a dimensionless factor. With modulo, the last value, which equals the
    /// first, is left out.
    pub values: Vec<f32>,
    /// The direction of travel for which it applies.
    pub travel: TravelDirection,
    /// Factor of its values.
    pub weight: f32,
    /// Index, among the tables, of the one that it is multiplied by.
    pub times: Option<usize>,
}

impl CecTable {
    /// Largest magnitude.
    #[must_use]
    pub fn peak(&self) -> f32 {
        self.values.iter().fold(0.0, |peak, v| v.abs().max(peak))
    }

    /// Number of values that the controller stores: with modulo the first one twice.
    #[must_use]
    pub fn stored(&self) -> usize {
        self.values.len() + usize::from(self.spacing.modulo)
    }
}

/// True for each table that another one names by `MULT_BY_TABLE`.
#[must_use]
pub fn named(tables: &[CecTable]) -> Vec<bool> {
    let mut named = vec![false; tables.len()];
    for index in tables.iter().filter_map(|t| t.times) {
        named[index] = true;
    }
    named
}

impl CecPlan {
    /// The largest magnitude of a table that is part of a product.
    #[must_use]
    pub fn largest_factor(&self) -> f32 {
        let tables = self.tables.iter().zip(named(&self.tables));
        let factors = tables.filter(|(table, named)| *named || table.times.is_some());
        factors.map(|(table, _)| table.peak()).fold(0.0, f32::max)
    }
}

/// The axes that tables correct, each with a bound of the sum of its tables (mm, degrees), the sum of the largest
/// magnitudes of all tables and products. The controller's limit of the sum, MD32720, must permit it.
#[must_use]
pub fn largest_sums(tables: &[CecTable], factor_tables: FactorTables) -> Vec<(usize, f64)> {
    let peak = |table: &CecTable| f64::from(table.peak()) * f64::from(table.weight.abs());
    let mut sums = BTreeMap::new();
    for (table, is_named) in tables.iter().zip(named(tables)) {
        let sum = sums.entry(table.output).or_insert(0.0);
        *sum += match table.times {
            Some(times) => peak(table) * peak(&tables[times]),
            None if is_named && factor_tables == FactorTables::NotAdded => 0.0,
            None => peak(table),
        };
    }
    sums.into_iter().collect()
}

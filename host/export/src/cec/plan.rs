//! Adapts a compensation to the rules of the controller.

use super::axes::NamedAxes;
use super::collect::{Factors, Output};
use super::cost::{CecTolerance, LongProducts, Note};
use super::literal::literal;
use super::source::{SourceTerm, SourceTerms};
use super::terms::ConversionForm;
use super::{CecError, CecTable, FactorTables, TableLimits, named};
use trueaxis::Largest;

/// Options of a plan.
#[derive(Clone, Copy, Debug)]
pub struct CecOptions {
    /// Whether the controller also adds factor tables.
    pub factor_tables: FactorTables,
    /// Capacity.
    pub limits: TableLimits,
    /// Largest magnitude of a factor.
    pub factor_limit: f64,
    /// Permitted difference of the file from the compensation.
    pub tolerance: CecTolerance,
    /// Tool length (mm), if it is an input; by default the reference.
    pub length: Option<f64>,
    /// What to do with products of functions of more than two axes.
    pub long: LongProducts,
}

/// Tables, and what they cost.
#[derive(Clone, Debug)]
pub struct CecPlan {
    /// The tables; the first has the number of [`TableLimits::first`].
    pub tables: Vec<CecTable>,
    /// Differences from the compensation.
    pub notes: Vec<Note>,
    /// Tool length (mm) for which they hold, if it was an input.
    pub length: Option<f64>,
    /// Sensors whose temperature is assumed to be the reference.
    pub sensors: Vec<String>,
    /// True if the compensation already followed the rules.
    pub is_literal: bool,
}

/// Adapts a compensation to the rules: one input and one output per table, products of two, equidistant points and
/// linear interpolation. Tables that correct several axes are copied.
///
/// # Errors
/// [`CecError`]
pub fn plan(
    compensation: &Largest<'_>,
    axes: &NamedAxes,
    options: &CecOptions,
) -> Result<CecPlan, CecError> {
    let SourceTerms {
        terms,
        length,
        sensors,
    } = SourceTerms::new(compensation, options.length)?;
    let ready = literal(compensation, options.factor_tables).filter(|t| keeps(t, options));
    let is_literal = ready.is_some();
    let mut notes = Vec::new();
    let tables = match ready {
        Some(tables) => tables,
        None => converted(terms, axes, options, &mut notes)?,
    };
    if tables.is_empty() {
        return Err(CecError::Nothing);
    }
    let TableLimits {
        first, tables: all, ..
    } = options.limits;
    let room = all.saturating_sub(first).min(255);
    if tables.len() > room {
        return Err(CecError::Tables {
            needed: tables.len(),
            room,
            first,
        });
    }
    Ok(CecPlan {
        tables,
        notes,
        length,
        sensors,
        is_literal,
    })
}

/// Tables of a compensation that does not follow the rules.
fn converted(
    terms: Vec<SourceTerm>,
    axes: &NamedAxes,
    options: &CecOptions,
    notes: &mut Vec<Note>,
) -> Result<Vec<CecTable>, CecError> {
    let form = ConversionForm {
        axes,
        points: options.limits.points,
        tolerance: options.tolerance,
        long: options.long,
    };
    let outputs = axes.axes.iter().map(|_| Output::default());
    let mut outputs: Vec<Output> = outputs.collect();
    let mut long = Vec::new();
    for term in terms {
        let output = term.output;
        if term.adjustable && (term.factors.len() != 1 || term.weight == 0.0) {
            let (output, weight) = (axes.letter(output), term.weight);
            notes.push(Note::Fixed { output, weight });
        }
        if let Some(normal) = form.normal(term, notes, &mut long)? {
            outputs[output].take(normal);
        }
    }
    if !long.is_empty() {
        return Err(CecError::Long(long));
    }
    let factors = Factors {
        tables: options.factor_tables,
        limit: options.factor_limit,
    };
    check_factors(&outputs, axes, factors)?;
    let mut tables = Vec::new();
    for (index, output) in outputs.into_iter().enumerate() {
        output.tables(index, axes.travel(index), factors, &mut tables);
    }
    Ok(tables)
}

/// Whether tables that follow the rules also respect the limits of values and of factors.
fn keeps(tables: &[CecTable], options: &CecOptions) -> bool {
    let is_named = named(tables);
    tables.iter().zip(is_named).all(|(table, is_named)| {
        let is_factor = is_named || table.times.is_some();
        let points = options.limits.points;
        points.is_none_or(|most| table.stored() <= most)
            && (!is_factor || f64::from(table.peak()) <= options.factor_limit)
    })
}

/// Checks that all factors can respect their limit.
fn check_factors(outputs: &[Output], axes: &NamedAxes, factors: Factors) -> Result<(), CecError> {
    let least = outputs.iter().map(|o| o.least_limit(factors.tables));
    let Some((index, least)) = least.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)) else {
        return Ok(());
    };
    match least <= factors.limit {
        true => Ok(()),
        false => Err(CecError::Factor {
            axis: axes.letter(index),
            limit: factors.limit,
            least: (least * 1e4).ceil() / 1e4,
        }),
    }
}

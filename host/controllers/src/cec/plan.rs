//! A compensation under the rules of the controller.

use super::axes::Axes;
use super::collect::{Factors, Output};
use super::function::Function;
use super::literal::literal;
use super::source::Source;
use super::terms::{Form, cheapest};
use super::{FactorTables, Limits, PlanError, Table, named};
use serde::Serialize;
use std::fmt;
use trueaxis::Largest;

/// What becomes of products of functions of more than two axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LongProducts {
    /// Nothing is written.
    Refuse,
    /// They are left out.
    Drop,
    /// Of each, the functions that change least are held at the middle of their values.
    Hold,
}

/// How far a file may be from what was compiled.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Tolerance {
    /// On linear axes.
    pub um: f64,
    /// On rotary axes.
    pub urad: f64,
}

/// What tables are to be like.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Whether the controller adds factor tables, too.
    pub factor_tables: FactorTables,
    /// What it holds.
    pub limits: Limits,
    /// Largest magnitude of a factor.
    pub factor_limit: f64,
    /// How far the file may be from the compensation.
    pub tolerance: Tolerance,
    /// Tool length (mm), if that is an input; the reference without.
    pub length: Option<f64>,
    /// Products of more than two axes.
    pub long: LongProducts,
}

/// A product of functions of more than two axes, and what is lost with it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Long {
    /// Letter of the corrected axis.
    pub output: char,
    /// The axes.
    pub inputs: Vec<char>,
    /// If it is left out (µm, µrad).
    pub dropped: f64,
    /// If functions are held (µm, µrad).
    pub held: f64,
    /// The axes of those.
    pub held_inputs: Vec<char>,
    /// `µm` or `µrad`.
    pub unit: &'static str,
}

/// What a plan costs.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Note {
    /// A curve or a product of functions of one axis with other points.
    Resampled {
        /// Letter of the corrected axis.
        output: char,
        /// Letter of the axis of the table.
        input: char,
        /// Values of the table.
        points: usize,
        /// µm or µrad at most.
        cost: f64,
        /// `µm` or `µrad`.
        unit: &'static str,
    },
    /// A product that is left out.
    Dropped(Long),
    /// A product of which functions are held.
    Held(Long),
    /// A weight that can no longer be set.
    Fixed {
        /// Letter of the corrected axis.
        output: char,
        /// The weight.
        weight: f64,
    },
}

impl Note {
    /// `µm` or `µrad`.
    pub(super) fn unit(axes: &Axes, output: usize) -> &'static str {
        if axes.is_rotary(output) {
            "µrad"
        } else {
            "µm"
        }
    }
}

impl fmt::Display for Long {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let letters = |of: &[char]| {
            of.iter()
                .map(char::to_string)
                .collect::<Vec<_>>()
                .join(" and ")
        };
        write!(
            f,
            "d{} by {}: {:.3} {u} if dropped, {:.3} {u} if that of {} is held",
            self.output,
            letters(&self.inputs),
            self.dropped,
            self.held,
            letters(&self.held_inputs),
            u = self.unit
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
            Self::Held(long) => write!(f, "held: d{long}"),
            Self::Fixed { output, weight } => {
                write!(
                    f,
                    "a product of d{output} has its weight {weight} for good: weights are of single tables"
                )
            }
        }
    }
}

impl Long {
    pub(super) fn new(form: &Form<'_>, output: usize, weight: f64, functions: &[Function]) -> Self {
        let whole: f64 = weight.abs() * functions.iter().map(Function::peak).product::<f64>();
        let mut left = functions.to_vec();
        let (mut held, mut scale, mut held_inputs) = (0.0, whole, Vec::new());
        while left.len() > 2 {
            let function = left.remove(cheapest(&left));
            let [low, high] = function.range();
            let peak = function.peak().max(f64::MIN_POSITIVE);
            held += scale * 0.5 * (high - low) / peak;
            scale *= 0.5 * (high + low).abs() / peak;
            held_inputs.push(form.axes.letter(function.input));
        }
        Self {
            output: form.axes.letter(output),
            inputs: functions
                .iter()
                .map(|f| form.axes.letter(f.input))
                .collect(),
            dropped: form.fine(output, whole),
            held: form.fine(output, held),
            held_inputs,
            unit: Note::unit(form.axes, output),
        }
    }
}

/// Tables, and what they cost.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The tables; the first has the number of [`Limits::first`].
    pub tables: Vec<Table>,
    /// What is not as it was compiled.
    pub notes: Vec<Note>,
    /// Tool length (mm) for which they hold, if that was an input.
    pub length: Option<f64>,
    /// Sensors whose temperature is taken to be the reference.
    pub sensors: Vec<String>,
    /// True if the compensation kept the rules already.
    pub is_literal: bool,
}

/// Brings a compensation under the rules: one input and one output per table, products of two, equidistant
/// points and straight lines. Tables that serve several axes are copied.
///
/// # Errors
/// [`PlanError`]
pub fn plan(compensation: &Largest<'_>, axes: &Axes, options: &Options) -> Result<Plan, PlanError> {
    let Source {
        terms,
        length,
        sensors,
    } = Source::new(compensation, options.length)?;
    let ready = literal(compensation, options.factor_tables).filter(|t| keeps(t, options));
    let is_literal = ready.is_some();
    let mut notes = Vec::new();
    let tables = match ready {
        Some(tables) => tables,
        None => {
            let form = Form {
                axes,
                points: options.limits.points,
                tolerance: options.tolerance,
                long: options.long,
            };
            let mut outputs: Vec<Output> = Vec::new();
            outputs.resize_with(axes.axes.len(), Output::default);
            let mut long = Vec::new();
            for term in terms {
                let (output, weight) = (term.output, term.weight);
                if term.adjustable && term.factors.len() != 1 {
                    notes.push(Note::Fixed {
                        output: axes.letter(output),
                        weight,
                    });
                }
                if let Some(normal) = form.normal(term, &mut notes, &mut long)? {
                    outputs[output].take(normal);
                }
            }
            if !long.is_empty() {
                return Err(PlanError::Long(long));
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
            tables
        }
    };
    if tables.is_empty() {
        return Err(PlanError::Nothing);
    }
    let Limits {
        first, tables: all, ..
    } = options.limits;
    let room = all.saturating_sub(first).min(255);
    if tables.len() > room {
        return Err(PlanError::Tables {
            needed: tables.len(),
            room,
            first,
        });
    }
    Ok(Plan {
        tables,
        notes,
        length,
        sensors,
        is_literal,
    })
}

/// Whether tables that keep the rules keep to the limits, too, of values and of factors.
fn keeps(tables: &[Table], options: &Options) -> bool {
    let is_named = named(tables);
    tables.iter().zip(is_named).all(|(table, is_named)| {
        let is_factor = is_named || table.times.is_some();
        let points = options.limits.points;
        points.is_none_or(|most| table.stored() <= most)
            && (!is_factor || f64::from(table.peak()) <= options.factor_limit)
    })
}

/// Whether all factors can keep to their limit.
fn check_factors(outputs: &[Output], axes: &Axes, factors: Factors) -> Result<(), PlanError> {
    let least = outputs.iter().map(|o| o.least_limit(factors.tables));
    let Some((index, least)) = least.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)) else {
        return Ok(());
    };
    match least <= factors.limit {
        true => Ok(()),
        false => Err(PlanError::Factor {
            axis: axes.letter(index),
            limit: factors.limit,
            least: (least * 1e4).ceil() / 1e4,
        }),
    }
}

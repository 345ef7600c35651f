//! Splits a compensation into its tables, as functions, and its terms, as products of functions.

use super::function::{AxisFunction, Origin};
use super::spacing::Spacing;
use super::{CecError, TravelDirection};
use trueaxis::{AuxiliaryKind, Direction, Interpolation, Largest};
use trueaxis_model::errors::temperature_name;
use trueaxis_model::machine::MAX_AXES;

/// A product of functions that is added to an axis.
#[derive(Clone, Debug)]
pub struct SourceTerm {
    /// Index of the axis.
    pub output: usize,
    /// Weight, including the values of functions of auxiliary inputs.
    pub weight: f64,
    /// Whether the weight can be set at run time.
    pub adjustable: bool,
    /// The functions of axes.
    pub factors: Vec<AxisFunction>,
}

/// All terms, for one tool length and with temperatures at their references.
#[derive(Clone, Debug)]
pub struct SourceTerms {
    pub terms: Vec<SourceTerm>,
    /// The tool length (mm), if it is an input.
    pub length: Option<f64>,
    /// Sensors whose temperature is assumed to be the reference.
    pub sensors: Vec<String>,
}

impl SourceTerms {
    /// Splits a compensation for a tool length (mm), by default the reference.
    pub fn new(compensation: &Largest<'_>, length: Option<f64>) -> Result<Self, CecError> {
        let axes = compensation.axes().len();
        if axes > MAX_AXES {
            return Err(CecError::Axes(axes));
        }
        if !compensation.grids().is_empty() {
            return Err(CecError::Grid);
        }
        let auxiliaries = compensation.auxiliaries();
        let mut of = vec![0.0; auxiliaries.len()];
        let mut known = None;
        for (value, auxiliary) in of.iter_mut().zip(auxiliaries) {
            if auxiliary.kind == AuxiliaryKind::ToolLength {
                *value = length.unwrap_or_else(|| auxiliary.reference.into());
                known = Some(*value);
            }
        }
        if length.is_some() && known.is_none() {
            return Err(CecError::NoLength);
        }
        let tables = functions(compensation);
        let is_length = |input: usize| {
            let auxiliary = input.checked_sub(axes).and_then(|k| auxiliaries.get(k));
            auxiliary.is_some_and(|a| a.kind == AuxiliaryKind::ToolLength)
        };
        // Outside, its tables hold their end values.
        for (function, _) in tables
            .iter()
            .filter(|(function, _)| is_length(function.input))
        {
            let [low, high] = function.span();
            let slack = 1e-6 * (high - low);
            let outside = length.filter(|length| !(low - slack..=high + slack).contains(length));
            if let Some(length) = outside {
                let range = [low, high];
                return Err(CecError::Length { length, range });
            }
        }
        let mut terms = Vec::new();
        for term in compensation.terms() {
            let mut products = vec![SourceTerm {
                output: usize::from(term.output),
                weight: term.weight.into(),
                adjustable: term.limits.is_some(),
                factors: Vec::new(),
            }];
            for table in term.factors {
                let (function, direction) = &tables[usize::from(*table)];
                match function.input.checked_sub(axes) {
                    Some(auxiliary) => {
                        let value = function.at(of[auxiliary]);
                        products.iter_mut().for_each(|p| p.weight *= value);
                    }
                    None => products = multiplied(&products, &by_travel(function, *direction)),
                }
            }
            terms.extend(products);
        }
        let sensors = auxiliaries
            .iter()
            .filter(|a| a.kind == AuxiliaryKind::Temperature)
            .map(|a| temperature_name(&a.name, a.sensor.lag_rate))
            .collect();
        Ok(Self {
            terms,
            length: known,
            sensors,
        })
    }
}

/// Each product with each of the functions.
fn multiplied(products: &[SourceTerm], ways: &[AxisFunction]) -> Vec<SourceTerm> {
    let with = |product: &SourceTerm| {
        let product = product.clone();
        ways.iter().map(move |way| {
            let mut product = product.clone();
            product.factors.push(way.clone());
            product
        })
    };
    products.iter().flat_map(with).collect()
}

/// All tables with their direction.
fn functions(compensation: &Largest<'_>) -> Vec<(AxisFunction, Direction)> {
    let mut found = Vec::new();
    for bank in compensation.banks() {
        for _ in 0..bank.tables {
            let table = found.len();
            let samples = (0..bank.points as usize).filter_map(|k| compensation.sample(table, k));
            let function = AxisFunction {
                origin: Origin::Table(table, TravelDirection::Both),
                input: usize::from(bank.input),
                spacing: Spacing::of(bank),
                travel: TravelDirection::Both,
                interpolation: bank.interpolation,
                values: samples.map(f64::from).collect(),
            };
            found.push((function, bank.direction));
        }
    }
    found
}

/// One function for each direction of travel in which it applies.
fn by_travel(function: &AxisFunction, direction: Direction) -> Vec<AxisFunction> {
    let way = |travel: TravelDirection, sign: f64| {
        let mut function = function.clone();
        let Origin::Table(table, _) = function.origin else {
            return function;
        };
        function.origin = Origin::Table(table, travel);
        function.travel = travel;
        function.values.iter_mut().for_each(|v| *v *= sign);
        function
    };
    match direction {
        Direction::Both => vec![function.clone()],
        Direction::Positive => vec![way(TravelDirection::Positive, 1.0)],
        Direction::Negative => vec![way(TravelDirection::Negative, 1.0)],
        Direction::Signed => vec![
            way(TravelDirection::Positive, 1.0),
            way(TravelDirection::Negative, -1.0),
        ],
    }
}

/// True for functions that a controller can interpolate unchanged.
pub fn is_linear(function: &AxisFunction) -> bool {
    function.interpolation == Interpolation::Linear
}

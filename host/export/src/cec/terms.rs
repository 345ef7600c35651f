//! Converts terms to a form that the controller supports: a function of one axis, or a product of two.

use super::CecError;
use super::axes::NamedAxes;
use super::cost::{CecTolerance, Long, LongProducts, Note};
use super::function::{AxisFunction, Origin, sampled};
use super::source::{SourceTerm, is_linear};
use super::{TravelDirection, collect::Normal};
use trueaxis::Interpolation;

/// Largest number of values per table if the controller has no limit: more than any correction needs.
const MOST_POINTS: usize = 5000;
/// Fraction of the tolerance that linear interpolation may use, for each term.
const PART: f64 = 0.25;

/// Parameters of the conversion.
pub struct ConversionForm<'a> {
    pub axes: &'a NamedAxes,
    /// Largest number of values per table.
    pub points: Option<usize>,
    /// Permitted error of each axis.
    pub tolerance: CecTolerance,
    pub long: LongProducts,
}

impl ConversionForm<'_> {
    /// Converts an amount on an axis (mm, deg) to µm or µrad.
    pub fn fine(&self, output: usize, amount: f64) -> f64 {
        match self.axes.is_rotary(output) {
            true => amount.to_radians() * 1e6,
            false => amount * 1e3,
        }
    }

    /// Converts a term; `None` if it is always 0 or is dropped.
    pub fn normal(
        &self,
        term: SourceTerm,
        notes: &mut Vec<Note>,
        long: &mut Vec<Long>,
    ) -> Result<Option<Normal>, CecError> {
        let output = term.output;
        let weight = term.weight;
        let factors = by_input(term.factors);
        let whole: f64 = factors.iter().flatten().map(AxisFunction::peak).product();
        let mut functions = Vec::new();
        for same in factors {
            let own: f64 = same.iter().map(AxisFunction::peak).product();
            let gain = match own > 0.0 {
                true => (weight * whole / own).abs(),
                false => 0.0,
            };
            match self.one(output, same, gain, notes)? {
                Some(function) => functions.push(function),
                None => return Ok(None),
            }
        }
        if functions.len() > 2 {
            let cost = self.lost(output, weight, &functions);
            match self.long {
                LongProducts::Refuse => long.push(cost),
                LongProducts::Drop => notes.push(Note::Dropped(cost)),
            }
            return Ok(None);
        }
        let mut functions = functions.into_iter();
        Ok(Some(match (functions.next(), functions.next()) {
            (Some(one), Some(other)) => Normal::Product(one, other, weight),
            (Some(one), None) => Normal::Plain(one, weight, term.adjustable),
            _ => Normal::Constant(weight),
        }))
    }

    /// A product of functions of more than two axes, with the error without it.
    fn lost(&self, output: usize, weight: f64, functions: &[AxisFunction]) -> Long {
        let whole: f64 = weight.abs() * functions.iter().map(AxisFunction::peak).product::<f64>();
        let inputs = functions.iter().map(|f| self.axes.letter(f.input));
        Long {
            output: self.axes.letter(output),
            inputs: inputs.collect(),
            dropped: self.fine(output, whole),
            unit: Note::unit(self.axes, output),
        }
    }

    /// The product of functions of one axis as a single, piecewise linear function; `None` if it is always 0.
    fn one(
        &self,
        output: usize,
        mut same: Vec<AxisFunction>,
        gain: f64,
        notes: &mut Vec<Note>,
    ) -> Result<Option<AxisFunction>, CecError> {
        let fits = |f: &AxisFunction| {
            let stored = f.spacing.points + usize::from(f.spacing.modulo);
            is_linear(f) && self.points.is_none_or(|most| stored <= most)
        };
        if same.len() == 1 && fits(&same[0]) {
            return Ok(same.pop());
        }
        let Some(travel) = common_travel(&same) else {
            return Ok(None);
        };
        let (span, modulo) = self.span(&same)?;
        let product = |x: f64| same.iter().map(|f| f.at(x)).product::<f64>();
        let most = self.points.unwrap_or(MOST_POINTS).max(3) - 1;
        let enough = match self.axes.is_rotary(output) {
            true => (PART * self.tolerance.urad * 1e-6).to_degrees(),
            false => PART * self.tolerance.um * 1e-3,
        };
        let origins: Vec<Origin> = same.iter().map(|f| f.origin.clone()).collect();
        let finest = same.iter().map(|f| f64::from(f.spacing.step));
        let finest = finest.fold(f64::INFINITY, f64::min);
        let mut intervals = (((span[1] - span[0]) / finest).round() as usize).clamp(2, most);
        loop {
            let (spacing, values) = sampled(&product, span, intervals, modulo);
            let made = AxisFunction {
                origin: match origins.as_slice() {
                    [only] => only.clone(),
                    many => {
                        let mut many = many.to_vec();
                        many.sort();
                        Origin::Product(many)
                    }
                },
                input: same[0].input,
                spacing,
                travel,
                interpolation: Interpolation::Linear,
                values,
            };
            let cost = gain * made.difference(&product, span);
            if cost <= enough || intervals == most {
                notes.push(Note::Resampled {
                    output: self.axes.letter(output),
                    input: self.axes.letter(made.input),
                    points: made.spacing.points + usize::from(modulo),
                    cost: self.fine(output, cost),
                    unit: Note::unit(self.axes, output),
                });
                return Ok(Some(made));
            }
            intervals = (2 * intervals).min(most);
        }
    }

    /// The span over which functions of an axis are multiplied, and whether it repeats.
    fn span(&self, same: &[AxisFunction]) -> Result<([f64; 2], bool), CecError> {
        let [first, rest @ ..] = same else {
            return Ok(([0.0, 1.0], false));
        };
        let input = first.input;
        let travel = self.axes.travel(input);
        let period = |f: &AxisFunction| f.span()[1] - f.span()[0];
        let together = |f: &AxisFunction| {
            f.spacing.modulo && (period(f) - period(first)).abs() < 1e-6 * period(first)
        };
        if rest.is_empty() || (first.spacing.modulo && rest.iter().all(together)) {
            return Ok((first.span(), first.spacing.modulo));
        }
        if self.axes.axes[input].period == 0.0 {
            return Ok((travel, false));
        }
        match same.iter().all(|f| f.spacing.modulo) {
            true => Ok((travel, true)),
            false => Err(CecError::Periods(self.axes.letter(input))),
        }
    }
}

/// Functions of each axis.
fn by_input(functions: Vec<AxisFunction>) -> Vec<Vec<AxisFunction>> {
    let mut all: Vec<Vec<AxisFunction>> = Vec::new();
    for function in functions {
        match all.iter_mut().find(|same| same[0].input == function.input) {
            Some(same) => same.push(function),
            None => all.push(vec![function]),
        }
    }
    all
}

/// The directions of travel in which a product of functions applies; `None` if there is none.
fn common_travel(functions: &[AxisFunction]) -> Option<TravelDirection> {
    let mut travels = functions.iter().map(|function| function.travel);
    travels.try_fold(TravelDirection::Both, |one, other| match (one, other) {
        (TravelDirection::Both, one) | (one, TravelDirection::Both) => Some(one),
        (one, other) => (one == other).then_some(one),
    })
}

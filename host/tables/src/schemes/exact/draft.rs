//! From sampled tables to a draft of the compensation.

use super::Options;
use super::grid::Grid;
use super::spline;
use super::structure::{self, Decomposition, Function};
use super::variables::Kind;
use crate::schemes::blank::blank;
use nalgebra::DVectorView;
use std::collections::{BTreeMap, HashMap};
use trueaxis::{Direction, Draft, DraftBank, Interpolation, SampleFormat, Term};
use trueaxis_model::kinematics::NotConverged;
use trueaxis_model::machine::Machine;

/// Samples are accurate to this fraction of the largest. Smaller ones are set to 0, to be identical on every system.
const SAMPLED: f64 = 1e-10;

/// Lays out banks and terms.
pub fn draft(
    found: &Decomposition<'_>,
    grids: &BTreeMap<usize, Grid>,
    options: &Options,
) -> Result<Draft, NotConverged> {
    let kinematics = &found.sampler.kinematics;
    let (terms, scales) = weighed(kinematics.machine, found);
    let mut layout = BankLayout {
        found,
        scales,
        banks: Vec::new(),
        numbers: HashMap::new(),
    };
    for (v, (bent, straight)) in found.tables() {
        let variable = &found.sampler.variables[v];
        if let Kind::Sign(i) = variable.kind {
            layout.add_sign(v, kinematics.machine.axes[i].travel);
            continue;
        }
        let ends = Grid::over(variable.range, 1);
        layout.add(v, &straight, (ends, SampleFormat::F32))?;
        let grid = grids.get(&v).copied().unwrap_or(ends);
        layout.add(v, &bent, (grid, options.format))?;
    }
    Ok(Draft {
        terms: numbered(&terms, &layout.numbers),
        banks: layout.banks,
        ..blank(kinematics)
    })
}

/// Banks, filled one after the other.
struct BankLayout<'a> {
    found: &'a Decomposition<'a>,
    /// Factors of tables; 1 for the others.
    scales: HashMap<Factor, f64>,
    banks: Vec<DraftBank>,
    /// The number of each table in the blob.
    numbers: HashMap<Factor, u8>,
}

impl BankLayout<'_> {
    fn scale(&self, factor: &Factor) -> f64 {
        self.scales.get(factor).copied().unwrap_or(1.0)
    }

    fn push(&mut self, v: usize, functions: &[Function], bank: DraftBank) {
        self.banks.push(bank);
        for function in functions {
            let next = self.numbers.len() as u8;
            self.numbers.insert((v, *function), next);
        }
    }

    /// Adds the sign of the direction of travel of an axis.
    fn add_sign(&mut self, v: usize, [start, end]: [f64; 2]) {
        let (input, _) = input(self.found, v);
        let bank = DraftBank {
            input,
            start: start as f32,
            step: (end - start) as f32,
            modulo: false,
            direction: Direction::Signed,
            interpolation: Interpolation::Linear,
            format: SampleFormat::F32,
            columns: vec![vec![self.scale(&(v, Function::Sign)) as f32; 2]],
        };
        self.push(v, &[Function::Sign], bank);
    }

    /// Adds tables of a variable, sampled on a grid.
    fn add(
        &mut self,
        v: usize,
        functions: &[Function],
        (grid, format): (Grid, SampleFormat),
    ) -> Result<(), NotConverged> {
        if functions.is_empty() {
            return Ok(());
        }
        let variable = &self.found.sampler.variables[v];
        let (input, unit) = input(self.found, v);
        // The runtime holds start and step as f32; sample at the points that it computes.
        let start = (grid.start * unit) as f32;
        let step = (grid.step * unit) as f32;
        let known = Grid {
            start: f64::from(start) / unit,
            step: f64::from(step) / unit,
            ..grid
        };
        let at: Vec<f64> = known.sampled_at(variable.wraps).collect();
        let within = Within::new(&at, variable.range, grid.step);
        let mut values = self.found.sample(v, functions, &within.at)?.values;
        for mut column in values.column_iter_mut() {
            within.extend(column.as_mut_slice());
        }
        if grid.cubic {
            values = spline::coefficients(&values, variable.wraps);
        }
        let column = |(function, column): (&Function, DVectorView<'_, f64>)| {
            let scale = self.scale(&(v, *function));
            let least = SAMPLED * column.amax();
            let sample = |x: &f64| match x.abs() < least {
                true => 0.0,
                false => (scale * x) as f32,
            };
            column.iter().map(sample).collect()
        };
        let bank = DraftBank {
            input,
            start,
            step,
            modulo: variable.wraps,
            direction: Direction::Both,
            interpolation: match grid.cubic {
                true => Interpolation::Cubic,
                false => Interpolation::Linear,
            },
            format,
            columns: (functions.iter().zip(values.column_iter()).map(column)).collect(),
        };
        self.push(v, functions, bank);
        Ok(())
    }
}

/// The number of the input of a variable, and the factor from mm or rad to its unit.
fn input(found: &Decomposition<'_>, v: usize) -> (u8, f64) {
    let sampler = found.sampler;
    structure::input(sampler.kinematics.machine, &sampler.variables, v)
}

/// Points of which the first and the last may be outside the range, where nothing can be sampled.
struct Within {
    /// The points, with those outside moved to the end of the range.
    at: Vec<f64>,
    /// Distance of such a point beyond the end, divided by the distance from the end to its neighbour.
    beyond: [f64; 2],
}

impl Within {
    fn new(points: &[f64], [low, high]: [f64; 2], step: f64) -> Self {
        let mut at = points.to_vec();
        let last = at.len() - 1;
        let mut beyond = [1.0; 2];
        // A point in f32 may be off by its rounding.
        let slack = 1e-3 * step;
        if last > 0 && points[0] < low - slack {
            at[0] = low;
            beyond[0] = (points[1] - points[0]) / (points[1] - low);
        }
        if last > 0 && points[last] > high + slack {
            at[last] = high;
            beyond[1] = (points[last] - points[last - 1]) / (high - points[last - 1]);
        }
        Self { at, beyond }
    }

    /// Extrapolates values linearly from the ends of the range to the points beyond.
    fn extend(&self, values: &mut [f64]) {
        let last = values.len() - 1;
        if last > 0 {
            values[0] = values[1] + (values[0] - values[1]) * self.beyond[0];
            values[last] = values[last - 1] + (values[last] - values[last - 1]) * self.beyond[1];
        }
    }
}

/// Permitted scale factors of a table that is used in `uses` terms. Without limits, along a chain of terms that
/// share tables, one table would become as large as the next becomes small.
fn scales_of(uses: usize) -> std::ops::RangeInclusive<f64> {
    if uses == 1 { 1e-12..=1e6 } else { 1e-3..=1e2 }
}

/// A factor: a table of a variable.
type Factor = (usize, Function);

/// The terms with weights in mm or degrees, and the scale factor of each table, chosen so that as many weights as
/// possible are 1, which cost nothing.
fn weighed(
    machine: &Machine,
    found: &Decomposition<'_>,
) -> (Vec<structure::Term>, HashMap<Factor, f64>) {
    let mut terms = found.structure.terms.clone();
    let mut uses: HashMap<Factor, usize> = HashMap::new();
    for term in &mut terms {
        let axis = &machine.axes[term.output];
        term.weight = axis.to_command(term.weight * found.tolerance[term.output]);
        for factor in &term.factors {
            *uses.entry(*factor).or_insert(0) += 1;
        }
    }
    // A table that is used in only one term can take any weight, so those terms can wait.
    let least_used = |i: &usize| terms[*i].factors.iter().map(|f| uses[f]).min();
    let mut order: Vec<usize> = (0..terms.len()).collect();
    order.sort_by_key(|i| (least_used(i) == Some(1), terms[*i].factors.len()));
    let mut scales: HashMap<Factor, f64> = HashMap::new();
    for i in order {
        let term = &mut terms[i];
        for factor in &term.factors {
            term.weight /= scales.get(factor).copied().unwrap_or(1.0);
        }
        let once = |f: &&Factor| term.factors.iter().filter(|g| g == f).count() == 1;
        let free = term.factors.iter().filter(|f| !scales.contains_key(f));
        if let Some(factor) = free.filter(once).min_by_key(|f| uses[f])
            && scales_of(uses[factor]).contains(&term.weight.abs())
        {
            scales.insert(*factor, term.weight);
            term.weight = 1.0;
        }
        // The tables that this term relies on are fixed from now on.
        for factor in &term.factors {
            scales.entry(*factor).or_insert(1.0);
        }
    }
    (terms, scales)
}

/// The terms as stored in the blob, sorted so that terms with the same output and length are adjacent.
fn numbered(terms: &[structure::Term], numbers: &HashMap<Factor, u8>) -> Vec<Term> {
    let mut terms: Vec<Term> = terms
        .iter()
        .map(|term| {
            let mut factors: Vec<u8> = term.factors.iter().map(|f| numbers[f]).collect();
            factors.sort_unstable();
            Term {
                output: term.output as u8,
                weight: term.weight as f32,
                limits: None,
                factors: factors.into_iter().collect(),
            }
        })
        .collect();
    terms.sort_by(|a, b| {
        (a.output, a.factors.len(), &a.factors[..]).cmp(&(
            b.output,
            b.factors.len(),
            &b.factors[..],
        ))
    });
    terms
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_beyond_the_range_continues_the_line_through_its_end() {
        let points = [-12.0, -5.0, 2.0, 9.0, 16.0];
        let within = Within::new(&points, [-10.0, 15.0], 7.0);
        assert_eq!(within.at, [-10.0, -5.0, 2.0, 9.0, 15.0]);
        let mut values: Vec<f64> = within.at.iter().map(|x| 3.0 * x + 1.0).collect();
        within.extend(&mut values);
        for (value, x) in values.iter().zip(points) {
            assert!((value - (3.0 * x + 1.0)).abs() < 1e-12);
        }
    }
}

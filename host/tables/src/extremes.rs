//! The largest correction, and the largest slope, that any input at all can give: interval arithmetic over samples,
//! weights and products.

use crate::contents::input;
use serde::Serialize;
use trueaxis::{Bank, Grid, Interpolation, Largest, TermView};

/// Rounding of f32 in sums of a few hundred products, as a part of their largest value.
pub(crate) const ROUNDING: f64 = 1e-5;

/// Of the correction of one axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Extremes {
    /// Largest magnitude (mm, deg).
    pub largest: f64,
    /// Largest change per unit of each input on which it depends.
    pub steepest: Vec<Slope>,
}

/// How fast a correction can change with an input. Steps where an axis reverses do not count.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Slope {
    /// Name of the input.
    pub input: String,
    /// Largest magnitude of the derivative: mm or deg of the correction per mm, deg or K of the input.
    pub per_unit: f64,
}

/// Largest magnitude and slope of a table, and its input.
#[derive(Clone, Copy)]
pub(crate) struct Table {
    pub input: usize,
    pub largest: f64,
    pub steepest: f64,
    /// Largest difference of slopes on both sides of a point.
    bend: f64,
    step: f64,
    is_cubic: bool,
    /// Whether an end lies inside the travel.
    ends: bool,
}

impl Table {
    /// The largest change of its slope on a way.
    pub(crate) fn change_of_slope(&self, way: f64) -> f64 {
        let intervals = way / self.step;
        // Between points a line has no bend; the bend of a cubic B-spline is an average of those at its points, per step.
        let change = match self.is_cubic {
            true => self.bend * intervals + if self.ends { self.steepest } else { 0.0 },
            false => self.bend * (intervals.floor() + 1.0),
        };
        change.min(2.0 * self.steepest)
    }
}

/// Of each axis.
#[must_use]
pub fn extremes(compensation: &Largest<'_>) -> Vec<Extremes> {
    let axes = compensation.axes().len();
    let inputs = axes + compensation.auxiliaries().len();
    let tables = tables(compensation);
    let mut largest = vec![0.0; axes];
    let mut steepest = vec![vec![0.0; inputs]; axes];
    for term in compensation.terms() {
        let output = usize::from(term.output);
        add_term(&term, &tables, &mut largest[output], &mut steepest[output]);
    }
    for (number, grid) in compensation.grids().iter().enumerate() {
        add_grid(compensation, number, grid, &mut largest, &mut steepest);
    }
    let of = |(largest, steepest): (f64, Vec<f64>)| Extremes {
        largest: largest * (1.0 + ROUNDING),
        steepest: (0_u8..)
            .zip(steepest)
            .filter(|(_, slope)| *slope > 0.0)
            .map(|(number, slope)| Slope {
                input: input(compensation, number),
                per_unit: slope * (1.0 + ROUNDING),
            })
            .collect(),
    };
    largest.into_iter().zip(steepest).map(of).collect()
}

pub(crate) fn tables(compensation: &Largest<'_>) -> Vec<Table> {
    let mut tables = Vec::new();
    for bank in compensation.banks() {
        let step = f64::from(bank.step);
        let input = bank.input.into();
        let ends = ends_inside(
            compensation,
            input,
            bank.start,
            step,
            bank.points,
            bank.modulo,
        );
        for _ in 0..bank.tables {
            let of = |point| {
                compensation
                    .sample(tables.len(), point)
                    .map_or(0.0, f64::from)
            };
            let samples: Vec<f64> = (0..bank.points as usize).map(of).collect();
            tables.push(Table {
                input,
                largest: samples.iter().fold(0.0, |most, v| v.abs().max(most)),
                steepest: steepest(bank, &samples),
                bend: bend(bank, &samples, ends),
                step: bank.step.into(),
                is_cubic: bank.interpolation == Interpolation::Cubic,
                ends,
            });
        }
    }
    tables
}

/// The largest difference of neighbouring samples, per unit of the input. The derivative of a cubic B-spline is an
/// average of these differences.
fn steepest(bank: &Bank, samples: &[f64]) -> f64 {
    let next = samples.iter().cycle().skip(1);
    let count = samples.len() - usize::from(!bank.modulo);
    let differences = samples.iter().zip(next).take(count);
    let most = differences.fold(0.0, |most, (a, b)| (b - a).abs().max(most));
    most / f64::from(bank.step)
}

/// The largest difference of neighbouring slopes; also to the slope 0 beyond the ends if these are inside the travel.
fn bend(bank: &Bank, samples: &[f64], ends: bool) -> f64 {
    let count = samples.len() as isize;
    let at = |k: isize| match bank.modulo {
        true => samples[k.rem_euclid(count) as usize],
        false => samples[k.clamp(0, count - 1) as usize],
    };
    let inner = match bank.modulo || ends {
        true => 0..count,
        false => 1..count - 1,
    };
    let bends = inner.map(|k| (at(k + 1) - 2.0 * at(k) + at(k - 1)).abs());
    bends.fold(0.0, f64::max) / f64::from(bank.step)
}

/// The largest magnitude of a weight.
pub(crate) fn weight(term: &TermView<'_>) -> f64 {
    let weights = [term.weight]
        .into_iter()
        .chain(term.limits.into_iter().flatten());
    weights.fold(0.0, |most: f64, w| f64::from(w.abs()).max(most))
}

fn add_term(term: &TermView<'_>, tables: &[Table], largest: &mut f64, steepest: &mut [f64]) {
    let weight = weight(term);
    let factors: Vec<Table> = term
        .factors
        .iter()
        .map(|k| tables[usize::from(*k)])
        .collect();
    let product = |of: &dyn Fn(usize) -> f64| (0..factors.len()).map(of).product::<f64>();
    *largest += weight * product(&|k| factors[k].largest);
    for (number, factor) in factors.iter().enumerate() {
        let slope = product(&|k| match k == number {
            true => factor.steepest,
            false => factors[k].largest,
        });
        steepest[factor.input] += weight * slope;
    }
}

fn add_grid(
    compensation: &Largest<'_>,
    number: usize,
    grid: &Grid,
    largest: &mut [f64],
    steepest: &mut [Vec<f64>],
) {
    let nodes = grid.nodes() as usize;
    for (column, output) in grid.outputs.iter().enumerate() {
        let output = usize::from(*output);
        let at = |node| {
            compensation
                .grid_sample(number, node, column)
                .map_or(0.0, f64::from)
        };
        largest[output] += (0..nodes).fold(0.0, |most, node| at(node).abs().max(most));
        for (k, axis) in grid.axes.iter().enumerate() {
            let points = axis.points as usize;
            let stride: usize = grid.axes[k + 1..]
                .iter()
                .map(|a| a.points as usize)
                .product();
            let change = |node: usize| match node / stride % points + 1 < points {
                true => at(node + stride) - at(node),
                false if axis.modulo => at(node - (points - 1) * stride) - at(node),
                false => 0.0,
            };
            let most = (0..nodes).fold(0.0, |most, node| change(node).abs().max(most));
            steepest[output][usize::from(axis.input)] += most / f64::from(axis.step);
        }
    }
}

/// True if an end lies inside the travel of its axis: there the slope becomes 0.
pub(crate) fn ends_inside(
    compensation: &Largest<'_>,
    input: usize,
    start: f32,
    step: f64,
    points: u32,
    modulo: bool,
) -> bool {
    let Some(axis) = compensation.axes().get(input) else {
        return false;
    };
    let start = f64::from(start);
    let end = start + step * f64::from(points - 1);
    // Travels and steps are rounded to f32.
    let [low, high] = axis.travel.map(f64::from);
    let near = 1e-6 * (high - low).min(1e6);
    !modulo && (start > low + near || end < high - near)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;
    use trueaxis::{Inputs, Travel, Travelling};
    use trueaxis_model::validate::Runtime;

    const HURON: &[u8] = include_bytes!("../../../tests/golden/v1/huron-13.trax");
    const EVERYTHING: &[u8] = include_bytes!("../../../tests/golden/v1/everything.trax");

    #[test]
    fn no_input_gives_a_larger_correction_or_slope() {
        for blob in [HURON, EVERYTHING] {
            let blob = trueaxis::AlignedBlob::from_bytes(blob);
            let runtime = Runtime::load(&blob).unwrap();
            let c = runtime.compensation();
            let extremes = extremes(c);
            let inputs = c.axes().len() + c.auxiliaries().len();
            let mut random = Pcg64Mcg::seed_from_u64(1);
            let mut reached = vec![0.0_f64; c.axes().len()];
            for _ in 0..20_000 {
                let travel = [Travel::Unknown, Travel::Positive, Travel::Negative]
                    [random.random_range(0..3)];
                let travel = Travelling([travel; 16]);
                let mut weights = c.weights();
                for (term, view) in c.terms().enumerate() {
                    if let Some([low, high]) = view.limits {
                        weights.set(term, random.random_range(low..=high)).unwrap();
                    }
                }
                let mut at = Inputs::at([0.0; 16]);
                for q in &mut at.axes {
                    *q = random.random_range(-500.0..500.0);
                }
                at.auxiliaries = std::array::from_fn(|_| random.random_range(-50.0..300.0));
                let before = c.evaluate(&at, &travel, &weights);
                let moved = random.random_range(0..inputs);
                let by = 0.5_f32;
                match moved.checked_sub(c.axes().len()) {
                    None => at.axes[moved] += by,
                    Some(auxiliary) => at.auxiliaries[auxiliary] += by,
                }
                let after = c.evaluate(&at, &travel, &weights);
                let name = input(c, moved as u8);
                for (axis, of) in extremes.iter().enumerate() {
                    let (a, b) = (f64::from(before[axis]), f64::from(after[axis]));
                    assert!(a.abs() <= of.largest, "{axis}: {a} {of:?}");
                    reached[axis] = reached[axis].max(a.abs() / of.largest);
                    let slope = of.steepest.iter().find(|s| s.input == name);
                    let slope = slope.map_or(0.0, |s| s.per_unit);
                    // Rounding of both values and of the position.
                    let rounding = 1e-6 * of.largest + 1e-4 * slope;
                    let most = slope * f64::from(by) + rounding;
                    assert!((b - a).abs() <= most, "d{axis} by {name}: {a} {b} {of:?}");
                }
            }
            // Not by far either: a bound that nothing comes near says little.
            assert!(reached.iter().all(|part| *part > 0.3), "{reached:?}");
        }
    }
}

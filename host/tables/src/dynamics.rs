//! How fast a correction can move, and how fast its speed can change, while all axes run at their top speeds: interval
//! arithmetic over the blob, for any position.

use crate::extremes::{ROUNDING, Table, ends_inside, tables, weight};
use trueaxis::{Grid, Largest, TermView};
use trueaxis_kinematics::Axis;

/// Of the correction of one axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Dynamics {
    /// Largest speed (mm/s, deg/s).
    pub speed: f64,
    /// Largest change of speed from one servo period to the next, over the period (mm/s², deg/s²).
    pub acceleration: f64,
    /// For each axis its part in both.
    pub parts: Vec<[f64; 2]>,
}

/// Of each axis, with the servo period in s. The axes move at constant speed: their own acceleration adds the slope of
/// the correction times that. Steps where an axis reverses do not count; the rate bound of the correction limits them.
#[must_use]
pub fn dynamics(compensation: &Largest<'_>, axes: &[Axis], period: f64) -> Vec<Dynamics> {
    // Auxiliaries stand still: their changes are faded in.
    let ways = |input: usize| axes.get(input).map_or(0.0, |axis| axis.max_speed * period);
    let tables = tables(compensation);
    let mut found = vec![vec![[0.0; 2]; axes.len()]; axes.len()];
    for term in compensation.terms() {
        let parts = &mut found[usize::from(term.output)];
        for (input, slope, change) in of_term(&term, &tables, &ways) {
            add(parts, input, slope, change);
        }
    }
    for (number, grid) in compensation.grids().iter().enumerate() {
        for (column, output) in grid.outputs.iter().enumerate() {
            let at = |node| {
                let sample = compensation.grid_sample(number, node, column);
                sample.map_or(0.0, f64::from)
            };
            for (input, slope, change) in of_grid(compensation, grid, &at, &ways) {
                add(&mut found[usize::from(*output)], input, slope, change);
            }
        }
    }
    let of = |mut parts: Vec<[f64; 2]>| {
        for (part, axis) in parts.iter_mut().zip(axes) {
            let speed = axis.max_speed * (1.0 + ROUNDING);
            *part = [part[0] * speed, part[1] * speed / period];
        }
        let sum = |k: usize| parts.iter().map(|part| part[k]).sum();
        Dynamics {
            speed: sum(0),
            acceleration: sum(1),
            parts,
        }
    };
    found.into_iter().map(of).collect()
}

/// Adds a slope and its change to the part of an axis.
fn add(parts: &mut [[f64; 2]], input: usize, slope: f64, change: f64) {
    if let Some(part) = parts.get_mut(input) {
        part[0] += slope;
        part[1] += change;
    }
}

/// For each factor its input, the largest slope of the term with it, and the largest change of that slope in a period.
fn of_term(
    term: &TermView<'_>,
    tables: &[Table],
    ways: &dyn Fn(usize) -> f64,
) -> Vec<(usize, f64, f64)> {
    let weight = weight(term);
    let factors: Vec<&Table> = term
        .factors
        .iter()
        .map(|k| &tables[usize::from(*k)])
        .collect();
    // The product of all factors but some.
    let without = |some: &[usize]| {
        let others = (0..factors.len()).filter(|k| !some.contains(k));
        others.map(|k| factors[k].largest).product::<f64>()
    };
    let one = |(a, factor): (usize, &&Table)| {
        let slope = weight * factor.steepest * without(&[a]);
        let bend = factor.change_of_slope(ways(factor.input)) * without(&[a]);
        let others = factors.iter().enumerate().filter(|(b, _)| *b != a);
        let turns = others.map(|(b, other)| {
            factor.steepest * other.steepest * ways(other.input) * without(&[a, b])
        });
        (factor.input, slope, weight * (bend + turns.sum::<f64>()))
    };
    factors.iter().enumerate().map(one).collect()
}

/// Like `of_term`, for one output of a grid.
fn of_grid(
    compensation: &Largest<'_>,
    grid: &Grid,
    at: &dyn Fn(usize) -> f64,
    ways: &dyn Fn(usize) -> f64,
) -> Vec<(usize, f64, f64)> {
    let nodes = grid.nodes() as usize;
    let strides: Vec<usize> = (0..grid.axes.len())
        .map(|k| {
            grid.axes[k + 1..]
                .iter()
                .map(|a| a.points as usize)
                .product()
        })
        .collect();
    // The next node along an axis; the last of one that does not turn endlessly has none.
    let next = |node: usize, k: usize| {
        let (points, stride) = (grid.axes[k].points as usize, strides[k]);
        match node / stride % points + 1 < points {
            true => Some(node + stride),
            false if grid.axes[k].modulo => Some(node - (points - 1) * stride),
            false => None,
        }
    };
    let difference = |node: usize, k: usize| next(node, k).map(|next| at(next) - at(node));
    let most = |of: &dyn Fn(usize) -> f64| (0..nodes).map(of).fold(0.0, f64::max);
    let one = |(j, axis): (usize, &trueaxis::GridAxis)| {
        let step = f64::from(axis.step);
        let input = usize::from(axis.input);
        let slope = most(&|node| difference(node, j).unwrap_or(0.0).abs()) / step;
        let ends = ends_inside(
            compensation,
            input,
            axis.start,
            step,
            axis.points,
            axis.modulo,
        );
        let bend = most(&|node| {
            let here = difference(node, j);
            let there = next(node, j).and_then(|next| difference(next, j));
            let is_first = (node / strides[j]).is_multiple_of(axis.points as usize);
            let first = if ends && is_first { here } else { None };
            match (here, there) {
                (Some(here), Some(there)) => (there - here).abs().max(first.unwrap_or(0.0).abs()),
                (Some(last), None) if ends => last.abs(),
                _ => 0.0,
            }
        });
        let knots = (ways(input) / step).floor() + 1.0;
        let mut change = (bend / step * knots).min(2.0 * slope);
        for (k, other) in grid.axes.iter().enumerate().filter(|(k, _)| *k != j) {
            let mixed = most(&|node| {
                let there = next(node, k).and_then(|next| difference(next, j));
                match (difference(node, j), there) {
                    (Some(here), Some(there)) => (there - here).abs(),
                    _ => 0.0,
                }
            });
            let way = ways(usize::from(other.input));
            change += mixed / (step * f64::from(other.step)) * way;
        }
        (input, slope, change)
    };
    grid.axes.iter().enumerate().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;
    use trueaxis::{AlignedBlob, Inputs, Travel, Travelling};
    use trueaxis_kinematics::{Branch, Letter};
    use trueaxis_model::validate::Runtime;

    const HURON: &[u8] = include_bytes!("../../../tests/golden/v1/huron-13.trax");
    const EVERYTHING: &[u8] = include_bytes!("../../../tests/golden/v1/everything.trax");

    /// Three positions a period apart, somewhere in the travel and in any direction: differences of the corrections.
    #[test]
    fn no_move_at_top_speed_is_faster_or_changes_its_speed_faster() {
        for (bytes, period) in [HURON, EVERYTHING]
            .into_iter()
            .flat_map(|b| [(b, 1e-3), (b, 1e-2)])
        {
            let blob = AlignedBlob::from_bytes(bytes);
            let runtime = Runtime::load(&blob).unwrap();
            let c = runtime.compensation();
            let axes: Vec<Axis> = c
                .axes()
                .iter()
                .map(|axis| {
                    let letter = Letter::new(char::from(axis.name)).unwrap();
                    Axis::new(letter, Branch::Tool, axis.travel.map(f64::from))
                })
                .collect();
            let dynamics = dynamics(c, &axes, period);
            let mut random = Pcg64Mcg::seed_from_u64(2);
            let mut reached = vec![[0.0_f64; 2]; axes.len()];
            for _ in 0..100_000 {
                let travel = Travelling([Travel::Positive; 16]);
                let mut at = [Inputs::at([0.0_f32; 16]); 3];
                let auxiliaries = std::array::from_fn(|_| random.random_range(-1.0..1.0));
                for (k, axis) in axes.iter().enumerate() {
                    let way = axis.max_speed * period * random.random_range(-1.0..=1.0);
                    let [low, high] = axis.travel;
                    let middle = random.random_range(low + way.abs()..high - way.abs());
                    for (n, inputs) in (-1..).zip(&mut at) {
                        inputs.axes[k] = (middle + f64::from(n) * way) as f32;
                        inputs.auxiliaries = auxiliaries;
                    }
                }
                let dq = at.map(|at| c.evaluate(&at, &travel, &c.weights()));
                for (axis, of) in dynamics.iter().enumerate() {
                    let [a, b, c] = dq.map(|dq| f64::from(dq[axis]));
                    // Rounding of corrections below 1 mm, of positions below 400 and slopes below 1e-3.
                    let rounding = 4e-7;
                    assert!(
                        (b - a).abs() <= of.speed * period + rounding,
                        "{axis}: {of:?}"
                    );
                    let bent = (c - 2.0 * b + a).abs();
                    let most = of.acceleration * period * period + 4.0 * rounding;
                    assert!(bent <= most, "{axis}: {bent} {most} {of:?}");
                    reached[axis][0] = reached[axis][0].max((b - a).abs() / period / of.speed);
                    let acceleration = bent / period / period / of.acceleration;
                    reached[axis][1] = reached[axis][1].max(acceleration);
                }
            }
            // A bound that nothing comes near says little. Random moves rarely meet the worst position of all axes.
            if bytes == HURON {
                let near = |[speed, bend]: &[f64; 2]| *speed > 0.15 && *bend > 0.03;
                assert!(reached.iter().all(near), "{reached:?}");
            }
        }
    }
}

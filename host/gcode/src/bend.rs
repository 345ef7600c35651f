//! How far corrections can be from the straight line between those of two places, without looking between them.
//!
//! Along a straight move q(t) = q₀ + t·d, t from 0 to 1, let v be how much the derivative of a correction varies,
//! greatest minus least. Then the correction is at most v / 4 from the chord of its ends. A table f that is read in
//! intervals of h has, per mm or degree, at most the slope s, and at a point its slope changes by at most k; a move
//! by d passes at most |d|/h + 1 of them. So for a product of tables f₁ f₂ … with largest values p:
//!
//!   v ≤ Σᵢ kᵢ (|dᵢ|/hᵢ + 1) |dᵢ| Π p + Σᵢ sᵢ |dᵢ| Σⱼ sⱼ |dⱼ| Π p,  j ≠ i, each product over the other tables.
//!
//! Cubic tables (uniform B-splines of coefficients a) have slopes of at most max|Δa|/h, which over h change by at most
//! max|Δ²a|/h. Grids are products in each cell. Beyond its ends a table holds its end value: that is a change of slope
//! too.

use super::axes::{COUNT, PerLetter, is_rotary};
use trueaxis::{Bank, Grid, Interpolation, Largest};

/// Sums over terms and grids of how slopes change, for one output or for several together.
#[derive(Clone, Copy, Debug, Default)]
struct Change {
    /// At a point, per letter: kᵢ Π p.
    point: PerLetter,
    /// Like `point`, over the distance of points: kᵢ Π p / hᵢ.
    spread: PerLetter,
    /// In between, by another axis: sᵢ sⱼ Π p.
    other: [PerLetter; COUNT],
}

/// Bounds of a compensation.
#[derive(Clone, Debug, Default)]
pub struct Bend {
    /// Of linear axes together (mm), and of rotary axes together (degrees).
    together: [Change; 2],
}

/// What is said of a table.
struct Shape {
    /// The letter of its input; `None`: an auxiliary, which stands still along a move.
    letter: Option<usize>,
    step: f64,
    slope: f64,
    kink: f64,
    peak: f64,
}

impl Change {
    fn add_table(&mut self, letter: usize, kink: f64, step: f64) {
        self.point[letter] += kink;
        self.spread[letter] += kink / step;
    }

    /// v of a move by so much (absolute).
    fn of(&self, by: &PerLetter) -> f64 {
        let mut v = 0.0;
        for (i, d) in by.iter().enumerate() {
            if *d == 0.0 {
                continue;
            }
            let others: f64 = self.other[i].iter().zip(by).map(|(m, d)| m * d).sum();
            v += d * (self.point[i] + self.spread[i] * d + others);
        }
        v
    }

    /// The length of a vector whose components are bounded by these.
    fn together(outputs: impl Iterator<Item = Self> + Clone) -> Self {
        let norm = |of: &dyn Fn(&Self) -> f64| {
            let squares = outputs.clone().map(|c| of(&c).powi(2));
            squares.sum::<f64>().sqrt()
        };
        Self {
            point: std::array::from_fn(|i| norm(&|c| c.point[i])),
            spread: std::array::from_fn(|i| norm(&|c| c.spread[i])),
            other: std::array::from_fn(|i| std::array::from_fn(|j| norm(&|c| c.other[i][j]))),
        }
    }
}

impl Bend {
    /// Of a compensation whose axes have these letters.
    #[must_use]
    pub fn new(compensation: &Largest<'_>, letters: &[usize]) -> Self {
        let letter = |input: u8| letters.get(usize::from(input)).copied();
        let mut shapes = Vec::new();
        // Tables, points and nodes are counted as the compensation itself says: all of them are there.
        for bank in compensation.banks() {
            for _ in 0..bank.tables {
                let table = shapes.len();
                let sample =
                    |point| f64::from(compensation.sample(table, point).unwrap_or_default());
                let peak = f64::from(compensation.peak(table).unwrap_or_default());
                shapes.push(Shape::new(bank, letter(bank.input), peak, sample));
            }
        }
        let mut outputs = [Change::default(); COUNT];
        for term in compensation.terms() {
            let factors: Vec<&Shape> = term
                .factors
                .iter()
                .map(|f| &shapes[usize::from(*f)])
                .collect();
            let limits = term.limits.unwrap_or([term.weight; 2]);
            let weight = f64::from(limits[0].abs().max(limits[1].abs()));
            if let Some(output) = letter(term.output) {
                outputs[output].add_product(weight, &factors);
            }
        }
        for (number, grid) in compensation.grids().iter().enumerate() {
            for (place, output) in grid.outputs.iter().enumerate() {
                let sample = |node| {
                    f64::from(
                        compensation
                            .grid_sample(number, node, place)
                            .unwrap_or_default(),
                    )
                };
                if let Some(output) = letter(*output) {
                    outputs[output].add_grid(grid, &letter, sample);
                }
            }
        }
        let of = |rotary: bool| {
            let chosen = outputs.iter().enumerate();
            Change::together(
                chosen
                    .filter(move |(i, _)| is_rotary(*i) == rotary)
                    .map(|(_, c)| *c),
            )
        };
        Self {
            together: [of(false), of(true)],
        }
    }

    /// How far corrections of linear axes (mm) and of rotary axes (degrees) are from the straight line between those of
    /// the ends, at most, of a straight move by so much on which no axis turns round.
    #[must_use]
    pub(crate) fn at_most(&self, by: &PerLetter) -> [f64; 2] {
        let by = by.map(f64::abs);
        self.together.each_ref().map(|change| 0.25 * change.of(&by))
    }
}

impl Shape {
    fn new(bank: &Bank, letter: Option<usize>, peak: f64, sample: impl Fn(usize) -> f64) -> Self {
        let (points, step) = (bank.points as usize, f64::from(bank.step));
        let intervals = if bank.modulo { points } else { points - 1 };
        let slope = |k: usize| (sample((k + 1) % points) - sample(k % points)) / step;
        let mut shape = Self {
            letter,
            step,
            slope: 0.0,
            kink: 0.0,
            peak,
        };
        if letter.is_none() {
            return shape;
        }
        // Beyond the ends there is no slope; a cubic has that of two intervals there.
        let ends = match bank.interpolation {
            Interpolation::Linear => 1,
            Interpolation::Cubic => 2,
        };
        for k in 0..intervals {
            let here = slope(k);
            shape.slope = shape.slope.max(here.abs());
            let is_end = !bank.modulo && (k < ends || k + ends >= intervals);
            if is_end {
                shape.kink = shape.kink.max(here.abs());
            }
            if bank.modulo || k + 1 < intervals {
                shape.kink = shape.kink.max((slope(k + 1) - here).abs());
            }
        }
        shape
    }
}

impl Change {
    fn add_product(&mut self, weight: f64, factors: &[&Shape]) {
        let without = |i: usize, j: usize| -> f64 {
            let rest = factors.iter().enumerate();
            let rest = rest.filter(|(k, _)| *k != i && *k != j);
            weight.abs() * rest.map(|(_, shape)| shape.peak).product::<f64>()
        };
        for (i, a) in factors.iter().enumerate() {
            let Some(first) = a.letter else { continue };
            self.add_table(first, a.kink * without(i, i), a.step);
            for (j, b) in factors.iter().enumerate() {
                if let (Some(second), true) = (b.letter, i != j) {
                    self.other[first][second] += a.slope * b.slope * without(i, j);
                }
            }
        }
    }

    fn add_grid(
        &mut self,
        grid: &Grid,
        letter: &impl Fn(u8) -> Option<usize>,
        sample: impl Fn(usize) -> f64,
    ) {
        let count = grid.axes.len();
        let mut strides = vec![1; count];
        for axis in (1..count).rev() {
            strides[axis - 1] = strides[axis] * grid.axes[axis].points as usize;
        }
        // The node behind another one along an axis, if there is one.
        let behind = |node: usize, axis: usize| {
            let (points, stride) = (grid.axes[axis].points as usize, strides[axis]);
            let place = node / stride % points;
            match place + 1 < points {
                true => Some(node + stride),
                false => grid.axes[axis].modulo.then(|| node - place * stride),
            }
        };
        let slope = |node: usize, axis: usize| {
            let step = f64::from(grid.axes[axis].step);
            behind(node, axis).map(|next| (sample(next) - sample(node)) / step)
        };
        for (i, &stride) in strides.iter().enumerate() {
            let Some(first) = letter(grid.axes[i].input) else {
                continue;
            };
            let (mut kink, mut mixed) = (0.0_f64, vec![0.0_f64; count]);
            let points = grid.axes[i].points as usize;
            for node in 0..grid.nodes() as usize {
                let Some(here) = slope(node, i) else { continue };
                let place = node / stride % points;
                if !grid.axes[i].modulo && (place == 0 || place + 2 == points) {
                    kink = kink.max(here.abs());
                }
                for (j, mixed) in mixed.iter_mut().enumerate() {
                    if let Some(there) = behind(node, j).and_then(|next| slope(next, i)) {
                        let change = (there - here).abs();
                        if i == j {
                            kink = kink.max(change);
                        } else {
                            *mixed = mixed.max(change / f64::from(grid.axes[j].step));
                        }
                    }
                }
            }
            self.add_table(first, kink, f64::from(grid.axes[i].step));
            for (j, mixed) in mixed.into_iter().enumerate() {
                if let (Some(second), true) = (letter(grid.axes[j].input), i != j) {
                    self.other[first][second] += mixed;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tables::Tables;
    use super::*;
    use proptest::prelude::*;
    use trueaxis::{
        Axis, Direction, Draft, DraftBank, DraftGrid, GridAxis, Policy, SampleFormat, Term, Travel,
    };
    use trueaxis_model::validate::Runtime;

    /// X, Y and C, the last one endless.
    fn axes() -> Vec<Axis> {
        let axis = |(name, travel, period): (u8, [f32; 2], f32)| Axis {
            name,
            travel,
            period,
            value_bound: 10.0,
            rate_bound: 10.0,
            reversal_threshold: 0.001,
            ramp_rate: 1.0,
            reversal_rate: 10.0,
            reversal_acceleration: 20.0,
        };
        let endless = [-f32::MAX, f32::MAX];
        let all = [
            (b'X', [0.0, 100.0], 0.0),
            (b'Y', [0.0, 100.0], 0.0),
            (b'C', endless, 360.0),
        ];
        all.map(axis).to_vec()
    }

    fn draft(samples: &[f32], cubic: bool) -> Draft {
        let bank = |input: u8, start: f32, step: f32, modulo: bool, column: &[f32]| DraftBank {
            input,
            start,
            step,
            modulo,
            direction: Direction::Both,
            interpolation: match cubic {
                true => Interpolation::Cubic,
                false => Interpolation::Linear,
            },
            format: SampleFormat::F32,
            columns: vec![column.to_vec()],
        };
        let term = |output, weight, factors: &[u8]| Term {
            output,
            weight,
            limits: None,
            factors: factors.iter().copied().collect(),
        };
        let grid = |input, points| GridAxis {
            input,
            start: 10.0,
            step: 20.0,
            points,
            modulo: false,
        };
        Draft {
            machine: "bend".to_owned(),
            policy: Policy::default(),
            axes: axes(),
            auxiliaries: Vec::new(),
            banks: vec![
                bank(0, 10.0, 12.0, false, &samples[..6]),
                bank(1, 0.0, 25.0, false, &samples[6..11]),
                bank(2, 0.0, 60.0, true, &samples[11..17]),
            ],
            terms: vec![
                term(0, 1.0, &[0, 1]),
                term(1, -2.0, &[1, 2]),
                term(1, 0.5, &[0]),
                term(2, 1.0, &[0, 1, 2]),
                term(2, 0.3, &[1, 1]),
            ],
            grids: vec![DraftGrid {
                values: samples[17..41].to_vec(),
                axes: vec![grid(0, 4), grid(1, 3)].into_iter().collect(),
                outputs: vec![0, 2],
                format: SampleFormat::F32,
            }],
            notes: trueaxis::Notes::default(),
        }
    }

    proptest! {
        #[test]
        fn no_move_bends_more_than_the_bound_says(
            samples in proptest::collection::vec(-1.0_f32..1.0, 41),
            cubic in any::<bool>(),
            from in proptest::array::uniform3(0.0_f64..100.0),
            by in proptest::array::uniform3(-1.0_f64..1.0),
            size in 0.1_f64..40.0,
        ) {
            let blob = draft(&samples, cubic).encode().unwrap();
            let runtime = Runtime::load(&blob).unwrap();
            let tables = Tables::new(runtime.compensation()).unwrap();
            let (mut start, mut way) = ([0.0; COUNT], [0.0; COUNT]);
            for (k, letter) in [0, 1, 5].into_iter().enumerate() {
                (start[letter], way[letter]) = (from[k], size * by[k]);
            }
            let [linear, rotary] = tables.bend.at_most(&way);
            let at = |t: f64| {
                let q = std::array::from_fn(|i| start[i] + t * way[i]);
                tables.at(&q, &[Travel::Unknown; COUNT], 0.0)
            };
            let (first, last) = (at(0.0), at(1.0));
            for k in 0..=64 {
                let t = f64::from(k) / 64.0;
                let here = at(t);
                let off: PerLetter =
                    std::array::from_fn(|i| here[i] - first[i] - t * (last[i] - first[i]));
                // f32 rounds positions near 100, and sums near 1.
                let rounding = 2e-6;
                prop_assert!(libm::hypot(off[0], off[1]) <= linear + rounding, "{off:?} {linear}");
                prop_assert!(off[5].abs() <= rotary + rounding, "{off:?} {rotary}");
            }
        }
    }

    #[test]
    fn a_single_point_in_the_middle_of_a_move_bends_as_much_as_the_bound_but_for_its_length() {
        let mut draft = draft(&[0.0; 41], false);
        draft.banks[0].columns[0] = vec![0.0, 0.0, 0.0, 0.12, 0.24, 0.36];
        draft.terms.truncate(3);
        draft.terms.drain(..2);
        let blob = draft.encode().unwrap();
        let runtime = Runtime::load(&blob).unwrap();
        let tables = Tables::new(runtime.compensation()).unwrap();
        let mut by = [0.0; COUNT];
        by[0] = 1.2;
        // Half of 0.01 per mm; a quarter of that over 1.2 mm, and a tenth more for another point.
        let expected = 0.25 * 0.005 * 1.2 * 1.1;
        let [linear, rotary] = tables.bend.at_most(&by);
        assert!((linear - expected).abs() < 1e-9, "{linear} {expected}");
        assert_eq!(rotary, 0.0);
    }
}

//! Samples of all components along one variable, each computed once.

use super::component::Component;
use super::sampling::Sampler;
use nalgebra::DMatrix;
use std::collections::{BTreeMap, BTreeSet};
use trueaxis_model::kinematics::NotConverged;
use trueaxis_model::machine::PerAxis;
use trueaxis_model::numbers::ascending;
use trueaxis_model::parallel;

/// Switches of a component and whether it is even, node, and the bits of the position along a variable.
type Place = ((u32, bool), usize, u64);

/// One output of one component at fixed values of all other variables.
#[derive(Clone, Debug)]
pub struct Column {
    pub component: usize,
    pub monomial: usize,
    pub node: usize,
    pub output: usize,
}

/// What samples along a variable contain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Shows {
    /// A rotary axis whose own motions are switched off, or that has none: its sines and cosines.
    Turning,
    /// Own motions.
    Moving,
    /// Own motions together with those of another axis.
    Joint,
}

impl Shows {
    /// For the `k`-th rich variable of a component.
    pub fn of(component: &Component, k: usize) -> Self {
        match (
            component.moving[k],
            component.moving.iter().filter(|m| **m).count(),
        ) {
            (false, _) => Self::Turning,
            (true, 1) => Self::Moving,
            (true, _) => Self::Joint,
        }
    }
}

/// Samples of which the functions before leave less than this, in the unit, tell nothing new.
const LEAST: f64 = 1e-4;
/// Number of blocks of columns kept for each function: the largest residual in four is close to the largest in all.
const TIMES: usize = 4;

/// Samples along one variable at one set of nodes.
#[derive(Clone)]
pub struct Along {
    pub shows: Shows,
    /// The node positions.
    pub nodes: Vec<f64>,
    /// The origin of each column of the samples.
    pub columns: Vec<Column>,
    /// Nodes × columns.
    pub samples: DMatrix<f64>,
}

impl Along {
    /// The samples along variable `v` that tell its functions, grouped by what they show; within a group, sets with more
    /// nodes come last. In `unit`, one for each output.
    pub fn all(v: usize, components: &[Component], unit: &[f64]) -> Vec<Self> {
        let mut groups: BTreeMap<(Shows, usize), Taken> = BTreeMap::new();
        for (c, component) in components.iter().enumerate() {
            let Some(k) = component.rich.iter().position(|(w, _)| *w == v) else {
                continue;
            };
            let nodes = &component.rich[k].1;
            let group = groups.entry((Shows::of(component, k), nodes.len()));
            let taken = group.or_insert_with(|| Taken {
                nodes: nodes.clone(),
                columns: Vec::new(),
                samples: Vec::new(),
            });
            taken.take(c, component, k, unit);
        }
        groups
            .into_iter()
            .map(|((shows, count), taken)| Self {
                shows,
                nodes: taken.nodes,
                samples: DMatrix::from_vec(count, taken.columns.len(), taken.samples),
                columns: taken.columns,
            })
            .map(Self::telling)
            .collect()
    }

    /// Keeps the columns that tell which functions there are. The next one is always that which the columns kept so far
    /// explain worst, and brings along all that are sampled beside it. At most as many columns as there are nodes are
    /// independent; after that many, the choice begins anew among the others.
    fn telling(self) -> Self {
        let block = |c: usize| (self.columns[c].component, self.columns[c].node);
        let mut kept: BTreeSet<(usize, usize)> = BTreeSet::new();
        for _ in 0..TIMES {
            let mut rest = Rest::of(&self.samples, |c| !kept.contains(&block(c)));
            for _ in 0..self.nodes.len() {
                let Some((most, function)) = rest.largest() else {
                    break;
                };
                kept.insert(block(most));
                rest.leave(&function);
            }
        }
        let kept = (0..self.columns.len()).filter(|c| kept.contains(&block(*c)));
        let kept: Vec<usize> = kept.collect();
        Self {
            shows: self.shows,
            samples: self.samples.select_columns(&kept),
            columns: kept.into_iter().map(|c| self.columns[c].clone()).collect(),
            nodes: self.nodes,
        }
    }

    /// The same samples in another unit: each output's is multiplied by a factor.
    pub fn times(&self, factors: &PerAxis) -> Self {
        let mut samples = self.samples.clone();
        for (mut column, from) in samples.column_iter_mut().zip(&self.columns) {
            column *= factors[from.output];
        }
        Self {
            samples,
            ..self.clone()
        }
    }
}

/// What some functions leave of columns, as far as it is not negligible.
struct Rest {
    nodes: usize,
    /// Node fastest.
    values: Vec<f64>,
    /// The number of each column.
    numbers: Vec<usize>,
    /// The place of the largest one.
    largest: Option<usize>,
}

impl Rest {
    /// The columns whose numbers count.
    fn of(samples: &DMatrix<f64>, counts: impl Fn(usize) -> bool) -> Self {
        let nodes = samples.nrows();
        let numbers: Vec<usize> = (0..samples.ncols()).filter(|c| counts(*c)).collect();
        let mut values = Vec::with_capacity(nodes * numbers.len());
        for c in &numbers {
            values.extend_from_slice(&samples.as_slice()[c * nodes..][..nodes]);
        }
        let mut all = Self {
            nodes,
            values,
            numbers,
            largest: None,
        };
        all.leave(&vec![0.0; nodes]);
        all
    }

    /// The number of the largest column, and a unit vector along it.
    fn largest(&self) -> Option<(usize, Vec<f64>)> {
        let place = self.largest?;
        let column = &self.values[place * self.nodes..][..self.nodes];
        let size = column.iter().map(|x| x * x).sum::<f64>().sqrt();
        let function = column.iter().map(|x| x / size).collect();
        Some((self.numbers[place], function))
    }

    /// Takes a unit vector out of all columns.
    fn leave(&mut self, function: &[f64]) {
        let n = self.nodes;
        let (mut count, mut most) = (0, LEAST * LEAST);
        self.largest = None;
        for place in 0..self.numbers.len() {
            let column = &mut self.values[place * n..][..n];
            let along: f64 = column.iter().zip(function).map(|(x, f)| x * f).sum();
            let mut square = 0.0;
            for (x, f) in column.iter_mut().zip(function) {
                *x -= along * f;
                square += *x * *x;
            }
            if square <= LEAST * LEAST {
                continue;
            }
            if square > most {
                (most, self.largest) = (square, Some(count));
            }
            self.values
                .copy_within(place * n..(place + 1) * n, count * n);
            self.numbers[count] = self.numbers[place];
            count += 1;
        }
        self.numbers.truncate(count);
        self.values.truncate(count * n);
    }
}

/// Samples at one set of nodes, while they are being collected.
struct Taken {
    nodes: Vec<f64>,
    columns: Vec<Column>,
    /// Node fastest.
    samples: Vec<f64>,
}

impl Taken {
    /// Adds component `c` along its `k`-th rich variable, without columns that tell nothing.
    fn take(&mut self, c: usize, component: &Component, k: usize, unit: &[f64]) {
        let (stride, rich) = (component.stride(k), component.nodes());
        let count = component.rich[k].1.len();
        for monomial in 0..component.monomials.len() {
            for node in (0..rich).filter(|n| n / stride % count == 0) {
                let base = monomial * rich + node;
                for (output, unit) in unit.iter().enumerate() {
                    let value = |i: usize| component.values[base + i * stride][output] / unit;
                    if (0..count).map(|i| value(i).powi(2)).sum::<f64>() <= LEAST * LEAST {
                        continue;
                    }
                    self.samples.extend((0..count).map(value));
                    self.columns.push(Column {
                        component: c,
                        monomial,
                        node,
                        output,
                    });
                }
            }
        }
    }
}

impl Sampler<'_> {
    /// The coefficients (mm, rad) for columns, at positions along variable `v`: positions × columns.
    pub fn along(
        &self,
        columns: &[Column],
        v: usize,
        components: &[Component],
        at: &[f64],
    ) -> Result<DMatrix<f64>, NotConverged> {
        let variable = &self.variables[v];
        let sampled: Vec<_> = at.iter().map(|x| variable.sampled_for(*x)).collect();
        let mut places: Vec<f64> = sampled.iter().flatten().map(|(x, _)| *x).collect();
        ascending(&mut places);
        places.dedup();
        let known = self.coefficients_at_all(columns, v, components, &places)?;
        let parts = sampled.iter().map(|sampled| {
            let place = |(x, weight): &(f64, f64)| (places.partition_point(|p| p < x), *weight);
            sampled.iter().map(place).collect::<Vec<_>>()
        });
        let parts: Vec<_> = parts.collect();
        Ok(DMatrix::from_fn(at.len(), columns.len(), |row, column| {
            let parts = parts[row].iter();
            parts.fold(0.0, |sum, (place, weight)| {
                sum + weight * known[(*place, column)]
            })
        }))
    }

    /// The coefficients at places, each computed once.
    fn coefficients_at_all(
        &self,
        columns: &[Column],
        v: usize,
        components: &[Component],
        places: &[f64],
    ) -> Result<DMatrix<f64>, NotConverged> {
        let line = |c: &Column| {
            let component = &components[c.component];
            ((component.on, component.even), c.node, v, c.monomial)
        };
        // With monomial and component.
        let mut missing: Vec<(Place, usize, usize)> = Vec::new();
        {
            let known = self.memory.known();
            for column in columns {
                let (switches, node, _, monomial) = line(column);
                let known = known.get(&line(column));
                let bits = places.iter().map(|x| x.to_bits());
                let new = bits.filter(|x| known.is_none_or(|known| !known.contains_key(x)));
                missing.extend(new.map(|x| ((switches, node, x), monomial, column.component)));
            }
        }
        // Columns that differ only in the output share their reference corrections; those that differ in the monomial
        // share most of them.
        missing.sort_unstable();
        missing.dedup();
        let shared: Vec<_> = missing.chunk_by(|a, b| a.0 == b.0).collect();
        let made = parallel::try_map(&shared, |same| {
            let ((_, node, x), _, component) = same[0];
            let component = &components[component];
            let monomials: Vec<usize> = same.iter().map(|(_, monomial, _)| *monomial).collect();
            let mut place = component.place(node);
            place[v] = f64::from_bits(x);
            self.coefficients(component, &monomials, &place)
        })?;
        let mut known = self.memory.known();
        for (same, values) in shared.iter().zip(made) {
            for (((switches, node, x), monomial, _), value) in same.iter().zip(values) {
                let line = (*switches, *node, v, *monomial);
                known.entry(line).or_default().insert(*x, value);
            }
        }
        let mut values = Vec::with_capacity(places.len() * columns.len());
        for column in columns {
            let known = &known[&line(column)];
            values.extend(places.iter().map(|x| known[&x.to_bits()][column.output]));
        }
        Ok(DMatrix::from_vec(places.len(), columns.len(), values))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_columns_tell_the_functions_of_thousands() {
        let at = |i: usize| i as f64 / 8.0 - 1.0;
        // Sums of three functions, of very different sizes, and of nothing; two outputs are sampled side by side.
        let functions = |i: usize| [1.0, at(i), at(i).powi(5)];
        let column = |c: usize| Column {
            component: 0,
            monomial: 0,
            node: c / 2,
            output: c % 2,
        };
        let factors = |c: usize| match c % 5 {
            0 => [0.0; 3],
            k => [
                1e4 / k as f64,
                libm::sin(c as f64),
                1e-2 * libm::cos(c as f64),
            ],
        };
        let value = |i: usize, c: usize| {
            let parts = functions(i).into_iter().zip(factors(c));
            parts.map(|(f, a)| f * a).sum::<f64>()
        };
        let all = Along {
            shows: Shows::Moving,
            nodes: (0..17).map(at).collect(),
            columns: (0..3000).map(column).collect(),
            samples: DMatrix::from_fn(17, 3000, value),
        };
        let samples = all.samples.clone();
        let kept = all.telling();
        assert!(
            kept.columns.len() <= 2 * 3 * TIMES,
            "{}",
            kept.columns.len()
        );
        let pairs = kept.columns.chunks(2);
        assert!(pairs.into_iter().all(|pair| pair[0].node == pair[1].node));
        // All others are sums of these.
        let inverse = kept.samples.clone().pseudo_inverse(1e-6).unwrap();
        let left = &samples - &kept.samples * (inverse * &samples);
        assert!(left.amax() < LEAST, "{}", left.amax());
    }
}

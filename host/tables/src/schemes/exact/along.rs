//! Samples of all components along one variable, each computed once.

use super::sampling::{Component, Key, Sampler};
use nalgebra::DMatrix;
use std::collections::BTreeMap;
use trueaxis_model::kinematics::NotConverged;
use trueaxis_model::machine::PerAxis;
use trueaxis_model::parallel;

/// One output of one component at fixed values of all other variables.
#[derive(Clone, Debug)]
pub struct Column {
    pub component: usize,
    pub monomial: usize,
    pub node: usize,
    pub output: usize,
}

impl Column {
    /// True if they share all of their reference corrections.
    pub(crate) fn is_sampled_with(&self, other: &Self) -> bool {
        self.monomial == other.monomial && self.is_beside(other)
    }

    /// True if they share most of their reference corrections.
    pub(crate) fn is_beside(&self, other: &Self) -> bool {
        (self.component, self.node) == (other.component, other.node)
    }
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

/// Samples along one variable at one set of nodes, in units of the tolerances.
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
    /// All samples along variable `v`, grouped by what they show; within a group, sets with more nodes come last.
    pub fn all(v: usize, components: &[Component], tolerance: &[f64]) -> Vec<Self> {
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
            taken.take(c, component, k, tolerance);
        }
        groups
            .into_iter()
            .map(|((shows, count), taken)| Self {
                shows,
                nodes: taken.nodes,
                samples: DMatrix::from_vec(count, taken.columns.len(), taken.samples),
                columns: taken.columns,
            })
            .collect()
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
    /// Adds component `c` along its `k`-th rich variable.
    fn take(&mut self, c: usize, component: &Component, k: usize, tolerance: &[f64]) {
        let (stride, rich) = (component.stride(k), component.nodes());
        let count = component.rich[k].1.len();
        for monomial in 0..component.monomials.len() {
            for node in (0..rich).filter(|n| n / stride % count == 0) {
                let base = monomial * rich + node;
                for (output, unit) in tolerance.iter().enumerate() {
                    let value = |i: usize| component.values[base + i * stride][output] / unit;
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
    /// The coefficients (mm, rad, all outputs) for columns, at positions along variable `v`: positions × columns.
    pub fn along(
        &self,
        columns: &[Column],
        v: usize,
        components: &[Component],
        at: &[f64],
    ) -> Result<Vec<Vec<PerAxis>>, NotConverged> {
        let key = |c: &Column, x: f64| {
            let component = &components[c.component];
            let switches = (component.on, component.even);
            ((switches, c.node, v, x.to_bits()), c.monomial)
        };
        let mut missing: Vec<(Key, usize)> = Vec::new();
        {
            let known = self.memory.known();
            for x in at {
                for column in columns {
                    let key = key(column, *x);
                    if !known.contains_key(&key) {
                        missing.push((key, column.component));
                    }
                }
            }
        }
        // Columns that differ only in the output share their reference corrections; those that differ in the monomial
        // share most of them.
        missing.sort_unstable();
        missing.dedup();
        let places: Vec<&[(Key, usize)]> = missing.chunk_by(|a, b| a.0.0 == b.0.0).collect();
        let made = parallel::try_map(&places, |keys| {
            let values = self.coefficients_at(keys, components)?;
            let keys = keys.iter().map(|(key, _)| *key);
            Ok::<_, NotConverged>(keys.zip(values).collect::<Vec<_>>())
        })?;
        let made = made.into_iter().flatten();
        let mut known = self.memory.known();
        known.extend(made);
        Ok(at
            .iter()
            .map(|x| columns.iter().map(|c| known[&key(c, *x)]).collect())
            .collect())
    }

    /// The coefficients at one place.
    fn coefficients_at(
        &self,
        keys: &[(Key, usize)],
        components: &[Component],
    ) -> Result<Vec<PerAxis>, NotConverged> {
        let mut means = vec![PerAxis::default(); keys.len()];
        let Some(&(((_, node, v, x), _), component)) = keys.first() else {
            return Ok(means);
        };
        let component = &components[component];
        let monomials: Vec<usize> = keys.iter().map(|(key, _)| key.1).collect();
        let mut place = component.place(node);
        let sides = self.variables[v].sides(f64::from_bits(x));
        for side in &sides {
            place[v] = *side;
            let values = self.coefficients(component, &monomials, &place)?;
            for (mean, value) in means.iter_mut().zip(values) {
                for (m, x) in mean.iter_mut().zip(value) {
                    *m += x / sides.len() as f64;
                }
            }
        }
        Ok(means)
    }
}

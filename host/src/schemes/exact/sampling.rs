//! Exact corrections on small grids, split into what every source of error adds.

use super::variables::{Kind, MAX_VARIABLES, Place, Variable};
use crate::errors::{Situation, Switches};
use crate::kinematics::{Kinematics, NotConverged};
use crate::machine::{MAX_AXES, PerAxis};
use rayon::prelude::*;

/// The exact correction as a function of the variables.
pub struct Sampler<'a> {
    pub kinematics: &'a Kinematics<'a>,
    pub variables: &'a [Variable],
    /// Subtracted everywhere: the correction at the zero position (mm, rad).
    pub zero: PerAxis,
}

/// One part of the correction: what the switches in `on` add together, beyond what each proper
/// subset of them adds.
#[derive(Clone, Debug)]
pub struct Component {
    /// Bit set of the switched variables (by index).
    pub on: u32,
    /// The rich variables, and their node positions here.
    pub rich: Vec<(usize, Vec<f64>)>,
    /// Variables in which it is affine, jointly of degree one.
    pub affine: Vec<usize>,
    /// Odd variables: it is proportional to each of them.
    pub odd: Vec<usize>,
    /// Values, mm and rad per output: affine part (constant first) slowest, then the rich nodes in order.
    pub values: Vec<PerAxis>,
}

impl Sampler<'_> {
    /// The exact correction with the switches in `on`.
    pub fn exact(&self, place: &Place, on: u32) -> Result<PerAxis, NotConverged> {
        let mut q = PerAxis::default();
        let mut situation = Situation::default();
        let mut switches = Switches([false; MAX_AXES]);
        for (v, variable) in self.variables.iter().enumerate() {
            let active = on >> v & 1 == 1;
            match variable.kind {
                Kind::Affine(i) | Kind::Rotary(i) => q[i] = place[v],
                Kind::Bending(i) => {
                    q[i] = place[v];
                    switches.0[i] = active;
                }
                Kind::Length => situation.length = Some(place[v]),
                Kind::Kelvin(k) if active => situation.kelvin[k] = place[v],
                Kind::Sign(i) if active => situation.sign[i] = place[v],
                Kind::Kelvin(_) | Kind::Sign(_) => {}
            }
        }
        let mut dq = self.kinematics.correction(&q, &situation, &switches)?.dq;
        if on == 0 {
            for (d, z) in dq.iter_mut().zip(&self.zero) {
                *d -= z;
            }
        }
        Ok(dq)
    }

    /// What the switches in `on` add together at a place (inclusion and exclusion).
    pub fn added(&self, place: &Place, on: u32) -> Result<PerAxis, NotConverged> {
        let mut sum = PerAxis::default();
        let mut subset = on;
        loop {
            let sign = if (on.count_ones() - subset.count_ones()) % 2 == 0 { 1.0 } else { -1.0 };
            // The zero offset belongs to the part without switches, and to it alone.
            let value = self.exact(place, subset)?;
            let offset = if subset == 0 && on != 0 { self.zero } else { PerAxis::default() };
            for ((s, v), o) in sum.iter_mut().zip(value).zip(offset) {
                *s += sign * (v + o);
            }
            if subset == 0 {
                return Ok(sum);
            }
            subset = (subset - 1) & on;
        }
    }

    /// An empty component: `nodes` says how many nodes each rich variable gets.
    pub fn component(&self, on: u32, nodes: impl Fn(usize) -> usize) -> Component {
        let mut component = Component {
            on,
            rich: Vec::new(),
            affine: Vec::new(),
            odd: Vec::new(),
            values: Vec::new(),
        };
        for (v, variable) in self.variables.iter().enumerate() {
            let active = on >> v & 1 == 1;
            match variable.kind {
                Kind::Rotary(_) => component.rich.push((v, variable.positions(nodes(v)))),
                Kind::Bending(_) if active => component.rich.push((v, variable.positions(nodes(v)))),
                Kind::Affine(_) | Kind::Bending(_) | Kind::Length => component.affine.push(v),
                Kind::Kelvin(_) | Kind::Sign(_) if active => component.odd.push(v),
                Kind::Kelvin(_) | Kind::Sign(_) => {}
            }
        }
        component
    }

    /// The factor of the odd variables' ξ, with one affine variable at ξ = 1 (`affine` counted
    /// from 1) or none (0), the others at 0, and the rich variables at `place`.
    fn displaced(&self, component: &Component, affine: usize, place: &Place) -> Result<PerAxis, NotConverged> {
        let mut place = *place;
        for &v in &component.affine {
            place[v] = 0.0;
        }
        if affine > 0 {
            let v = component.affine[affine - 1];
            place[v] = self.variables[v].scale();
        }
        let mut sum = PerAxis::default();
        // Both ends of every odd variable, with the sign of their product.
        for corner in 0..1_u32 << component.odd.len() {
            let mut weight = 1.0;
            for (k, &v) in component.odd.iter().enumerate() {
                let end = if corner >> k & 1 == 1 { 1.0 } else { -1.0 };
                place[v] = end * self.variables[v].scale();
                weight *= 0.5 * end;
            }
            let value = self.added(&place, component.on)?;
            for (s, v) in sum.iter_mut().zip(value) {
                *s += weight * v;
            }
        }
        Ok(sum)
    }

    /// The coefficient of an affine function (0 for the constant, then ξ of each affine variable)
    /// times the product of the odd variables' ξ, with the rich variables at `place`.
    pub fn coefficient(&self, component: &Component, affine: usize, place: &Place) -> Result<PerAxis, NotConverged> {
        let constant = self.displaced(component, 0, place)?;
        if affine == 0 {
            return Ok(constant);
        }
        let moved = self.displaced(component, affine, place)?;
        Ok(std::array::from_fn(|i| moved[i] - constant[i]))
    }

    /// Fills the values of a component.
    pub fn fill(&self, component: &mut Component) -> Result<(), NotConverged> {
        let shape: Vec<usize> = component.rich.iter().map(|(_, p)| p.len()).collect();
        let nodes: usize = shape.iter().product();
        let values: Result<Vec<PerAxis>, NotConverged> = (0..nodes * (component.affine.len() + 1))
            .into_par_iter()
            .with_min_len(64)
            .map(|index| {
                let place = component.place(index % nodes);
                self.displaced(component, index / nodes, &place)
            })
            .collect();
        let mut values = values?;
        let (constant, moved) = values.split_at_mut(nodes);
        for moved in moved.chunks_mut(nodes) {
            for (m, c) in moved.iter_mut().flatten().zip(constant.iter().flatten()) {
                *m -= c;
            }
        }
        component.values = values;
        Ok(())
    }
}

impl Component {
    /// The place of a rich node (affine and odd variables 0).
    pub fn place(&self, mut node: usize) -> Place {
        let mut place = [0.0; MAX_VARIABLES];
        for (v, positions) in self.rich.iter().rev() {
            place[*v] = positions[node % positions.len()];
            node /= positions.len();
        }
        place
    }

    /// Number of rich nodes.
    pub fn nodes(&self) -> usize {
        self.rich.iter().map(|(_, p)| p.len()).product()
    }

    /// Distance in the node index between neighbours of the `k`-th rich variable.
    pub fn stride(&self, k: usize) -> usize {
        self.rich[k + 1..].iter().map(|(_, p)| p.len()).product()
    }
}

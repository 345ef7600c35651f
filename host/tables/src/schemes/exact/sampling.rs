//! Samples reference corrections on small grids, split into the contribution of every source of error.

use super::component::{Component, Levers};
use super::nodes;
use super::variables::{Kind, Variable, VariableValues};
use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use trueaxis_model::errors::{Situation, Switches};
use trueaxis_model::kinematics::{Jacobian, Kinematics, NotConverged};
use trueaxis_model::machine::{MAX_AXES, PerAxis};
use trueaxis_model::parallel;

/// Step (mm or rad) at which the iteration for samples ends. Each step is at most 1e-2 of the one before, for errors of
/// 1 %, and 1e-4 for usual ones, so what is left is at most 4e-4 of the finest usual tolerance, and usually 4e-6.
const STEP: f64 = 2e-9;

/// Switches of a component and whether it is even, node, variable, and monomial.
pub type Line = ((u32, bool), usize, usize, usize);

/// Samples taken so far: along each line by the bits of the position. Lines are looked up once for all of their positions:
/// in one map for millions of samples, nearly every look-up would wait for memory.
#[derive(Debug, Default)]
pub struct Memory(Mutex<HashMap<Line, HashMap<u64, PerAxis>>>);

impl Memory {
    /// Access to all samples.
    pub fn known(&self) -> MutexGuard<'_, HashMap<Line, HashMap<u64, PerAxis>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The reference correction as a function of the variables.
pub struct Sampler<'a> {
    pub kinematics: Kinematics<'a>,
    pub variables: Vec<Variable>,
    /// Subtracted everywhere: the correction at the zero position (mm, rad).
    pub zero: PerAxis,
    /// Replacement values of motions that are switched off: their middle values, which minimize the interactions of
    /// motions, some of which are left out.
    instead: [[f64; 6]; MAX_AXES],
    /// Samples along variables made so far.
    pub memory: Memory,
}

/// Number of positions along an axis at which the middle of its motions is searched: one or two per measured point.
const MIDDLES: usize = 200;

impl<'a> Sampler<'a> {
    /// Finds the replacement values of motions that are switched off.
    pub fn new(kinematics: &Kinematics<'a>, variables: Vec<Variable>, zero: PerAxis) -> Self {
        let (machine, errors) = (kinematics.machine, kinematics.errors);
        let situation = Situation::default();
        let mut instead = [[0.0; 6]; MAX_AXES];
        for (i, instead) in instead.iter_mut().enumerate().take(machine.axes.len()) {
            let [low, high] = errors.calibrated[i];
            let mut ends = [[f64::INFINITY; 6], [f64::NEG_INFINITY; 6]];
            for step in 0..=MIDDLES {
                let q = low + (high - low) * step as f64 / MIDDLES as f64;
                let at = |switches| errors.intra_at(machine, i, q, &situation, switches);
                let (Some(on), Some(off)) = (at(&Switches::ALL), at(&Switches::NONE)) else {
                    break;
                };
                for component in 0..6 {
                    let lost = on[component] - off[component];
                    ends[0][component] = ends[0][component].min(lost);
                    ends[1][component] = ends[1][component].max(lost);
                }
            }
            for (component, instead) in instead.iter_mut().enumerate() {
                let middle = 0.5 * (ends[0][component] + ends[1][component]);
                *instead = if middle.is_finite() { middle } else { 0.0 };
            }
        }
        Self {
            kinematics: kinematics.clone(),
            variables,
            zero,
            instead,
            memory: Memory::default(),
        }
    }
}

impl Sampler<'_> {
    /// The reference correction with the switches in `on`.
    pub fn exact(&self, place: &VariableValues, on: u32) -> Result<PerAxis, NotConverged> {
        let mut q = PerAxis::default();
        let mut situation = Situation::default();
        let mut switches = Switches {
            instead: self.instead,
            ..Switches::NONE
        };
        for (v, variable) in self.variables.iter().enumerate() {
            let active = on >> v & 1 == 1;
            match variable.kind {
                Kind::Affine(i) => q[i] = place[v],
                Kind::Bending(i) | Kind::Rotary(i) => {
                    q[i] = place[v];
                    switches.on[i] = active || !variable.moves;
                }
                Kind::Length => situation.length = Some(place[v]),
                Kind::Kelvin(k) if active => situation.kelvin[k] = place[v],
                Kind::Sign(i) if active => situation.sign[i] = place[v],
                Kind::Kelvin(_) | Kind::Sign(_) => {}
            }
        }
        // Inside its calibrated range, and between measured points, a motion is continued smoothly as far as the
        // correction carries it across an end. Outside it holds the end value. So tables are smooth up to the ends.
        situation.pieces_by = Some(q);
        Ok(self
            .kinematics
            .correction_within(&q, &situation, &switches, STEP)?
            .dq)
    }

    /// Effect of the axes on the tool at a place.
    pub fn jacobian(&self, place: &VariableValues) -> Jacobian {
        let mut q = PerAxis::default();
        let mut length = None;
        for (x, variable) in place.iter().zip(&self.variables) {
            match variable.kind {
                Kind::Affine(i) | Kind::Bending(i) | Kind::Rotary(i) => q[i] = *x,
                Kind::Length => length = Some(*x),
                Kind::Kelvin(_) | Kind::Sign(_) => {}
            }
        }
        self.kinematics.jacobian(&q, length)
    }

    /// True if the correction itself carries an axis across an end of its calibrated range. The motion bends at the
    /// corrected position, so the reference correction is not a sum of products there.
    pub(crate) fn is_near_end(&self, place: &VariableValues, correction: &PerAxis) -> bool {
        self.variables
            .iter()
            .enumerate()
            .any(|(v, variable)| match variable.kind {
                Kind::Bending(i) | Kind::Rotary(i) => variable
                    .ends
                    .iter()
                    .any(|end| (place[v] - end).abs() <= 2.0 * correction[i].abs()),
                _ => false,
            })
    }

    /// The contribution of the switches in `on` together at a place (inclusion and exclusion).
    pub fn added(&self, place: &VariableValues, on: u32) -> Result<PerAxis, NotConverged> {
        self.added_with(place, on, 0)
    }

    /// The part of that contribution in which `always` are on.
    fn added_with(
        &self,
        place: &VariableValues,
        on: u32,
        always: u32,
    ) -> Result<PerAxis, NotConverged> {
        let mut sum = PerAxis::default();
        let mut subset = on;
        loop {
            if subset & always == always {
                let sign = if (on.count_ones() - subset.count_ones()).is_multiple_of(2) {
                    1.0
                } else {
                    -1.0
                };
                let value = self.exact(place, subset)?;
                for (s, v) in sum.iter_mut().zip(value) {
                    *s += sign * v;
                }
            }
            if subset == 0 {
                return Ok(sum);
            }
            subset = (subset - 1) & on;
        }
    }

    /// An empty component with `nodes[k]` nodes for each rich variable.
    pub fn component(&self, on: u32, nodes: &[usize]) -> Component {
        let mut component = Component {
            on,
            rich: Vec::new(),
            moving: Vec::new(),
            monomials: vec![vec![]],
            odd: Vec::new(),
            even: false,
            values: Vec::new(),
        };
        let mut levers = Vec::new();
        let mut bends = 0;
        for (v, variable) in self.variables.iter().enumerate() {
            let active = on >> v & 1 == 1;
            match variable.kind {
                Kind::Rotary(_) => {
                    component.rich.push((
                        v,
                        if active || variable.is_uneven() {
                            variable.positions(nodes[v])
                        } else {
                            variable.turning_positions(nodes[v])
                        },
                    ));
                    component.moving.push(active);
                }
                Kind::Bending(_) if active => {
                    component.rich.push((v, variable.positions(nodes[v])));
                    component.moving.push(true);
                    bends += 1;
                }
                Kind::Affine(_) | Kind::Bending(_) | Kind::Length => levers.push(v),
                Kind::Kelvin(_) | Kind::Sign(_) if active => component.odd.push(v),
                Kind::Kelvin(_) | Kind::Sign(_) => {}
            }
        }
        component.monomials.extend(levers.iter().map(|v| vec![*v]));
        // Joint effects of two motions are of second order already; those of a motion with temperature or direction
        // of travel are not.
        let moving = component.moving.iter().filter(|m| **m).count();
        if bends == 1 && moving == 1 {
            for (k, &a) in levers.iter().enumerate() {
                component
                    .monomials
                    .extend(levers[k..].iter().map(|b| vec![a, *b]));
            }
        }
        component
    }

    /// The factor of the odd variables' ξ, with the levers at the given ξ (the others at 0) and the rich variables
    /// at `place`.
    fn at(
        &self,
        component: &Component,
        levers: &[(usize, f64)],
        place: &VariableValues,
    ) -> Result<PerAxis, NotConverged> {
        // If an odd variable is switched off, both of its ends are equal and cancel.
        let odd = component.odd.iter().fold(0, |odd, v| odd | 1 << v);
        let added = |at: &VariableValues| self.added_with(at, component.on, odd);
        let place = self.place(component, levers, place);
        let [mut sum, mean] = self.parts(component, place, added)?;
        if component.even {
            let middle = added(&place)?;
            sum = std::array::from_fn(|i| mean[i] - middle[i]);
        }
        // The zero offset belongs only to the part without switches.
        if component.on == 0 {
            for (s, z) in sum.iter_mut().zip(&self.zero) {
                *s -= z;
            }
        }
        Ok(sum)
    }

    /// The coefficients of monomials of the levers' ξ, times the product of the odd variables' ξ, with the rich
    /// variables at `place`.
    pub fn coefficients(
        &self,
        component: &Component,
        monomials: &[usize],
        place: &VariableValues,
    ) -> Result<Vec<PerAxis>, NotConverged> {
        // The monomials share the points of their stencils.
        let mut known: Vec<(Levers, PerAxis)> = Vec::new();
        let mut coefficients = vec![PerAxis::default(); monomials.len()];
        for (sum, monomial) in coefficients.iter_mut().zip(monomials) {
            for (levers, weight) in component.stencil(*monomial) {
                let value = match known.iter().find(|(l, _)| *l == levers) {
                    Some((_, value)) => *value,
                    None => {
                        let value = self.at(component, &levers, place)?;
                        known.push((levers, value));
                        value
                    }
                };
                for (s, v) in sum.iter_mut().zip(value) {
                    *s += weight * v;
                }
            }
        }
        Ok(coefficients)
    }

    /// The values of a component, and their means over both ends of its odd variables.
    pub fn values(&self, component: &Component) -> Result<[Vec<PerAxis>; 2], NotConverged> {
        let shape: Vec<usize> = component.rich.iter().map(|(_, p)| p.len()).collect();
        let nodes: usize = shape.iter().product();
        // The monomials share the points of their stencils.
        let stencils: Vec<_> = (0..component.monomials.len())
            .map(|m| component.stencil(m))
            .collect();
        let mut points: Vec<Levers> = Vec::new();
        for (levers, _) in stencils.iter().flatten() {
            if !points.contains(levers) {
                points.push(levers.clone());
            }
        }
        let weights: Vec<Vec<f64>> = stencils
            .iter()
            .map(|stencil| {
                let weight = |p: &Levers| {
                    stencil
                        .iter()
                        .find(|(l, _)| l == p)
                        .map_or(0.0, |(_, w)| *w)
                };
                points.iter().map(weight).collect()
            })
            .collect();
        let mut rows = vec![[PerAxis::default(); 2]; nodes * points.len()];
        let mut subset = component.on;
        loop {
            self.take_in(component, subset, &points, &mut rows)?;
            if subset == 0 {
                break;
            }
            subset = (subset - 1) & component.on;
        }
        let of = |part: usize| {
            let mut values = vec![PerAxis::default(); nodes * weights.len()];
            for (weights, values) in weights.iter().zip(values.chunks_mut(nodes)) {
                for (value, row) in values.iter_mut().zip(rows.chunks(weights.len())) {
                    for (weight, at) in weights.iter().zip(row) {
                        for (v, a) in value.iter_mut().zip(at[part]) {
                            *v += weight * a;
                        }
                    }
                }
            }
            values
        };
        Ok([of(0), of(1)])
    }
}

impl Sampler<'_> {
    /// Adds the contribution of one subset of the switches to samples of a component (node, then point), with its
    /// sign in the inclusion–exclusion sum.
    fn take_in(
        &self,
        component: &Component,
        subset: u32,
        points: &[Levers],
        rows: &mut [[PerAxis; 2]],
    ) -> Result<(), NotConverged> {
        let has = |v: usize| subset >> v & 1 == 1;
        if component.odd.iter().any(|v| !has(*v)) {
            // If one of them is switched off, both of its ends are equal and cancel.
            return Ok(());
        }
        let sign = if (component.on.count_ones() - subset.count_ones()).is_multiple_of(2) {
            1.0
        } else {
            -1.0
        };
        // A bending motion that is off leaves the correction affine in its axis, or quadratic where it shifts the
        // argument of another motion that is on: two or three positions are enough.
        let mut few = component.clone();
        for (v, positions) in &mut few.rich {
            let bends = matches!(self.variables[*v].kind, Kind::Bending(_));
            if bends && !has(*v) {
                let count = if subset == 0 { 2 } else { 3 };
                *positions = nodes::chebyshev(self.variables[*v].range, count);
            }
        }
        let nodes = Vec::from_iter(0..few.nodes());
        let sampled: Vec<Vec<[PerAxis; 2]>> = parallel::try_map(&nodes, |node| {
            let rich = few.place(*node);
            let at = points.iter().map(|levers| self.place(&few, levers, &rich));
            at.map(|place| self.parts(&few, place, |at| self.exact(at, subset)))
                .collect::<Result<_, NotConverged>>()
        })?;
        for (node, row) in rows.chunks_mut(points.len()).enumerate() {
            for (from, weight) in few.around(component, node) {
                for (value, sample) in row.iter_mut().zip(&sampled[from]) {
                    for (v, s) in value.iter_mut().flatten().zip(sample.iter().flatten()) {
                        *v += sign * weight * s;
                    }
                }
            }
        }
        Ok(())
    }

    /// A place of the rich variables, with the levers at the given ξ and the others at 0.
    fn place(
        &self,
        component: &Component,
        levers: &[(usize, f64)],
        rich: &VariableValues,
    ) -> VariableValues {
        let mut place = *rich;
        let of_levers = component.monomials.iter().flatten();
        let middles = of_levers.chain(&component.odd).map(|v| (*v, 0.0));
        for (v, xi) in middles.chain(levers.iter().copied()) {
            place[v] = self.variables[v].at_coordinate(xi);
        }
        place
    }

    /// The factor of the odd variables' ξ in a function, and its mean over both ends of every odd variable.
    fn parts(
        &self,
        component: &Component,
        mut place: VariableValues,
        function: impl Fn(&VariableValues) -> Result<PerAxis, NotConverged>,
    ) -> Result<[PerAxis; 2], NotConverged> {
        let mut parts = [PerAxis::default(); 2];
        for corner in 0..1_u32 << component.odd.len() {
            let (mut sign, mut share) = (1.0, 1.0);
            for (k, &v) in component.odd.iter().enumerate() {
                let end = if corner >> k & 1 == 1 { 1.0 } else { -1.0 };
                place[v] = self.variables[v].at_coordinate(end);
                (sign, share) = (sign * end, 0.5 * share);
            }
            for (i, value) in function(&place)?.into_iter().enumerate() {
                parts[0][i] += sign * share * value;
                parts[1][i] += share * value;
            }
        }
        Ok(parts)
    }
}

#[cfg(test)]
mod tests;

//! Chooses the components that a correction is split into, and how finely each is sampled.

use super::along::Along;
use super::component::Component;
use super::sampling::Sampler;
use super::trials::{random_place, to_corner};
use super::variables::{Kind, VariableValues};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use std::collections::BTreeMap;
use std::sync::{Mutex, OnceLock, PoisonError};
use trueaxis_model::errors::ParameterKind;
use trueaxis_model::kinematics::NotConverged;
use trueaxis_model::machine::PerAxis;
use trueaxis_model::numbers::by;
use trueaxis_model::parallel;

/// Joint effects of two motions are left out while their total stays below this (in units of the tolerance; twice
/// the root of the sum of squares, because peaks rarely coincide).
const PAIRS_SHOW: f64 = 0.3;
/// Number of random positions at which joint effects are searched.
const PAIR_PLACES: usize = 24;
/// Nodes of each axis whose motions are on together with another's; joint effects of several motions are small.
const JOINT_NODES: usize = 13;
/// Most nodes of a component before variables get fewer, and the fewest per variable: a second on one core.
const MOST_NODES: usize = 30_000;
const LEAST_NODES: usize = 7;

/// The components that a correction is split into, with the samples that tell the functions of every variable.
pub struct Split {
    pub components: Vec<Component>,
    /// For each variable, in `unit`.
    along: Vec<Vec<Along>>,
    /// Of each output (mm, rad): the finest tolerance that is resolved.
    unit: PerAxis,
}

impl Split {
    /// Finds the samples that tell the functions.
    pub fn new(sampler: &Sampler<'_>, components: Vec<Component>, unit: PerAxis) -> Self {
        let outputs = sampler.kinematics.machine.axes.len();
        let variables: Vec<usize> = (0..sampler.variables.len()).collect();
        let of = |v: &usize| Along::all(*v, &components, &unit[..outputs]);
        Self {
            along: parallel::map(&variables, of),
            components,
            unit,
        }
    }

    /// The samples along a variable, in units of the tolerance.
    pub fn along(&self, v: usize, tolerance: &PerAxis) -> Vec<Along> {
        let factors = std::array::from_fn(|i| self.unit[i] / tolerance[i]);
        self.along[v]
            .iter()
            .map(|along| along.times(&factors))
            .collect()
    }
}

/// Joint effects of pairs of first-order sets, as far as they have been sampled.
#[derive(Default)]
pub struct Joint {
    /// The largest effect of each union at random places (mm, rad).
    sizes: OnceLock<Vec<(PerAxis, u32)>>,
    sampled: Mutex<BTreeMap<u32, Component>>,
}

/// The part with everything switched off, and all parts of first order. For temperatures also their squares, which
/// are of second order but large on machines that become warm.
pub fn first_order(sampler: &Sampler<'_>) -> Result<Vec<Component>, NotConverged> {
    let is_temperature = |v: &usize| matches!(sampler.variables[*v].kind, Kind::Kelvin(_));
    let mut components: Vec<Component> = Vec::new();
    let mut squares: Vec<Component> = Vec::new();
    for on in std::iter::once(0).chain(first(sampler)) {
        let (new, mean) = component(sampler, on)?;
        let temperature = new.odd.iter().copied().find(is_temperature);
        // At the reference temperature, only the other switches add something. Their part has the same nodes.
        let others = temperature.map(|v| on & !(1 << v));
        if let Some(middle) = components.iter().find(|c| Some(c.on) == others) {
            let values = mean.iter().zip(&middle.values);
            squares.push(Component {
                values: values
                    .map(|(a, b)| std::array::from_fn(|i| a[i] - b[i]))
                    .collect(),
                even: true,
                ..new.clone()
            });
        }
        components.push(new);
    }
    // The zero offset belongs to the constant of the part without switches.
    let constant = components[0].nodes();
    for value in &mut components[0].values[..constant] {
        for (v, zero) in value.iter_mut().zip(&sampler.zero) {
            *v -= zero;
        }
    }
    components.extend(squares);
    Ok(components)
}

/// The sets of switches that add a first-order part together: each alone; the motions of an axis with its direction
/// of travel, if measured in both; and a motion or direction with a temperature that changes it.
fn first(sampler: &Sampler<'_>) -> Vec<u32> {
    let (variables, errors) = (&sampler.variables, sampler.kinematics.errors);
    let mut sets: Vec<u32> = (0..variables.len())
        .filter(|v| variables[*v].is_switch())
        .map(|v| 1 << v)
        .collect();
    let of = |kind: Kind| variables.iter().position(|v| v.kind == kind);
    for (v, variable) in variables.iter().enumerate().filter(|(_, v)| v.moves) {
        let (Kind::Bending(axis) | Kind::Rotary(axis)) = variable.kind else {
            continue;
        };
        let motions = &errors.motions[axis];
        let mut tables = motions.iter().filter_map(|m| m.table.as_ref());
        if tables.any(|t| t.negative.is_some()) {
            sets.extend(of(Kind::Sign(axis)).map(|sign| 1 << v | 1 << sign));
        }
        let changes = motions.iter().flat_map(|m| &m.thermal);
        let mut sensors: Vec<usize> = changes
            .filter(|c| c.kind != ParameterKind::Degree(0))
            .map(|c| c.sensor)
            .collect();
        sensors.sort_unstable();
        sensors.dedup();
        for sensor in sensors {
            sets.extend(of(Kind::Kelvin(sensor)).map(|kelvin| 1 << v | 1 << kelvin));
        }
    }
    sets
}

/// The joint effects of pairs of these sets, where significant, the strongest first; no more than fit into the given
/// work (nodes, each counted once for every subset of its switches).
pub(crate) fn second_order(
    sampler: &Sampler<'_>,
    joint: &Joint,
    tolerance: &PerAxis,
    most: usize,
) -> Result<Vec<Component>, NotConverged> {
    let mut work = 0;
    if joint.sizes.get().is_none() {
        let found = sizes(sampler)?;
        joint.sizes.get_or_init(|| found);
    }
    let sizes = joint.sizes.get().map_or(&[][..], Vec::as_slice);
    let pairs = significant(sizes, tolerance).into_iter();
    let affordable = pairs.take_while(|on| {
        let nodes = size(sampler, *on, &counts(sampler, *on));
        work += nodes << on.count_ones();
        work <= most
    });
    let sampled = || joint.sampled.lock().unwrap_or_else(PoisonError::into_inner);
    let of = |on: u32| {
        if let Some(known) = sampled().get(&on) {
            return Ok(known.clone());
        }
        let (new, _) = component(sampler, on)?;
        sampled().insert(on, new.clone());
        Ok(new)
    };
    affordable.map(of).collect()
}

/// Samples the joint effect of the switches in `on`. Also returns the mean of both ends of its odd variables.
fn component(sampler: &Sampler<'_>, on: u32) -> Result<(Component, Vec<PerAxis>), NotConverged> {
    let mut component = sampler.component(on, &counts(sampler, on));
    let [values, mean] = sampler.values(&component)?;
    component.values = values;
    Ok((component, mean))
}

/// The number of nodes of each variable with the switches in `on`.
fn counts(sampler: &Sampler<'_>, on: u32) -> Vec<usize> {
    let variables = &sampler.variables;
    let active = |v: usize| on >> v & 1 == 1;
    let moving = (0..variables.len())
        .filter(|v| active(*v) && variables[*v].moves)
        .count();
    let mut counts: Vec<usize> = (0..variables.len())
        .map(|v| match (active(v), moving) {
            (false, 0) => variables[v].turning.base,
            (false, 1) => variables[v].turning.others,
            (true, 1) => variables[v].nodes,
            // Joint effects of several motions are small, so few nodes resolve them.
            (false, _) => variables[v].turning.others.min(LEAST_NODES),
            (true, _) => variables[v].nodes.min(JOINT_NODES),
        })
        .collect();
    loop {
        let rich = (0..counts.len()).filter(|v| is_rich(sampler, on, *v));
        let widest = rich.max_by_key(|v| counts[*v]);
        match widest {
            Some(v) if size(sampler, on, &counts) > MOST_NODES && counts[v] > LEAST_NODES => {
                counts[v] -= 2;
            }
            _ => return counts,
        }
    }
}

/// True if a variable gets nodes with the switches in `on`.
fn is_rich(sampler: &Sampler<'_>, on: u32, v: usize) -> bool {
    let variable = &sampler.variables[v];
    on >> v & 1 == 1 && variable.moves || matches!(variable.kind, Kind::Rotary(_))
}

/// Total number of nodes.
fn size(sampler: &Sampler<'_>, on: u32, counts: &[usize]) -> usize {
    let rich = (0..counts.len()).filter(|v| is_rich(sampler, on, *v));
    rich.map(|v| counts[v]).product()
}

/// The unions of two first-order sets, each with the largest joint effect at random places (mm, rad).
fn sizes(sampler: &Sampler<'_>) -> Result<Vec<(PerAxis, u32)>, NotConverged> {
    let first = first(sampler);
    let mut unions: Vec<u32> = Vec::new();
    for (k, a) in first.iter().enumerate() {
        let others = first[k + 1..].iter().map(|b| a | b);
        unions.extend(others.filter(|on| !first.contains(on)));
    }
    unions.sort_unstable();
    unions.dedup();
    let mut random = Pcg64Mcg::seed_from_u64(2);
    let places: Vec<VariableValues> = (0..PAIR_PLACES)
        .map(|number| {
            let mut place = random_place(&sampler.variables, &mut random);
            if number % 2 == 0 {
                to_corner(&sampler.variables, &mut place);
            }
            place
        })
        .collect();
    parallel::try_map(&unions, |on| {
        let mut size = PerAxis::default();
        for place in &places {
            let added = sampler.added(place, *on)?;
            for (s, d) in size.iter_mut().zip(added) {
                *s = s.max(d.abs());
            }
        }
        Ok::<_, NotConverged>((size, *on))
    })
}

/// The unions whose joint effects are significant, the strongest first. The weakest are left out as long as they are
/// insignificant together.
fn significant(sizes: &[(PerAxis, u32)], tolerance: &PerAxis) -> Vec<u32> {
    let in_tolerances = |(size, on): &(PerAxis, u32)| {
        let parts = size.iter().zip(tolerance).map(|(d, t)| d / t);
        (parts.fold(0.0, f64::max), *on)
    };
    let sizes = sizes.iter().map(in_tolerances).collect();
    let mut sizes: Vec<(f64, u32)> = by(sizes, |(size, _)| -size);
    let mut left_out = 0.0;
    let weak = sizes.iter().rev().take_while(|(size, _)| {
        left_out += size * size;
        2.0 * f64::sqrt(left_out) < PAIRS_SHOW
    });
    sizes.truncate(sizes.len() - weak.count());
    sizes.into_iter().map(|(_, on)| on).collect()
}

#[cfg(test)]
mod tests {
    use super::super::specimen::{errors, with_rotary};
    use super::super::variables::variables;
    use super::*;
    use trueaxis_model::kinematics::Kinematics;

    /// The kinds of switches in each first-order set, and the temperatures that have squares.
    fn sets(lines: &str) -> (Vec<Vec<Kind>>, Vec<Vec<Kind>>) {
        let machine = with_rotary(&[]);
        let errors = errors(&machine, lines);
        let kinematics = Kinematics::new(&machine, &errors);
        let variables = variables(&kinematics, 1e-6);
        let sampler = Sampler::new(&kinematics, variables.clone(), PerAxis::default());
        let kinds = |on: u32| -> Vec<Kind> {
            let active = variables.iter().enumerate();
            let active = active.filter(|(v, _)| on >> v & 1 == 1);
            active.map(|(_, v)| v.kind).collect()
        };
        let components = first_order(&sampler).unwrap();
        let squares = components.iter().filter(|c| c.even);
        let squares = squares.map(|c| kinds(c.on));
        (
            first(&sampler).into_iter().map(kinds).collect(),
            squares.collect(),
        )
    }

    #[test]
    fn a_motion_measured_both_ways_goes_with_its_direction() {
        let table = "[tabulated.EXX]\nat = [-200.0, 0.0, 200.0]\n";
        let one_way = format!("{table}value = [0.0, 1e-3, 0.0]\n");
        let both_ways =
            format!("{table}positive = [0.0, 1e-3, 0.0]\nnegative = [0.0, 2e-3, 1e-3]\n");
        let motion = Kind::Bending(0);
        assert_eq!(sets(&one_way).0, [vec![motion]]);
        let sign = Kind::Sign(0);
        let expected = [vec![motion], vec![sign], vec![motion, sign]];
        assert_eq!(sets(&both_ways).0, expected);
    }

    #[test]
    fn temperatures_have_squares() {
        let change = "per_kelvin = 1e-6, sensor = \"bed\", reference_celsius = 20.0";
        // A location does not vary along an axis; a straightness is a motion that warming changes.
        let (first, squares) = sets(&format!("[thermal]\nEC0X = {{ {change} }}\n"));
        assert_eq!(first, [vec![Kind::Kelvin(0)]]);
        assert_eq!(squares, first);
        let (first, squares) = sets(&format!("[thermal]\nEYX2 = {{ {change} }}\n"));
        let warm = vec![Kind::Bending(0), Kind::Kelvin(0)];
        assert_eq!(
            first,
            [vec![Kind::Bending(0)], vec![Kind::Kelvin(0)], warm.clone()]
        );
        assert_eq!(squares, [vec![Kind::Kelvin(0)], warm]);
    }
}

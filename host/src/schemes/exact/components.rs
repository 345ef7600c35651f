//! Which components a correction is split into, and how finely each is sampled.

use super::limits::{JOINT_NODES, LEAST_NODES, MOST_NODES, PAIR_PLACES, PAIR_SHOWS};
use super::sampling::{Component, Sampler};
use super::trials::random_place;
use super::variables::Kind;
use crate::kinematics::NotConverged;
use crate::machine::PerAxis;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

/// What is there with everything switched off, what each switch adds, and what a motion that was
/// measured in both directions adds with its axis' direction of travel.
pub fn first_order(sampler: &Sampler<'_>) -> Result<Vec<Component>, NotConverged> {
    let variables = 0..sampler.variables.len();
    let switches = variables.filter(|v| sampler.variables[*v].is_switch());
    let alone = switches.map(|v| 1 << v);
    std::iter::once(0)
        .chain(alone)
        .chain(directed(sampler))
        .map(|on| component(sampler, on))
        .collect()
}

/// The switches of every axis whose motions were measured in both directions: those of its motions
/// and of its direction.
fn directed(sampler: &Sampler<'_>) -> Vec<u32> {
    let errors = sampler.kinematics.errors;
    let of = |wanted: fn(&Kind) -> Option<usize>, axis: usize| {
        let mut variables = sampler.variables.iter();
        variables.position(|v| wanted(&v.kind) == Some(axis))
    };
    (0..errors.motions.len())
        .filter(|i| {
            let tables = errors.motions[*i].iter().filter_map(|m| m.table.as_ref());
            tables.into_iter().any(|t| t.negative.is_some())
        })
        .filter_map(|i| {
            let position = |kind: &Kind| match kind {
                Kind::Bending(i) | Kind::Rotary(i) => Some(*i),
                _ => None,
            };
            let direction = |kind: &Kind| match kind {
                Kind::Sign(i) => Some(*i),
                _ => None,
            };
            Some(1 << of(position, i)? | 1 << of(direction, i)?)
        })
        .collect()
}

/// What pairs of switches add, where it shows; the strongest first.
pub fn second_order(
    sampler: &Sampler<'_>,
    tolerance: &PerAxis,
) -> Result<Vec<Component>, NotConverged> {
    let pairs = pairs(sampler, tolerance)?;
    pairs.into_iter().map(|on| component(sampler, on)).collect()
}

/// Samples what the switches in `on` add together.
fn component(sampler: &Sampler<'_>, on: u32) -> Result<Component, NotConverged> {
    let variables = sampler.variables;
    let active = |v: usize| on >> v & 1 == 1;
    let moving = (0..variables.len())
        .filter(|v| active(*v) && variables[*v].moves)
        .count();
    let mut counts: Vec<usize> = (0..variables.len())
        .map(|v| match (active(v), moving) {
            (false, 0) => variables[v].turning.base,
            (false, 1) => variables[v].turning.others,
            (true, 1) => variables[v].nodes,
            // What several motions add together is small: few nodes see enough of it.
            (false, _) => variables[v].turning.others.min(LEAST_NODES),
            (true, _) => variables[v].nodes.min(JOINT_NODES),
        })
        .collect();
    let rich = |v: &usize| {
        active(*v) && variables[*v].moves || matches!(variables[*v].kind, Kind::Rotary(_))
    };
    loop {
        let size: usize = (0..counts.len()).filter(rich).map(|v| counts[v]).product();
        let widest = (0..counts.len()).filter(rich).max_by_key(|v| counts[*v]);
        match widest {
            Some(v) if size > MOST_NODES && counts[v] > LEAST_NODES => counts[v] -= 2,
            _ => break,
        }
    }
    let mut component = sampler.component(on, &counts);
    sampler.fill(&mut component)?;
    Ok(component)
}

/// The pairs of switches whose joint effect shows, the strongest first.
fn pairs(sampler: &Sampler<'_>, tolerance: &PerAxis) -> Result<Vec<u32>, NotConverged> {
    let variables = sampler.variables;
    let switches: Vec<usize> = (0..variables.len())
        .filter(|v| variables[*v].is_switch())
        .collect();
    let directed = directed(sampler);
    let mut random = Pcg64Mcg::seed_from_u64(2);
    let mut found = Vec::new();
    for (k, &a) in switches.iter().enumerate() {
        for &b in &switches[k + 1..] {
            if directed.contains(&(1 << a | 1 << b)) {
                continue;
            }
            let mut worst = 0.0_f64;
            for _ in 0..PAIR_PLACES {
                let place = random_place(variables, &mut random);
                let added = sampler.added(&place, 1 << a | 1 << b)?;
                for (d, t) in added.iter().zip(tolerance) {
                    worst = worst.max(d.abs() / t);
                }
            }
            if worst > PAIR_SHOWS {
                found.push((worst, 1 << a | 1 << b));
            }
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    Ok(found.into_iter().map(|(_, on)| on).collect())
}

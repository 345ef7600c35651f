//! The scheme `exact`: finds the factors itself.
//!
//! The correction is sampled from the exact kinematic correction on small grids, split into what
//! it is without the bending motions of linear axes, without backlash and at reference
//! temperature, and what each of these (and each pair, where it shows) adds. Along every variable
//! the functions it is made of are found: the constant, the coordinate, products of sine and
//! cosine, and what remains by singular value decomposition. Sums of functions of one variable
//! become one table. The tables' values are sampled from the exact correction, so that second
//! order comes in wherever the structure holds it.

mod along;
mod basis;
mod core;
mod cover;
mod draft;
mod generators;
mod sampling;
mod tables;
mod turning;
mod variables;

use crate::errors::{ErrorModel, Situation, Switches};
use crate::kinematics::{Kinematics, NotConverged};
use crate::machine::{Machine, PerAxis};
use crate::schemes::{self, Options, SchemeError};
use crate::target::Target;
use basis::{Basis, Choice};
pub use cover::Minimize;
use cover::{Cover, Function, Structure};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sampling::{Component, Sampler};
use std::collections::BTreeMap;
use tables::{Found, Sampled};
use variables::{Kind, MAX_VARIABLES, Place, Variable};

/// The share of the tolerance that the structure may take; interpolation and rounding have the rest.
const STRUCTURE_SHARE: f64 = 0.4;
/// Random places at which a structure is tried.
const TRIALS: usize = 160;
/// Joint effects of two motions below this (in units of the tolerance) are left out.
const PAIR_SHOWS: f64 = 0.15;
/// Nodes of a component beyond which variables get fewer, and the fewest.
const MOST_NODES: usize = 30_000;
const LEAST_NODES: usize = 7;
/// Nodes of each axis whose motions are on together with another's.
const JOINT_NODES: usize = 13;

/// Finds tables and terms that reproduce the kinematic correction within the tolerance.
///
/// Where the tolerance cannot be met, the best found is returned; `structure_error` tells, and
/// verification of the blob has the last word.
///
/// # Errors
/// [`SchemeError`].
pub fn compile(
    machine: &Machine,
    errors: &ErrorModel,
    minimize: Minimize,
    options: &Options,
) -> Result<schemes::Found, SchemeError> {
    let kinematics = Kinematics::new(machine, errors);
    let tolerance: PerAxis = std::array::from_fn(|i| match machine.axes.get(i) {
        Some(axis) if axis.letter.is_rotary() => options.tolerance * 1e-3,
        _ => options.tolerance,
    });
    let variables = variables::variables(&kinematics, relative(&kinematics, &tolerance)?);
    let sampler = Sampler {
        kinematics: &kinematics,
        variables: &variables,
        zero: options.zero(machine, errors)?,
    };
    let mut components = vec![component(&sampler, 0)?];
    for v in (0..variables.len()).filter(|v| variables[*v].is_switch()) {
        components.push(component(&sampler, 1 << v)?);
    }
    let trials = Trials::new(&sampler, TRIALS)?;
    let mut best = None;
    let mut joint = 0;
    // Start generously; where the trial shows that too much was left out, take in what motions
    // add in pairs, then leave out less.
    let mut share = 0.25;
    let mut left_out = 0.0;
    for _ in 0..6 {
        let attempt = attempt(
            &sampler,
            &components,
            &tolerance,
            (minimize, &options.target),
            share,
            left_out,
        )?;
        left_out = attempt.left_out;
        let error = trials.error(&attempt.found(&sampler, &components, &tolerance))?;
        let attempt_is_full = attempt.is_full;
        let better = best.as_ref().is_none_or(|(e, _)| error < 0.9 * e);
        if better {
            best = Some((error, attempt));
        }
        if error <= STRUCTURE_SHARE {
            break;
        }
        if components.iter().all(|c| c.on.count_ones() < 2) {
            for on in pairs(&sampler, &tolerance)? {
                components.push(component(&sampler, on)?);
                joint += 1;
            }
            if joint > 0 {
                // Numbers of functions change with the components: nothing of before can stay.
                best = None;
                continue;
            }
        }
        if !better || attempt_is_full {
            break;
        }
        share *= 0.5;
    }
    let (structure_error, attempt) = match best {
        Some(best) => best,
        None => (
            f64::INFINITY,
            attempt(
                &sampler,
                &components,
                &tolerance,
                (minimize, &options.target),
                share,
                left_out,
            )?,
        ),
    };
    let tables = attempt.structure.count();
    if tables > 255 {
        return Err(SchemeError::TooManyTables { tables });
    }
    let found = attempt.found(&sampler, &components, &tolerance);
    // Points finer than what the structure leaves would be wasted.
    let share = (0.9 - structure_error).max(0.5).max(0.3 * structure_error);
    let intervals = intervals(&found, options, share)?;
    let draft = draft::draft(machine, errors, &found, &intervals, options)?;
    Ok(schemes::Found {
        draft,
        structure_error: Some(structure_error),
        notes: match joint {
            0 => Vec::new(),
            n => vec![format!(
                "pairs of motions whose joint second order is taken in: {n}"
            )],
        },
    })
}

/// The part of a correction that does not count: a little of the tolerance, seen from the largest
/// correction.
fn relative(kinematics: &Kinematics<'_>, tolerance: &PerAxis) -> Result<f64, NotConverged> {
    let machine = kinematics.machine;
    let mut random = Pcg64Mcg::seed_from_u64(4);
    let mut largest = 1.0_f64;
    for _ in 0..TRIALS {
        let q: PerAxis = std::array::from_fn(|i| match machine.axes.get(i) {
            Some(axis) => {
                let [low, high] = axis.travel.map(|t| axis.to_kinematic(t));
                low + (high - low) * random.random::<f64>()
            }
            None => 0.0,
        });
        let correction = kinematics.correction(&q, &Situation::default(), &Switches::ALL)?;
        for (d, t) in correction.dq.iter().zip(tolerance) {
            largest = largest.max(d.abs() / t);
        }
    }
    Ok(0.02 / largest)
}

/// Bases and terms for one choice of what may be left out.
struct Attempt {
    bases: Vec<Basis>,
    structure: Structure,
    /// More terms or tables would be needed than the target holds.
    is_full: bool,
    /// What was left out, in units of the tolerance.
    left_out: f64,
}

impl Attempt {
    fn found<'a>(
        &'a self,
        sampler: &'a Sampler<'a>,
        components: &'a [Component],
        tolerance: &'a PerAxis,
    ) -> Found<'a> {
        Found {
            sampler,
            components,
            bases: &self.bases,
            tolerance,
            structure: &self.structure,
        }
    }
}

/// Finds bases and terms that leave out no more than `share` of the tolerance; `before` is what
/// an earlier attempt had to leave out.
fn attempt(
    sampler: &Sampler<'_>,
    components: &[Component],
    tolerance: &PerAxis,
    (minimize, target): (Minimize, &Target),
    share: f64,
    before: f64,
) -> Result<Attempt, NotConverged> {
    let choice = Choice {
        degree: if minimize == Minimize::Tables { 5 } else { 4 },
        leave: 0.1 * share,
    };
    let mut bases = Vec::new();
    for (v, variable) in sampler.variables.iter().enumerate() {
        bases.push(if variable.is_rich() {
            Basis::find(v, sampler, components, tolerance, choice)?
        } else {
            Basis::of_lever(variable)
        });
    }
    let entries = core::entries(sampler, components, &bases, tolerance, before)?;
    let cover = Cover::new(&entries, sampler.variables, &bases, minimize);
    let choose = |share: f64| {
        let structure = cover.choose(share, target.tables * 2 / 3);
        let fits = structure.terms.len() <= target.terms && structure.count() <= target.tables;
        (structure, fits)
    };
    let (mut structure, fits) = choose(share);
    let is_full = !fits;
    let mut left_out = share;
    if is_full {
        // What the target cannot hold is left out, the smallest first; verification tells. With
        // everything left out it fits for sure: halve the logarithm of the distance.
        let (mut too_little, mut enough) = (share, cover.share_of_nothing().max(share));
        structure = choose(enough).0;
        for _ in 0..8 {
            let between = (too_little * enough).sqrt();
            let (found, fits) = choose(between);
            if fits {
                (enough, structure) = (between, found);
            } else {
                too_little = between;
            }
        }
        left_out = enough;
    }
    Ok(Attempt {
        bases,
        structure,
        is_full,
        left_out,
    })
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
            (false, _) => variables[v].turning.others,
            (true, 1) => variables[v].nodes,
            // What several motions add together is small.
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
    let mut random = Pcg64Mcg::seed_from_u64(2);
    let mut found = Vec::new();
    for (k, &a) in switches.iter().enumerate() {
        for &b in &switches[k + 1..] {
            let mut worst = 0.0_f64;
            for _ in 0..24 {
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

/// A random place in the calibrated ranges, with a random direction of travel where it counts.
fn random_place(variables: &[Variable], random: &mut Pcg64Mcg) -> Place {
    let mut place = [0.0; MAX_VARIABLES];
    for (x, variable) in place.iter_mut().zip(variables) {
        let [low, high] = variable.calibrated;
        *x = match variable.kind {
            Kind::Sign(_) => {
                if random.random::<bool>() {
                    1.0
                } else {
                    -1.0
                }
            }
            _ => low + (high - low) * random.random::<f64>(),
        };
    }
    place
}

/// Random places with their exact corrections.
struct Trials {
    places: Vec<Place>,
    corrections: Vec<PerAxis>,
}

impl Trials {
    fn new(sampler: &Sampler<'_>, count: usize) -> Result<Self, NotConverged> {
        let mut random = Pcg64Mcg::seed_from_u64(1);
        let (mut places, mut corrections) = (Vec::new(), Vec::new());
        for _ in 0..count {
            let place = random_place(sampler.variables, &mut random);
            let exact = sampler.exact(&place, u32::MAX)?;
            if sampler.is_near_end(&place, &exact) {
                continue;
            }
            places.push(place);
            corrections.push(std::array::from_fn(|i| exact[i] - sampler.zero[i]));
        }
        Ok(Self {
            places,
            corrections,
        })
    }

    /// Largest difference of the structure to the exact correction, in units of the tolerance.
    fn error(&self, found: &Found<'_>) -> Result<f64, NotConverged> {
        let mut sampled: BTreeMap<usize, Sampled> = BTreeMap::new();
        for (v, (bent, straight)) in found.tables() {
            let functions: Vec<Function> = bent.into_iter().chain(straight).collect();
            let at: Vec<f64> = self.places.iter().map(|p| p[v]).collect();
            sampled.insert(v, found.sample(v, &functions, &at)?);
        }
        let mut worst = 0.0_f64;
        for (row, exact) in self.corrections.iter().enumerate() {
            let values = tables::values_at(&sampled, row);
            let outputs = found.sampler.kinematics.machine.axes.len();
            let sums = found.structure.evaluate(&values, outputs);
            for ((s, e), t) in sums.iter().zip(exact).zip(found.tolerance) {
                worst = worst.max((s - e / t).abs());
            }
        }
        Ok(worst)
    }
}

/// Intervals of the bent tables of each variable, so that all of them together stay within `share`.
fn intervals(
    found: &Found<'_>,
    options: &Options,
    share: f64,
) -> Result<BTreeMap<usize, usize>, NotConverged> {
    let tables = found.tables();
    let bent: Vec<(usize, Vec<Function>)> = tables
        .into_iter()
        .map(|(v, (bent, _))| (v, bent))
        .filter(|(v, bent)| !bent.is_empty() && found.sampler.variables[*v].is_rich())
        .collect();
    let mut intervals = BTreeMap::new();
    let each = share / bent.len().max(1) as f64;
    for (v, functions) in &bent {
        if let Some(points) = options.points {
            intervals.insert(*v, points.max(2) - 1);
            continue;
        }
        let mut count = found.aligned(*v, 48);
        for _ in 0..4 {
            let error = found.interpolation_error(*v, functions, count)?;
            if error <= each && error > 0.3 * each {
                break;
            }
            // The error of linear interpolation falls with the square of the interval.
            let wanted = (count as f64 * (error / (0.8 * each)).sqrt()).ceil();
            let next = found.aligned(*v, (wanted as usize).clamp(8, 4096));
            if next == count {
                break;
            }
            count = next;
        }
        intervals.insert(*v, count);
    }
    Ok(intervals)
}

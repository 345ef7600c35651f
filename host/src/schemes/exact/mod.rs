//! The scheme `exact`: finds the factors itself.
//!
//! The correction is sampled from the exact kinematic correction on small grids, split into what
//! it is without the bending motions of linear axes, without backlash and at reference
//! temperature, and what each of these (and each pair, where it shows) adds. Along every variable
//! the functions it is made of are found: the constant, the coordinate, products of sine and
//! cosine, and what remains by singular value decomposition. Sums of functions of one variable
//! become one table. The tables' values are sampled from the exact correction, so that second
//! order comes in wherever the structure holds it.

mod basis;
mod core;
mod cover;
mod draft;
mod sampling;
mod tables;
mod variables;

use crate::errors::ErrorModel;
use crate::kinematics::{Kinematics, NotConverged};
use crate::machine::{Machine, PerAxis};
use basis::{Basis, Choice};
pub use cover::Minimize;
use cover::{Function, Structure};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sampling::{Component, Sampler};
use std::collections::BTreeMap;
use tables::{Found, Sampled};
use trueaxis::{Draft, SampleFormat};
use variables::{MAX_VARIABLES, Place, Variable};

/// What to make of the errors.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// How far table corrections may be from the kinematic correction: mm for linear axes, the
    /// same number in milliradians for rotary ones (0.05 µm and 0.05 µrad: 5e-5).
    pub tolerance: f64,
    /// What is to be least.
    pub minimize: Minimize,
    /// Points of every table that is not a straight line; found from the tolerance if not given.
    pub points: Option<usize>,
    /// How samples are stored.
    pub format: SampleFormat,
    /// Position (mm, deg, one per axis) whose correction is subtracted everywhere.
    pub zero_at: Option<Vec<f64>>,
    /// Largest numbers of tables and terms the target holds.
    pub capacity: (usize, usize),
}

impl Default for Options {
    fn default() -> Self {
        Self {
            tolerance: 5e-5,
            minimize: Minimize::Cost,
            points: None,
            format: SampleFormat::F32,
            zero_at: None,
            capacity: (96, 256),
        }
    }
}

/// What was found.
#[derive(Clone, Debug)]
pub struct Exact {
    /// The compensation, ready to be encoded.
    pub draft: Draft,
    /// Largest difference to the kinematic correction at random places before interpolation, in
    /// units of the tolerance.
    pub structure_error: f64,
    /// Pairs of motions whose joint second order was needed.
    pub pairs: usize,
}

/// Why there is no compensation.
#[derive(Clone, Debug, thiserror::Error)]
pub enum ExactError {
    /// The kinematic correction itself fails somewhere.
    #[error(transparent)]
    NotConverged(#[from] NotConverged),
    /// More tables than a blob can number.
    #[error("{tables} tables are needed, a blob holds at most 255: raise --tolerance, or use --minimize cost")]
    TooManyTables {
        /// How many.
        tables: usize,
    },
    /// The zero position has another number of values than the machine has axes.
    #[error("the zero position has {given} values, the machine has {axes} axes")]
    ZeroPosition {
        /// Values given.
        given: usize,
        /// Axes.
        axes: usize,
    },
}

/// The share of the tolerance that the structure may take; interpolation and rounding have the rest.
const STRUCTURE_SHARE: f64 = 0.4;
/// Random places at which a structure is tried.
const TRIALS: usize = 160;
/// Nodes of a component beyond which rotary variables get fewer.
const MOST_NODES: usize = 30_000;

/// Finds tables and terms that reproduce the kinematic correction within the tolerance.
///
/// Where the tolerance cannot be met, the best found is returned; `structure_error` tells, and
/// verification of the blob has the last word.
///
/// # Errors
/// [`ExactError`].
pub fn compile(machine: &Machine, errors: &ErrorModel, options: &Options) -> Result<Exact, ExactError> {
    let kinematics = Kinematics::new(machine, errors);
    let variables = variables::variables(machine, errors);
    let tolerance: PerAxis = std::array::from_fn(|i| match machine.axes.get(i) {
        Some(axis) if axis.letter.is_rotary() => options.tolerance * 1e-3,
        _ => options.tolerance,
    });
    let mut sampler = Sampler { kinematics: &kinematics, variables: &variables, zero: PerAxis::default() };
    if let Some(zero) = &options.zero_at {
        if zero.len() != machine.axes.len() {
            return Err(ExactError::ZeroPosition { given: zero.len(), axes: machine.axes.len() });
        }
        let q = machine.to_kinematic(zero);
        let all = crate::errors::Switches::ALL;
        sampler.zero = kinematics.correction(&q, &crate::errors::Situation::default(), &all)?.dq;
    }
    let (components, pairs) = components(&sampler, &tolerance)?;
    let trials = Trials::new(&sampler, TRIALS)?;
    let mut best: Option<(f64, Vec<Basis>, Structure)> = None;
    // Start generously; where the trial shows that too much was left out, leave out less.
    for attempt in 0..6 {
        let share = 0.25 * 0.5_f64.powi(attempt);
        let choice = Choice {
            degree: if options.minimize == Minimize::Tables { 5 } else { 4 },
            leave: 0.1 * share,
        };
        let mut bases = Vec::new();
        for (v, variable) in variables.iter().enumerate() {
            bases.push(if variable.is_rich() {
                Basis::find(v, &sampler, &components, &tolerance, choice)?
            } else {
                Basis::affine()
            });
        }
        let entries = core::entries(&sampler, &components, &bases, &tolerance)?;
        let matters = core::significant(&entries, machine.axes.len(), share);
        let structure = Structure::cover(&entries, &matters, &variables, &bases, options.minimize, options.capacity.0 * 2 / 3);
        let found = Found {
            sampler: &sampler,
            components: &components,
            bases: &bases,
            tolerance: &tolerance,
            structure: &structure,
        };
        let error = trials.error(&found)?;
        let better = best.as_ref().is_none_or(|(e, _, _)| error < 0.9 * e);
        if better {
            best = Some((error, bases, structure));
        }
        if error <= STRUCTURE_SHARE || !better {
            break;
        }
    }
    let Some((structure_error, bases, structure)) = best else {
        return Err(ExactError::TooManyTables { tables: 0 });
    };
    let tables = structure.tables();
    let count = tables.iter().map(|(_, f)| if *f == Function::Sign { 2 } else { 1 }).sum();
    if count > 255 {
        return Err(ExactError::TooManyTables { tables: count });
    }
    let found = Found {
        sampler: &sampler,
        components: &components,
        bases: &bases,
        tolerance: &tolerance,
        structure: &structure,
    };
    let intervals = intervals(&found, options, 0.9 - structure_error.min(STRUCTURE_SHARE))?;
    let draft = draft::draft(machine, errors, &found, &intervals, options)?;
    Ok(Exact { draft, structure_error, pairs })
}

/// The components that matter: the base, each switch, and each pair of switches that shows.
fn components(sampler: &Sampler<'_>, tolerance: &PerAxis) -> Result<(Vec<Component>, usize), NotConverged> {
    let variables = sampler.variables;
    let switches: Vec<usize> = (0..variables.len()).filter(|v| variables[*v].is_switch()).collect();
    let mut components = Vec::new();
    let mut add = |on: u32, few: bool| -> Result<(), NotConverged> {
        let wanted = |v: usize| if few { variables[v].nodes.min(7) } else { variables[v].nodes };
        let mut counts: Vec<usize> = (0..variables.len()).map(wanted).collect();
        let rich = |v: &usize| variables[*v].is_rich() && (!variables[*v].is_switch() || on >> v & 1 == 1);
        loop {
            let size: usize = (0..counts.len()).filter(rich).map(|v| counts[v]).product();
            let widest = (0..counts.len())
                .filter(|v| rich(v) && !variables[*v].is_switch())
                .max_by_key(|v| counts[*v]);
            match widest {
                Some(v) if size > MOST_NODES && counts[v] > 7 => counts[v] -= 2,
                _ => break,
            }
        }
        let mut component = sampler.component(on, |v| counts[v]);
        sampler.fill(&mut component)?;
        components.push(component);
        Ok(())
    };
    add(0, false)?;
    for &v in &switches {
        add(1 << v, false)?;
    }
    let mut pairs = 0;
    let mut random = Pcg64Mcg::seed_from_u64(2);
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
            if worst > 0.05 {
                add(1 << a | 1 << b, true)?;
                pairs += 1;
            }
        }
    }
    Ok((components, pairs))
}

/// A random place over the whole ranges, with a random direction of travel where it counts.
fn random_place(variables: &[Variable], random: &mut Pcg64Mcg) -> Place {
    let mut place = [0.0; MAX_VARIABLES];
    for (x, variable) in place.iter_mut().zip(variables) {
        let [low, high] = variable.range;
        *x = match variable.kind {
            variables::Kind::Sign(_) => if random.random::<bool>() { 1.0 } else { -1.0 },
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
        let places: Vec<Place> = (0..count).map(|_| random_place(sampler.variables, &mut random)).collect();
        let mut corrections = Vec::new();
        for place in &places {
            let all = sampler.exact(place, u32::MAX)?;
            corrections.push(std::array::from_fn(|i| all[i] - sampler.zero[i]));
        }
        Ok(Self { places, corrections })
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
fn intervals(found: &Found<'_>, options: &Options, share: f64) -> Result<BTreeMap<usize, usize>, NotConverged> {
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

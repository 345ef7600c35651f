//! What the mean, the 95 % and the largest error over many positions do not exceed, each with its own probability.
//!
//! A mean of [coverage intervals](super::band) is none of these: parameters are off by the same amounts at all positions of a machine,
//! so errors do not average out over them. Machines are drawn with the covariance of the parameters; each figure is what
//! it does not exceed on 95 % of them.

use super::{Changes, PROBABILITY};
use crate::errors::{Covariance, ErrorModel, Situation};
use crate::kinematics::Kinematics;
use crate::machine::{Machine, PerAxis};
use crate::numbers::ascending;
use crate::numbers::normal;
use crate::parallel;
use crate::validate::{Quality, Statistics};
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

/// Number of machines. What 95 % of them do not exceed is then what 94 to 96 % do not (one standard deviation).
const MACHINES: usize = 500;
/// What the mean, 95 % and the largest of an error add with a random misfit of standard deviation 1 in each of three
/// coordinates. The mean of a length is at most its root mean square, √3, whatever the misfit looks like. 95 % of
/// lengths do not exceed 2.80; the largest of 20 independent ones does not exceed 3.78 with 95 % (χ with three degrees of
/// freedom).
pub const MISFIT_MEAN: f64 = 1.7320508075688772;
/// See [`MISFIT_MEAN`].
pub const MISFIT_P95: f64 = 2.80;
/// See [`MISFIT_MEAN`].
const MISFIT_LARGEST: f64 = 3.78;
/// Like [`MISFIT_MEAN`], of a direction, which has two coordinates: √2, and two degrees of freedom.
pub const TURN_MEAN: f64 = std::f64::consts::SQRT_2;
/// See [`TURN_MEAN`].
pub const TURN_P95: f64 = 2.45;
/// See [`TURN_MEAN`].
const TURN_LARGEST: f64 = 3.45;

/// Bounds of the error that uncertain parameters, tabulated motions and the misfit leave at these positions. Each figure
/// is what this mean (root mean square, 95 %, maximum) does not exceed with a probability of 95 %.
#[must_use]
pub fn bounds(
    machine: &Machine,
    errors: &ErrorModel,
    covariance: &Covariance,
    positions: &[(PerAxis, Situation)],
    seed: u64,
) -> Quality {
    let kinematics = Kinematics::new(machine, errors);
    let root = covariance.root();
    // Independent unknowns: those of the covariance, then the values of tables.
    let mut starts = Vec::new();
    let mut unknowns = root.ncols();
    for (key, values) in &errors.table_uncertainty {
        starts.push((*key, unknowns));
        unknowns += 2 * values.len();
    }
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let machine = |_| (0..unknowns).map(|_| normal(&mut random)).collect();
    let drawn: Vec<Vec<f64>> = (0..MACHINES).map(machine).collect();
    let lengths: Vec<[Vec<f64>; 2]> = parallel::map(positions, |(q, situation)| {
        let changes = Changes::new(&kinematics, q, situation);
        let of_parameters = changes.by(&covariance.parameters);
        let of_tables = changes.columns(starts.iter().map(|((axis, component), _)| {
            [&changes.at_tip, &changes.at_further]
                .map(|s| s.by_intra[*axis].column(*component).into_owned())
        }));
        [0, 1].map(|k| {
            let by = &of_parameters[k] * &root;
            let by: Vec<Vector3<f64>> = by.column_iter().map(|c| c.into_owned()).collect();
            let of_machine = |unknowns: &[f64]| {
                let each = by.iter().zip(unknowns);
                each.fold(Vector3::zeros(), |sum, (by, unknown)| sum + by * *unknown)
            };
            let mut all: Vec<Vector3<f64>> = drawn.iter().map(|z| of_machine(z)).collect();
            for (t, ((axis, component), start)) in starts.iter().enumerate() {
                let weights = weights(errors, *axis, *component, q, situation);
                for (sum, unknowns) in all.iter_mut().zip(&drawn) {
                    let value = weights.iter().map(|(node, w)| w * unknowns[start + node]);
                    *sum += of_tables[k].column(t) * value.sum::<f64>();
                }
            }
            all.iter().map(|error| error.norm()).collect()
        })
    });
    let of = |k: usize, unit: f64| {
        let machine = |m: usize| Statistics::of(lengths.iter().map(move |both| both[k][m] * unit));
        not_exceeded(&(0..MACHINES).map(machine).collect::<Vec<_>>())
    };
    let [um, urad] = [errors.misfit, errors.misfit_of_direction].map(Option::unwrap_or_default);
    Quality {
        translation_um: beyond(
            of(0, 1e3),
            um * 1e3,
            [MISFIT_MEAN, MISFIT_P95, MISFIT_LARGEST],
        ),
        direction_urad: beyond(of(1, 1e6), urad * 1e6, [TURN_MEAN, TURN_P95, TURN_LARGEST]),
    }
}

/// What each figure does not exceed on 95 % of the machines.
fn not_exceeded(machines: &[Statistics]) -> Statistics {
    let bound = |of: fn(&Statistics) -> f64| {
        let mut all: Vec<f64> = machines.iter().map(of).collect();
        ascending(&mut all);
        all[(PROBABILITY * all.len() as f64) as usize]
    };
    Statistics {
        mean: bound(|s| s.mean),
        rms: bound(|s| s.rms),
        p95: bound(|s| s.p95),
        max: bound(|s| s.max),
    }
}

/// Figures with a misfit on top, given how many times the misfit its mean, 95 % and largest are.
fn beyond(of: Statistics, misfit: f64, [mean, p95, largest]: [f64; 3]) -> Statistics {
    Statistics {
        mean: of.mean + mean * misfit,
        rms: of.rms + mean * misfit,
        p95: of.p95 + p95 * misfit,
        max: of.max + largest * misfit,
    }
}

/// The values of a tabulated motion between which it is interpolated, with their weights times their standard
/// uncertainties; those of the negative direction follow those of the positive one.
fn weights(
    errors: &ErrorModel,
    axis: usize,
    component: usize,
    q: &PerAxis,
    situation: &Situation,
) -> Vec<(usize, f64)> {
    let table = errors.motions[axis][component].table.as_ref();
    let known = errors.table_uncertainty.get(&(axis, component));
    let Some((table, known)) = table.zip(known) else {
        return Vec::new();
    };
    let q = errors.held(axis, q[axis], None);
    let above = table.at.partition_point(|at| *at <= q);
    let nodes = match (above.checked_sub(1), known.get(above)) {
        (None, _) => vec![(0, 1.0)],
        (Some(last), None) => vec![(last, 1.0)],
        (Some(below), Some(_)) => {
            let [a, b] = [below, above].map(|k| table.at[k]);
            let t = (q - a) / (b - a);
            vec![(below, 1.0 - t), (above, t)]
        }
    };
    let sign = situation.sign[axis];
    let directions = match table.negative {
        None => vec![(0, 1.0)],
        Some(_) => vec![(0, 0.5 * (1.0 + sign)), (known.len(), 0.5 * (1.0 - sign))],
    };
    let all = directions.iter().flat_map(|(start, part)| {
        let nodes = nodes.iter();
        nodes.map(move |(node, weight)| (start + node, part * weight * known[*node]))
    });
    all.collect()
}

//! Finds parameters that change nothing: they move everything together, or turn the tool about itself.

use super::bench::{Bench, BenchState};
use super::instrument::REACH;
use super::single_entry::{Nature, SingleEntry};
use crate::errors::{ErrorModel, Parameter, ParameterKind};
use crate::kinematics::Htm;
use crate::machine::{Machine, PerAxis};
use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Changes of tip and direction below this fraction of the parameter count as none.
const NOTHING: f64 = 1e-4;
/// Size of a parameter (mm, rad) for this test: small enough that second-order effects stay below [`NOTHING`] of it
/// at levers of metres, and far above rounding.
const SMALL: [f64; 2] = [1e-4, 1e-6];
/// Number of positions compared.
const POSITIONS: usize = 40;

/// Positions (mm, rad) over the whole travels, within the known range of the motion; always the same ones.
#[must_use]
pub fn positions(machine: &Machine, alone: &SingleEntry<'_>) -> Vec<PerAxis> {
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let index = alone.index();
    (0..POSITIONS)
        .map(|_| {
            let mut q = PerAxis::default();
            for (i, axis) in machine.axes.iter().enumerate() {
                let [low, high] = match i == index {
                    true => alone.range,
                    false => axis.travel.map(|t| axis.to_kinematic(t)),
                };
                q[i] = low + (high - low) * random.random::<f64>();
            }
            q
        })
        .collect()
}

/// True if neither tip nor tool direction change anywhere, relative to a realigned workpiece.
#[must_use]
pub fn changes_nothing(alone: &SingleEntry<'_>) -> bool {
    let angular = alone.parameter.is_angular();
    let size = alone.size();
    if size == 0.0 {
        return true;
    }
    let small = SMALL[usize::from(angular)];
    let (errors, kelvin) = alone.model(small / size);
    let machine = alone.machine;
    let bench = Bench::new(machine, &errors, kelvin);
    let sign = |k: usize| match (alone.nature(), k % 2) {
        (Nature::Reversal, 0) => [1.0; 6],
        (Nature::Reversal, _) => [-1.0; 6],
        _ => [0.0; 6],
    };
    let poses: Vec<(Htm, Htm)> = positions(machine, alone)
        .iter()
        .enumerate()
        .map(|(k, q)| {
            let state = BenchState {
                q: *q,
                sign: sign(k),
            };
            (bench.nominal(q), bench.actual(&state))
        })
        .collect();
    let together = together(&poses);
    let left = poses.iter().map(|(nominal, actual)| {
        let moved = together * *nominal;
        let tip = (actual.t - moved.t).norm();
        let direction = |pose: &Htm| pose.r.column(machine.tool_axis).into_owned();
        tip.max((direction(actual) - direction(&moved)).norm() * REACH)
    });
    let scale = if angular { small * REACH } else { small };
    left.fold(0.0, f64::max) < NOTHING * scale
}

/// The motion of the workpiece that best maps the nominal tips to the actual ones (Kabsch).
fn together(poses: &[(Htm, Htm)]) -> Htm {
    let count = poses.len() as f64;
    let mean =
        |of: fn(&(Htm, Htm)) -> Vector3<f64>| poses.iter().map(of).sum::<Vector3<f64>>() / count;
    let (nominal, actual) = (mean(|p| p.0.t), mean(|p| p.1.t));
    let covariance: Matrix3<f64> = (poses.iter())
        .map(|(n, a)| (a.t - actual) * (n.t - nominal).transpose())
        .sum();
    let svd = covariance.svd(true, true);
    let r = match (svd.u, svd.v_t) {
        (Some(u), Some(v_t)) => {
            let mut sign = Matrix3::identity();
            sign[(2, 2)] = (u * v_t).determinant().signum();
            u * sign * v_t
        }
        _ => Matrix3::identity(),
    };
    Htm {
        r,
        t: actual - r * nominal,
    }
}

/// For an inclination that changes nothing: the pair of axes (by index) whose squareness may have been meant, and
/// the corresponding parameters.
#[must_use]
pub fn meant(alone: &SingleEntry<'_>) -> Option<([usize; 2], Vec<Parameter>)> {
    let (machine, index) = (alone.machine, alone.index());
    let axis = machine.axes.get(index)?;
    if !alone.parameter.is_angular()
        || alone.nature() != Nature::Constant
        || axis.letter.is_rotary()
    {
        return None;
    }
    let locations = machine.axes.iter().filter(|a| !a.letter.is_rotary());
    let locations = locations.flat_map(|axis| {
        (3..6).map(|component| Parameter {
            component,
            axis: axis.letter.char(),
            kind: ParameterKind::Inter,
        })
    });
    let candidates: Vec<(Parameter, SmallTilt<'_>)> = locations
        .map(|parameter| (parameter, SmallTilt::new(alone, parameter)))
        .collect();
    let this = SmallTilt::new(alone, alone.parameter);
    let linear = (0..machine.axes.len()).filter(|i| !machine.axes[*i].letter.is_rotary());
    let pairs = linear
        .clone()
        .flat_map(|a| linear.clone().filter(move |b| a < *b).map(move |b| [a, b]));
    // Pairs with this axis first.
    let mut pairs: Vec<[usize; 2]> = pairs.collect();
    pairs.sort_by_key(|pair| !pair.contains(&index));
    pairs.into_iter().find_map(|pair| {
        if !this.turns(pair) {
            return None;
        }
        let same = (candidates.iter())
            .filter(|(_, small)| small.turns(pair) && small.squareness(pair) > 0.5);
        let parameters: Vec<Parameter> = same.map(|(parameter, _)| *parameter).collect();
        (!parameters.is_empty()).then_some((pair, parameters))
    })
}

/// A small inclination without other errors.
struct SmallTilt<'a> {
    machine: &'a Machine,
    errors: ErrorModel,
}

impl<'a> SmallTilt<'a> {
    fn new(alone: &SingleEntry<'a>, parameter: Parameter) -> Self {
        let (errors, _) = alone.instead(parameter, SMALL[1]).model(1.0);
        Self {
            machine: alone.machine,
            errors,
        }
    }

    fn bench(&self) -> Bench<'_> {
        Bench::new(self.machine, &self.errors, Default::default())
    }

    /// True if it rotates the tool relative to the workpiece in the plane of two axes.
    fn turns(&self, [a, b]: [usize; 2]) -> bool {
        let bench = self.bench();
        let home = BenchState::at(bench.home());
        let r = bench.actual(&home).r * bench.nominal(&home.q).r.transpose();
        let turn = Htm {
            r,
            t: Vector3::zeros(),
        };
        let normal = bench.way(&home.q, a).cross(&bench.way(&home.q, b));
        normal.dot(&turn.twist().r).abs() > 0.9 * SMALL[1]
    }

    /// Reading of a square per unit of it.
    fn squareness(&self, [a, b]: [usize; 2]) -> f64 {
        let bench = self.bench();
        let span = bench.span(b, bench.travel(b));
        bench.square(a, b, span).size() / (SMALL[1] * REACH)
    }
}

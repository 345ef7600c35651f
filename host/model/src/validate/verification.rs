//! Compares tables with the reference correction at many positions.

use super::{Command, Runtime, holds, is_near_point};
use crate::errors::{ErrorModel, Switches};
use crate::kinematics::{NotConverged, Policy, Twist};
use crate::machine::{MAX_AXES, Machine, PerAxis};
use crate::parallel;
use crate::policy::tolerance_urad;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Fraction of the values that do not exceed [`Statistics::p95`].
const MOST: f64 = 0.95;

/// Mean, root mean square, 95 % quantile and maximum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Statistics {
    /// Arithmetic mean.
    pub mean: f64,
    /// Root mean square.
    pub rms: f64,
    /// The smallest value that at least 95 % of the values do not exceed.
    pub p95: f64,
    /// Largest value.
    pub max: f64,
}

impl Statistics {
    /// Statistics of some values; 0 if there are none.
    pub fn of(values: impl Iterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.collect();
        let n = values.len() as f64;
        let (mut sum, mut squares, mut max) = (0.0, 0.0, 0.0_f64);
        for v in &values {
            sum += v;
            squares += v * v;
            max = max.max(*v);
        }
        if values.is_empty() {
            return Self::default();
        }
        let place = (MOST * n).ceil() as usize - 1;
        let (_, p95, _) = values.select_nth_unstable_by(place, f64::total_cmp);
        Self {
            mean: sum / n,
            rms: (squares / n).sqrt(),
            p95: *p95,
            max,
        }
    }
}

/// Volumetric error over many positions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Quality {
    /// Length of the translational volumetric error (µm).
    pub translation_um: Statistics,
    /// Tool-direction error: rotation across the tool axis (µrad).
    pub direction_urad: Statistics,
}

/// Deviation of the tables of one axis from its kinematic correction, and the size of that correction.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AxisDeviation {
    /// Letter of the axis.
    pub axis: char,
    /// `µm` or `µrad`.
    pub unit: &'static str,
    /// Largest deviation of the tables from the kinematic correction (µm, µrad).
    pub deviation: f64,
    /// Largest kinematic correction, minus that of the zero position (µm, µrad).
    pub kinematic: f64,
}

/// Results for one region.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verification {
    /// Number of positions.
    pub positions: usize,
    /// Without correction, except for that of the zero position.
    pub before: Quality,
    /// With the tables.
    pub after: Quality,
    /// With the exact kinematic correction, the best that any correction can achieve.
    pub kinematic: Quality,
    /// Largest difference between table corrections and kinematic corrections in what matters (µm): at the tip under
    /// the policy *direction*, of a linear axis under the others.
    pub difference_um: f64,
    /// Like `difference_um`, in rotation (µrad): of the tool direction, or of a rotary axis.
    pub difference_urad: f64,
    /// Number of positions at which the tool direction is worse after than before by more than 1 µrad.
    pub direction_worse: usize,
    /// What the rotary axes correct.
    #[serde(skip)]
    pub policy: Policy,
    /// The deviation of each axis, with its largest kinematic correction.
    pub deviations: Vec<AxisDeviation>,
    /// Position of the worst difference (mm, deg): the first of all positions where it is equally large.
    pub worst_at: Vec<f64>,
    /// Largest correction of each axis (mm, deg).
    pub largest: Vec<f64>,
}

impl Verification {
    /// True if the tables differ from the kinematic correction by at most `um` µm, and in rotation by the equivalent
    /// under the policy ([`tolerance_urad`]).
    #[must_use]
    pub fn meets(&self, um: f64) -> bool {
        self.difference_um <= um && self.difference_urad <= tolerance_urad(self.policy, um)
    }
}

/// The error of the tool direction (rad): rotation across the tool axis of a twist in the tool frame.
#[must_use]
pub fn direction(machine: &Machine, error: &Twist) -> f64 {
    let mut across = error.r;
    across[machine.tool_axis] = 0.0;
    across.norm()
}

/// Positions whose difference is at least this fraction of the largest are equally bad. If a table depends on only
/// one axis, there are many, and the last bit of a mathematical library must not decide which one is reported.
const AS_BAD: f64 = 0.99;

/// A direction that is worse by less than this (rad) counts as unchanged.
const WORSE: f64 = 1e-6;

/// One position: before, after, and with the kinematic correction.
struct Sample {
    /// Length of the translational error (mm).
    translation: [f64; 3],
    /// Rotation across the tool axis (rad).
    direction: [f64; 3],
    /// Deviation of the tables from the kinematic correction, absolute (mm, rad).
    deviation: PerAxis,
    /// Like `deviation`, at the tip (mm), and in tool direction (rad).
    apart: [f64; 2],
    /// The kinematic correction minus that of the zero position, absolute (mm, rad).
    kinematic: PerAxis,
    /// Corrections of the tables (mm, deg).
    corrections: [f32; MAX_AXES],
    /// True if an error motion holds its end value.
    holds: bool,
    /// True if it is within one correction of a measured point.
    near: bool,
}

/// Measurements at given commands, to be evaluated as a whole or in parts.
pub struct Measured<'a> {
    machine: &'a Machine,
    policy: Policy,
    commands: Vec<Command>,
    samples: Vec<Sample>,
}

impl<'a> Measured<'a> {
    /// Compares tables and reference corrections at given commands.
    ///
    /// `zero` (mm, rad) was subtracted from the tables. Everything is compared on a machine whose datum is corrected
    /// by that amount, before and after. `progress` is called once per position.
    ///
    /// # Errors
    /// [`NotConverged`] if the kinematic correction fails.
    pub fn new(
        machine: &'a Machine,
        errors: &ErrorModel,
        runtime: &Runtime<'_>,
        zero: &PerAxis,
        commands: Vec<Command>,
        progress: impl Fn() + Sync,
    ) -> Result<Self, NotConverged> {
        let kinematics = runtime.kinematics(machine, errors);
        let across = |r: Vector3<f64>| {
            let t = Vector3::zeros();
            direction(machine, &Twist { t, r })
        };
        let samples = parallel::try_map(&commands, |command| {
            let (q, situation) = command.kinematic(machine);
            let exact = kinematics.correction(&q, &situation, &Switches::ALL)?.dq;
            let corrections = runtime.evaluate(command);
            let mut dq = machine.to_kinematic(&corrections.map(f64::from));
            for (d, z) in dq.iter_mut().zip(zero) {
                *d += z;
            }
            let errors_left =
                [*zero, dq, exact].map(|dq| kinematics.volumetric_error(&q, &dq, &situation));
            progress();
            Ok::<_, NotConverged>(Sample {
                translation: errors_left.each_ref().map(|error| error.t.norm()),
                direction: errors_left
                    .each_ref()
                    .map(|error| direction(machine, error)),
                apart: [
                    (errors_left[1].t - errors_left[2].t).norm(),
                    across(errors_left[1].r - errors_left[2].r),
                ],
                deviation: std::array::from_fn(|i| (dq[i] - exact[i]).abs()),
                kinematic: std::array::from_fn(|i| (exact[i] - zero[i]).abs()),
                corrections,
                holds: holds(machine, errors, &q, &exact),
                near: is_near_point(machine, errors, &q, &exact),
            })
        })?;
        Ok(Self {
            machine,
            policy: kinematics.policy,
            commands,
            samples,
        })
    }

    /// Results for all positions together.
    #[must_use]
    pub fn everywhere(&self) -> Verification {
        self.over(|_| true)
    }

    /// Results where no error motion holds its end value, farther than one correction from measured points; `None`
    /// if there are no such positions.
    #[must_use]
    pub fn inside(&self) -> Option<Verification> {
        Some(self.over(|sample| !sample.holds && !sample.near)).filter(|found| found.positions > 0)
    }

    /// Results within one correction of a measured point, inside the ranges of the error motions; `None` if there
    /// are no such positions.
    #[must_use]
    pub fn near_points(&self) -> Option<Verification> {
        Some(self.over(|sample| !sample.holds && sample.near)).filter(|found| found.positions > 0)
    }

    /// Results where an error motion holds its end value; `None` if there are no such positions.
    #[must_use]
    pub fn outside(&self) -> Option<Verification> {
        Some(self.over(|sample| sample.holds)).filter(|found| found.positions > 0)
    }

    fn over(&self, counts: impl Fn(&Sample) -> bool) -> Verification {
        let places = || {
            let all = self.samples.iter().zip(&self.commands);
            all.filter(|(sample, _)| counts(sample))
        };
        let samples = || places().map(|(sample, _)| sample);
        let most = |of: &dyn Fn(&Sample) -> f64| samples().map(of).fold(0.0, f64::max);
        let quality = |which: usize| Quality {
            translation_um: Statistics::of(samples().map(|s| s.translation[which] * 1e3)),
            direction_urad: Statistics::of(samples().map(|s| s.direction[which] * 1e6)),
        };
        let machine = self.machine;
        let axes = 0..machine.axes.len();
        let is_rotary = |i: usize| machine.axes[i].letter.is_rotary();
        let scale = |i: usize| if is_rotary(i) { 1e6 } else { 1e3 };
        let deviation = |i: usize| AxisDeviation {
            axis: machine.axes[i].letter.char(),
            unit: if is_rotary(i) { "µrad" } else { "µm" },
            deviation: most(&|s| s.deviation[i]) * scale(i),
            kinematic: most(&|s| s.kinematic[i]) * scale(i),
        };
        let deviations: Vec<AxisDeviation> = axes.clone().map(deviation).collect();
        let worst = |rotary: bool| {
            let same = axes.clone().zip(&deviations);
            same.filter(|(i, _)| is_rotary(*i) == rotary)
                .map(|(_, found)| found.deviation)
                .fold(0.0, f64::max)
        };
        let [difference_um, difference_urad] = match self.policy {
            Policy::Direction { .. } => [most(&|s| s.apart[0]) * 1e3, most(&|s| s.apart[1]) * 1e6],
            Policy::Orientation | Policy::Position => [worst(false), worst(true)],
        };
        let is_worst = |s: &Sample| match self.policy {
            // The permitted deviation of the direction is so much larger that it hardly ever decides.
            Policy::Direction { .. } => s.apart[0] * 1e3 >= AS_BAD * difference_um,
            Policy::Orientation | Policy::Position => {
                let bad = AS_BAD * difference_um.max(difference_urad);
                axes.clone().any(|i| s.deviation[i] * scale(i) >= bad)
            }
        };
        let worst_at = places()
            .find(|(s, _)| is_worst(s))
            .map(|(_, command)| axes.clone().map(|i| f64::from(command.axes[i])).collect())
            .unwrap_or_default();
        Verification {
            positions: places().count(),
            before: quality(0),
            after: quality(1),
            kinematic: quality(2),
            difference_um,
            difference_urad,
            direction_worse: samples()
                .filter(|s| s.direction[1] > s.direction[0] + WORSE)
                .count(),
            policy: self.policy,
            deviations,
            worst_at,
            largest: axes
                .map(|i| most(&|s| f64::from(s.corrections[i].abs())))
                .collect(),
        }
    }
}

/// Compares tables and reference corrections at given commands, all together, like [`Measured::new`].
///
/// # Errors
/// [`NotConverged`] if the kinematic correction fails.
pub fn verify(
    machine: &Machine,
    errors: &ErrorModel,
    runtime: &Runtime<'_>,
    zero: &PerAxis,
    commands: &[Command],
    progress: impl Fn() + Sync,
) -> Result<Verification, NotConverged> {
    Ok(Measured::new(machine, errors, runtime, zero, commands.to_vec(), progress)?.everywhere())
}

#[cfg(test)]
mod tests {
    use super::Statistics;

    #[test]
    fn of_twenty_values_nineteen_do_not_exceed_the_second_largest() {
        let found = Statistics::of((1..=20).rev().map(f64::from));
        assert_eq!((found.mean, found.p95, found.max), (10.5, 19.0, 20.0));
        let one = Statistics::of(std::iter::once(3.0));
        assert_eq!((one.mean, one.rms, one.p95, one.max), (3.0, 3.0, 3.0, 3.0));
        assert_eq!(Statistics::of(std::iter::empty()), Statistics::default());
    }
}

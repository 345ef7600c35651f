//! Error motions of each axis along its travel, six of each as in ISO 230-1.

use super::Subject;
use super::words::motion_in_words;
use serde::{Deserialize, Serialize};
use trueaxis_model::errors::{MAX_SENSORS, Motion, Situation, Switches};
use trueaxis_model::machine::Axis;
use trueaxis_model::numbers::ascending;
use trueaxis_model::validate::calibrated;
use trueaxis_study::Probed;

/// Number of positions of a curve without measured points.
const STEPS: u32 = 72;
/// Parts of an axis (mm, deg) that are shorter are ignored.
const NO_LENGTH: f64 = 1e-9;
const COMPONENTS: [char; 6] = ['X', 'Y', 'Z', 'A', 'B', 'C'];

/// The error motions of an axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxisMotions {
    /// Letter.
    pub axis: char,
    /// Unit of its positions, `mm` or `deg`.
    pub unit: String,
    /// Travel.
    pub travel: [f64; 2],
    /// True if it rotates without limits.
    pub is_endless: bool,
    /// The part of the travel in which the errors are known; `None` if it is all of it.
    pub calibrated: Option<[f64; 2]>,
    /// Lowest and highest probed position, if the errors come from probings and the axis has limits.
    pub probed: Option<[f64; 2]>,
    /// The error motions that are not zero everywhere.
    pub motions: Vec<MotionShown>,
}

/// One error motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MotionShown {
    /// Name according to ISO 230-1: `EYX`.
    pub name: String,
    /// Description of the error motion.
    pub words: String,
    /// `µm` or `µrad`.
    pub unit: String,
    /// Positions (mm, deg).
    pub at: Vec<f64>,
    /// Values after positive travel, or for both directions if they do not differ.
    pub positive: Vec<f64>,
    /// Values after negative travel, if they differ.
    pub negative: Option<Vec<f64>>,
    /// Measured positions (mm, deg), if it is a table.
    pub measured_at: Vec<f64>,
}

impl AxisMotions {
    /// The parts of the travel without measurements.
    #[must_use]
    pub fn unmeasured(&self) -> Vec<[f64; 2]> {
        let [low, high] = self.travel;
        let known = [self.calibrated, self.probed].into_iter().flatten();
        let [from, to] = known.fold(self.travel, |[a, b], [from, to]| [a.max(from), b.min(to)]);
        let parts = match from < to {
            true => vec![[low, from], [to, high]],
            false => vec![self.travel],
        };
        parts
            .into_iter()
            .filter(|[a, b]| b - a > NO_LENGTH)
            .collect()
    }
}

/// The error motions of all axes, at the reference temperatures.
pub fn motions(subject: &Subject<'_>, probed: &[Probed]) -> Vec<AxisMotions> {
    let (machine, errors) = (subject.machine, subject.errors);
    let of = |(index, axis): (usize, &Axis)| {
        let travel = axis.travel;
        let known = calibrated(machine, errors, index);
        let known = [known[0].max(travel[0]), known[1].min(travel[1])];
        let holds = errors.motions[index].iter().any(|motion| motion.holds());
        let is_part =
            holds && (known[0] > travel[0] + NO_LENGTH || known[1] < travel[1] - NO_LENGTH);
        let letter = axis.letter.char();
        let probed = probed.iter().find(|p| p.axis == letter && !axis.modulo);
        let one = |component: usize| motion(subject, index, axis, component);
        AxisMotions {
            axis: letter,
            unit: axis.unit().to_owned(),
            travel,
            is_endless: axis.modulo,
            calibrated: is_part.then_some(known),
            probed: probed.map(|probed| probed.range),
            motions: (0..6).filter_map(one).collect(),
        }
    };
    machine.axes.iter().enumerate().map(of).collect()
}

/// An error motion of an axis along its travel, unless it is zero everywhere.
fn motion(
    subject: &Subject<'_>,
    index: usize,
    axis: &Axis,
    component: usize,
) -> Option<MotionShown> {
    let (machine, errors) = (subject.machine, subject.errors);
    let motion = &errors.motions[index][component];
    if !is_known(motion) {
        return None;
    }
    let measured_at = measured_at(motion, axis);
    // Where it begins to hold its end value.
    let ends = calibrated(machine, errors, index).into_iter();
    let at = shown_at(axis, &measured_at, ends.filter(|_| motion.holds()));
    let factor = if component < 3 { 1e3 } else { 1e6 };
    let curve = |sign: f64| -> Vec<f64> {
        let situation = Situation {
            sign: [sign; trueaxis_model::machine::MAX_AXES],
            kelvin: [0.0; MAX_SENSORS],
            ..Situation::default()
        };
        let value = |q: &f64| {
            let q = axis.to_kinematic(*q);
            let all = errors.intra_at(machine, index, q, &situation, &Switches::ALL);
            all.map_or(0.0, |all| all[component] * factor)
        };
        at.iter().map(value).collect()
    };
    let letter = axis.letter.char();
    Some(MotionShown {
        name: format!("E{}{letter}", COMPONENTS[component]),
        words: motion_in_words(component, letter),
        unit: if component < 3 { "µm" } else { "µrad" }.to_owned(),
        positive: curve(1.0),
        negative: motion.reverses().then(|| curve(-1.0)),
        measured_at,
        at,
    })
}

/// True unless a motion is zero everywhere at the reference temperatures.
fn is_known(motion: &Motion) -> bool {
    motion.coefficients.iter().any(|c| *c != 0.0)
        || motion.harmonics.iter().any(|h| *h != [0.0; 2])
        || motion.backlash != 0.0
        || motion.table.is_some()
}

/// Measured positions of an axis within its travel, in ascending order.
fn measured_at(motion: &Motion, axis: &Axis) -> Vec<f64> {
    let [low, high] = axis.travel;
    let all = motion.table.iter().flat_map(|table| &table.at);
    let all = all.map(|q| axis.to_command(*q));
    let mut at: Vec<f64> = all.filter(|q| *q >= low && *q <= high).collect();
    ascending(&mut at);
    at
}

/// Positions of a curve: those that were measured, or equal steps; both ends of the travel, and `ends` within it.
fn shown_at(axis: &Axis, measured: &[f64], ends: impl Iterator<Item = f64>) -> Vec<f64> {
    let [low, high] = axis.travel;
    let mut at: Vec<f64> = match measured.is_empty() {
        true => (0..=STEPS)
            .map(|k| low + (high - low) * f64::from(k) / f64::from(STEPS))
            .collect(),
        false => [&[low, high], measured].concat(),
    };
    at.extend(ends.filter(|q| *q > low && *q < high));
    ascending(&mut at);
    at.dedup();
    at
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_not_measured_is_outside_of_what_was_calibrated_and_probed() {
        let axis = |calibrated, probed| AxisMotions {
            axis: 'X',
            unit: "mm".to_owned(),
            travel: [-100.0, 100.0],
            is_endless: false,
            calibrated,
            probed,
            motions: Vec::new(),
        };
        assert!(axis(None, None).unmeasured().is_empty());
        assert!(axis(None, Some([-110.0, 100.0])).unmeasured().is_empty());
        assert_eq!(
            axis(Some([-80.0, 90.0]), Some([-100.0, 50.0])).unmeasured(),
            [[-100.0, -80.0], [50.0, 100.0]]
        );
        assert_eq!(
            axis(Some([-80.0, 0.0]), Some([10.0, 50.0])).unmeasured(),
            [[-100.0, 100.0]]
        );
    }
}

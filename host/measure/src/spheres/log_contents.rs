//! Extracts probings from a log.

use super::fit::{Centre, FittedBalls, fit};
use super::log::Touched;
use super::planned::{belongs, named};
use super::resumed::whole_rows;
use crate::formats::probe::Spherical;
use crate::formats::probings::Probings;
use crate::plan::PER_BALL;
use crate::simulate::reach;
use crate::simulate::turned;
use nalgebra::Vector3;
use trueaxis_model::errors::{ErrorModel, Situation};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::Machine;
use trueaxis_model::source::FileError;

/// The touches of one ball are not farther apart than this many times those of another; balls differ in size.
const APART: f64 = 3.0;
/// A ball stays within this (mm) of its position, whatever the errors of the machine.
const ELSEWHERE: f64 = 5.0;
/// No touch is farther than this from its sphere (mm).
const OFF: f64 = 1.0;

/// Content of a log.
#[derive(Clone, Debug, PartialEq)]
pub struct LogContents {
    /// The probings of rows with a complete set of touches, in the order of the plan.
    pub probings: Probings,
    /// Their touches, five each.
    pub touches: Vec<Touched>,
    /// The other rows, as text.
    pub missing: Vec<String>,
    /// The fitted spheres.
    pub fitted: FittedBalls,
}

/// The probings that a log of a plan contains. `radius` is the known distance from the centre of a ball to that
/// of the stylus tip (mm), or it is fitted for each ball. `lobing` is how the effective
/// radius of the tip depends on the direction. Known `errors` of the machine are used to turn its view of
/// a ball into a sphere, a matter of some thousandths.
///
/// # Errors
/// [`FileError`]: a log of another plan, missing touches, touches that are not on a sphere.
pub fn to_probings(
    machine: &Machine,
    plan: &Probings,
    log: &[Touched],
    radius: Option<f64>,
    lobing: &Spherical,
    errors: &ErrorModel,
) -> Result<LogContents, FileError> {
    let (plan, touches, missing) = match belongs(machine, plan, log) {
        Ok(()) => (plan.clone(), log.to_vec(), Vec::new()),
        Err(error) => whole_rows(machine, plan, log).ok_or(error)?,
    };
    let (plan, log) = (&plan, &touches[..]);
    let kinematics = Kinematics::new(machine, errors);
    let mut spheres = Vec::new();
    for (row, touches) in plan.rows.iter().zip(log.chunks(PER_BALL)) {
        let tip = turned(machine.tool_axis, row.spindle) * Vector3::from(machine.tip);
        let point = |touched: &Touched| {
            let q = machine.to_kinematic(&touched.position);
            let situation = Situation {
                sign: row.direction,
                ..Situation::default()
            };
            kinematics.sensitivity(&q, &situation, &tip).point
        };
        spheres.push(Centre {
            ball: row.ball,
            touches: touches.iter().map(point).collect(),
        });
    }
    together(plan, log, &spheres)?;
    let no_sphere = |probing: usize| {
        let (row, touches) = (&plan.rows[probing], &log[PER_BALL * probing..]);
        FileError::at(
            touches[0].span.start..touches[PER_BALL - 1].span.end,
            format!(
                "the five touches of {} are no part of a sphere",
                named(machine, plan, row)
            ),
            "these",
            "a touch is missing above, or the radius is another, or this is the log of another plan; else probe this ball again, at the pole and around it",
        )
    };
    let fitted = |spheres: &[Centre]| {
        fit(spheres, plan.balls.len(), radius).map_err(|e| no_sphere(e.probing))
    };
    let mut found = fitted(&spheres)?;
    if *lobing != Spherical::default() {
        // Directions are right within what the lobes have moved the centres by, in radii: a thousandth.
        let rows = plan.rows.iter().zip(log.chunks(PER_BALL));
        for ((row, log), (sphere, centre)) in rows.zip(spheres.iter_mut().zip(&found.centres)) {
            let turn = turned(machine.tool_axis, row.spindle);
            let tip = Vector3::from(machine.tip);
            for (touched, point) in log.iter().zip(&mut sphere.touches) {
                let pose = kinematics.nominal(&machine.to_kinematic(&touched.position), None);
                let out = (*point - centre).normalize();
                let own = (pose.r * turn).transpose() * out;
                let [around, height] = Spherical::direction(machine, &tip, &own);
                *point -= out * lobing.deviation(around, height);
            }
        }
        found = fitted(&spheres)?;
    }
    let fitted = found;
    let off = |left: &Vec<f64>| left.iter().any(|left| left.abs() > OFF);
    if let Some(probing) = fitted.left.iter().position(off) {
        return Err(no_sphere(probing));
    }
    for (number, row) in plan.rows.iter().enumerate() {
        let same = plan.rows.iter().position(|r| r.ball == row.ball);
        let first = same.unwrap_or(number);
        if !missing.is_empty()
            && (fitted.centres[number] - fitted.centres[first]).norm() > ELSEWHERE
        {
            return Err(FileError::at(
                log[PER_BALL * number].span.clone(),
                format!(
                    "{} is elsewhere than in line {} of the plan, and touches are missing: {}",
                    named(machine, plan, row),
                    plan.rows[first].line,
                    missing.join(", ")
                ),
                "here",
                "give the plan from which the program was written",
            ));
        }
    }
    let mut probings = plan.clone();
    for (number, row) in probings.rows.iter_mut().enumerate() {
        let touches = &log[PER_BALL * number..][..PER_BALL];
        let mean = |of: &dyn Fn(&Touched) -> Option<f64>| -> Option<f64> {
            let sum: Option<f64> = touches.iter().map(of).sum();
            sum.map(|sum| sum / PER_BALL as f64)
        };
        row.position = std::array::from_fn(|i| mean(&|t| Some(t.position[i])).unwrap_or(0.0));
        row.time = mean(&|t| t.time).or(row.time);
        row.temperature = mean(&|t| t.temperature).or(row.temperature);
        let tip = turned(machine.tool_axis, row.spindle) * Vector3::from(machine.tip);
        let q = reach(&kinematics, row, &tip, &fitted.centres[number]);
        row.position = machine.to_command(&q.ok_or_else(|| no_sphere(number))?);
    }
    Ok(LogContents {
        probings,
        touches,
        missing,
        fitted,
    })
}

/// Checks that the touches of one ball are about as far apart as those of others. If one is missing, a ball gets
/// touches of the next.
fn together(plan: &Probings, log: &[Touched], spheres: &[Centre]) -> Result<(), FileError> {
    let widest = |sphere: &Centre| {
        let points = &sphere.touches;
        let pairs = points
            .iter()
            .flat_map(|a| points.iter().map(move |b| (a - b).norm()));
        pairs.fold(0.0, f64::max)
    };
    let widths: Vec<f64> = spheres.iter().map(widest).collect();
    let least = widths.iter().copied().fold(f64::INFINITY, f64::min);
    for (number, (sphere, width)) in spheres.iter().zip(&widths).enumerate() {
        if *width <= APART * least {
            continue;
        }
        let far = |i: &usize| -> f64 {
            sphere
                .touches
                .iter()
                .map(|p| (p - sphere.touches[*i]).norm())
                .sum()
        };
        let farthest = (0..sphere.touches.len()).max_by(|a, b| far(a).total_cmp(&far(b)));
        let touched = &log[PER_BALL * number + farthest.unwrap_or(0)];
        return Err(FileError::at(
            touched.span.clone(),
            format!(
                "this touch is {width:.1} mm from others of ball {} (line {} of the plan), where those of another are {least:.1} mm apart",
                plan.balls[sphere.ball], plan.rows[number].line
            ),
            "too far away",
            "a touch is missing above, or this is the log of another plan: give the plan from which the program was written",
        ));
    }
    Ok(())
}

//! Extracts probings from a log.

use super::fit::{Centre, FittedBalls, fit};
use super::log::Touched;
use super::planned::{belongs, named};
use super::resumed::whole_rows;
use crate::plan::PER_BALL;
use crate::probe_file::Spherical;
use nalgebra::Vector3;
use trueaxis_identify::formats::probings::{Probing, Probings};
use trueaxis_identify::instrument::turned;
use trueaxis_identify::simulate::reach;
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
    let rows = TouchedRows {
        machine,
        kinematics: Kinematics::new(machine, errors),
        plan: &plan,
        log: &touches,
    };
    let mut spheres = rows.spheres();
    together(&plan, &touches, &spheres)?;
    let fitted = |spheres: &[Centre]| {
        fit(spheres, plan.balls.len(), radius).map_err(|e| rows.no_sphere(e.probing))
    };
    let mut found = fitted(&spheres)?;
    if *lobing != Spherical::default() {
        rows.take_off(lobing, &found.centres, &mut spheres);
        found = fitted(&spheres)?;
    }
    let off = |left: &Vec<f64>| left.iter().any(|left| left.abs() > OFF);
    if let Some(probing) = found.left.iter().position(off) {
        return Err(rows.no_sphere(probing));
    }
    rows.have_stayed(&found.centres, &missing)?;
    Ok(LogContents {
        probings: rows.probings(&found.centres)?,
        touches,
        missing,
        fitted: found,
    })
}

/// The rows of a plan, with their touches.
struct TouchedRows<'a> {
    machine: &'a Machine,
    kinematics: Kinematics<'a>,
    plan: &'a Probings,
    /// [`PER_BALL`] of each row.
    log: &'a [Touched],
}

impl TouchedRows<'_> {
    fn each(&self) -> impl Iterator<Item = (&Probing, &[Touched])> {
        self.plan.rows.iter().zip(self.log.chunks(PER_BALL))
    }

    /// The tip (mm, spindle frame), turned by the spindle.
    fn tip(&self, row: &Probing) -> Vector3<f64> {
        turned(self.machine.tool_axis, row.spindle) * Vector3::from(self.machine.tip)
    }

    /// Where the tip was at each touch, in the workpiece frame.
    fn spheres(&self) -> Vec<Centre> {
        let sphere = |(row, touches): (&Probing, &[Touched])| {
            let tip = self.tip(row);
            let point = |touched: &Touched| {
                let q = self.machine.to_kinematic(&touched.position);
                let situation = Situation {
                    sign: row.direction,
                    ..Situation::default()
                };
                self.kinematics.sensitivity(&q, &situation, &tip).point
            };
            Centre {
                ball: row.ball,
                touches: touches.iter().map(point).collect(),
            }
        };
        self.each().map(sphere).collect()
    }

    /// Takes the lobes of the tip off the touches.
    fn take_off(&self, lobing: &Spherical, centres: &[Vector3<f64>], spheres: &mut [Centre]) {
        // Directions are right within what the lobes have moved the centres by, in radii: a thousandth.
        let machine = self.machine;
        for ((row, log), (sphere, centre)) in self.each().zip(spheres.iter_mut().zip(centres)) {
            let turn = turned(machine.tool_axis, row.spindle);
            let tip = Vector3::from(machine.tip);
            for (touched, point) in log.iter().zip(&mut sphere.touches) {
                let pose =
                    (self.kinematics).nominal(&machine.to_kinematic(&touched.position), None);
                let out = (*point - centre).normalize();
                let own = (pose.r * turn).transpose() * out;
                let [around, height] = Spherical::direction(machine, &tip, &own);
                *point -= out * lobing.deviation(around, height);
            }
        }
    }

    fn no_sphere(&self, probing: usize) -> FileError {
        let (row, touches) = (&self.plan.rows[probing], &self.log[PER_BALL * probing..]);
        FileError::at(
            touches[0].span.start..touches[PER_BALL - 1].span.end,
            format!(
                "the five touches of {} are no part of a sphere",
                named(self.machine, self.plan, row)
            ),
            "these",
            "a touch is missing above, or the radius is another, or this is the log of another plan; else probe this ball again, at the pole and around it",
        )
    }

    /// If touches are missing, checks that each ball stays where it is first.
    fn have_stayed(&self, centres: &[Vector3<f64>], missing: &[String]) -> Result<(), FileError> {
        let plan = self.plan;
        for (number, row) in plan.rows.iter().enumerate() {
            let same = plan.rows.iter().position(|r| r.ball == row.ball);
            let first = same.unwrap_or(number);
            if !missing.is_empty() && (centres[number] - centres[first]).norm() > ELSEWHERE {
                return Err(FileError::here(
                    self.log[PER_BALL * number].span.clone(),
                    format!(
                        "{} is elsewhere than in line {} of the plan, and touches are missing: {}",
                        named(self.machine, plan, row),
                        plan.rows[first].line,
                        missing.join(", ")
                    ),
                    "give the plan from which the program was written",
                ));
            }
        }
        Ok(())
    }

    /// The plan, with each row at the position that brings the tip to the centre.
    fn probings(&self, centres: &[Vector3<f64>]) -> Result<Probings, FileError> {
        let mut probings = self.plan.clone();
        for (number, row) in probings.rows.iter_mut().enumerate() {
            let touches = &self.log[PER_BALL * number..][..PER_BALL];
            let mean = |of: &dyn Fn(&Touched) -> Option<f64>| -> Option<f64> {
                let sum: Option<f64> = touches.iter().map(of).sum();
                sum.map(|sum| sum / PER_BALL as f64)
            };
            row.position = std::array::from_fn(|i| mean(&|t| Some(t.position[i])).unwrap_or(0.0));
            row.time = mean(&|t| t.time).or(row.time);
            row.temperature = mean(&|t| t.temperature).or(row.temperature);
            let q = reach(&self.kinematics, row, &self.tip(row), &centres[number]);
            let q = q.ok_or_else(|| self.no_sphere(number))?;
            row.position = self.machine.to_command(&q);
        }
        Ok(probings)
    }
}

/// Checks that the touches of one ball are about as far apart as those of others. If one is missing, a ball gets
/// touches of the next.
fn together(plan: &Probings, log: &[Touched], spheres: &[Centre]) -> Result<(), FileError> {
    let widest = |sphere: &Centre| {
        let points = &sphere.touches;
        let pairs = (points.iter()).flat_map(|a| points.iter().map(move |b| (a - b).norm()));
        pairs.fold(0.0, f64::max)
    };
    let widths: Vec<f64> = spheres.iter().map(widest).collect();
    let least = widths.iter().copied().fold(f64::INFINITY, f64::min);
    for (number, (sphere, width)) in spheres.iter().zip(&widths).enumerate() {
        if *width <= APART * least {
            continue;
        }
        let far = |i: &usize| -> f64 {
            (sphere.touches.iter())
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

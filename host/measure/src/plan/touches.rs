//! The five touches with which a probe finds the centre of a ball.

use super::scene::{Meeting, Scene, is_described};
use super::touch::{Probe, Touch, Touching};
use crate::formats::artefact::{Artefact, Ball};
use crate::formats::probings::Probing;
use crate::simulate::turned;
use crate::simulate::{reach, three_linear};
use nalgebra::{Matrix3, Vector3};
use trueaxis_model::errors::{ErrorModel, Situation};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{Machine, PerAxis};

/// Why a ball cannot be probed at a position.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Unreachable {
    /// Position is unknown.
    #[error("it has no nominal_mm in the artefact")]
    NoPlace,
    /// The linear axes cannot get there.
    #[error("the linear axes cannot bring the stylus there")]
    NoWay,
    /// The stylus would come from the side of the table.
    #[error(
        "the stylus would be {degrees:.0}° from the direction in which the ball points away from the table"
    )]
    Cone {
        /// The angle to the direction in which the ball stands off the table (deg).
        degrees: f64,
    },
    /// Something would come too close to something else.
    #[error("{0}")]
    Meets(Box<Meeting>),
    /// An axis would leave its travel.
    #[error("{axis} = {position:.3} is outside its travel")]
    Travel {
        /// The axis.
        axis: char,
        /// The position it would need (mm, deg).
        position: f64,
    },
}

/// Larger than any distance on a machine (mm).
const FAR: f64 = 1e4;
/// Distance to keep from the end of the travel (mm).
pub(super) const SPARE: f64 = 0.5;

/// The touches of a probing of a ball with a known position, on the nominal machine.
///
/// # Errors
/// [`Unreachable`] if the stylus would come from the side of the table, or an axis would leave its travel.
pub fn touching(
    machine: &Machine,
    artefact: &Artefact,
    ball: &Ball,
    probing: &Probing,
    probe: &Probe,
) -> Result<Touching, Unreachable> {
    let centre = ball.nominal.ok_or(Unreachable::NoPlace)?;
    let perfect = ErrorModel::perfect(machine);
    let kinematics = Kinematics::new(machine, &perfect);
    let tip = artefact.stylus.place(machine);
    let tip = turned(machine.tool_axis, probing.spindle) * tip;
    let linear = three_linear(machine).ok_or(Unreachable::NoWay)?;
    let q = reach(&kinematics, probing, &tip, &centre).ok_or(Unreachable::NoWay)?;
    let pose = trueaxis_kinematics::Nominal::new(machine).pose(&q, None);
    let to_spindle = Vector3::from(machine.direction(&pose));
    let angle = libm::acos(to_spindle.dot(&ball.away).clamp(-1.0, 1.0));
    if angle > probe.cone {
        return Err(Unreachable::Cone {
            degrees: angle.to_degrees(),
        });
    }
    let found = kinematics.sensitivity(&q, &Situation::default(), &tip);
    let ways = linear.map(|i| {
        let axis = &machine.axes[i];
        let way: Vector3<f64> = found.by_intra[i].column(axis.letter.component()).into();
        if axis.reversed { -way } else { way }
    });
    let to_axes = Matrix3::from_columns(&ways).try_inverse();
    let to_axes = to_axes.ok_or(Unreachable::NoWay)?;
    let at = |way: &Vector3<f64>| {
        let mut moved = q;
        for (i, step) in linear.into_iter().zip((to_axes * way).iter()) {
            moved[i] += step;
        }
        machine.to_command(&moved)
    };
    // Halfway between the directions of the first linear axis, or of the stem if it shows.
    let across = |v: &Vector3<f64>| v - to_spindle * v.dot(&to_spindle);
    let stem = across(&ball.away);
    let first = (stem.norm() > ANGLE).then_some(stem);
    let first = first.unwrap_or_else(|| across(&longest(&ways, &across)));
    let side = first.normalize();
    let other = to_spindle.cross(&side);
    let near = probe.radius + probe.clearance;
    let above = to_spindle * near;
    // Beside the ball, the path down must be clear of the ball too.
    let touch = |(number, [turn, latitude]): (usize, [f64; 2])| {
        let out = match number {
            0 => to_spindle,
            _ => {
                (side * libm::cos(turn) + other * libm::sin(turn)) * libm::cos(latitude)
                    + to_spindle * libm::sin(latitude)
            }
        };
        let begin = match number {
            0 => out * near,
            _ => out * (near / libm::cos(latitude)),
        };
        Touch {
            over: at(&(across(&begin) + above)),
            begin: at(&begin),
            end: at(&(out * (probe.radius - probe.search))),
        }
    };
    let mut touching = Touching {
        centre: machine.to_command(&q),
        away: at(&above),
        above: at(&above),
        touches: probe
            .directions()
            .into_iter()
            .enumerate()
            .map(touch)
            .collect(),
    };
    for position in touching.positions() {
        inside(machine, position)?;
    }
    let mut farthest = FAR;
    let step = to_axes * to_spindle;
    for (i, step) in linear.into_iter().zip(step.iter()) {
        let axis = &machine.axes[i];
        let step = axis.to_command(*step);
        if !axis.modulo && step.abs() > ANGLE {
            let end = if step > 0.0 {
                axis.travel[1] - SPARE
            } else {
                axis.travel[0] + SPARE
            };
            farthest = farthest.min((end - touching.above[i]) / step);
        }
    }
    touching.away = at(&(to_spindle * (near + farthest.max(0.0))));
    if probe.keeps_clear || is_described(machine, artefact) {
        let scene = Scene::new(machine, artefact, probe, probing.spindle);
        if let Some(meeting) = scene.touching(&touching, ball) {
            return Err(Unreachable::Meets(Box::new(meeting)));
        }
    }
    Ok(touching)
}

/// Directions that differ by less than this (rad) are equal.
const ANGLE: f64 = 1e-6;

/// The direction of the linear axis that is most nearly perpendicular to the tool.
fn longest(ways: &[Vector3<f64>], across: &impl Fn(&Vector3<f64>) -> Vector3<f64>) -> Vector3<f64> {
    let mut longest = ways[0];
    for way in ways {
        // The first of two equal ones.
        if across(way).norm() > across(&longest).norm() + ANGLE {
            longest = *way;
        }
    }
    longest
}

fn inside(machine: &Machine, position: &PerAxis) -> Result<(), Unreachable> {
    for (axis, position) in machine.axes.iter().zip(position) {
        let [low, high] = axis.travel;
        if !axis.modulo && !(low..=high).contains(position) {
            return Err(Unreachable::Travel {
                axis: axis.letter.char(),
                position: *position,
            });
        }
    }
    Ok(())
}

//! The five touches with which a probe finds the centre of a ball.

use super::scene::{Meeting, Scene, is_described};
use crate::formats::artefact::{Artefact, Ball};
use crate::formats::probings::Probing;
use crate::simulate::turned;
use crate::simulate::{reach, three_linear};
use nalgebra::{Matrix3, Vector3};
use trueaxis_model::errors::{ErrorModel, Situation};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{Machine, PerAxis};

/// Number of touches per ball.
pub(crate) const PER_BALL: usize = 5;

/// Latitudes (rad) of the touches around a ball that qualify a probe: low and high, so that what differs at the pole can be
/// told from where the ball is.
const LOW: f64 = std::f64::consts::PI / 18.0;
const HIGH: f64 = std::f64::consts::PI / 4.0;

/// Latitude (rad) of four of them above the equator of the ball, seen from the spindle. At the equator only the
/// touch at the pole would determine the height of the ball, and an error of it would not be noticed.
const LATITUDE: f64 = std::f64::consts::PI / 6.0;

/// Why a ball cannot be probed at a position.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Unreachable {
    /// Its position is unknown.
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
    Meets(Meeting),
    /// An axis would leave its travel.
    #[error("{axis} = {position:.3} is outside its travel")]
    Travel {
        /// The axis.
        axis: char,
        /// The position it would need (mm, deg).
        position: f64,
    },
}

/// Geometry of the touches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probe {
    /// Distance from the ball centre to the stylus centre at contact (mm): the sum of both radii.
    pub radius: f64,
    /// Radius of the stylus tip (mm).
    pub stylus: f64,
    /// Distance from the ball at which a touch begins (mm).
    pub clearance: f64,
    /// Search distance beyond the nominal surface (mm).
    pub search: f64,
    /// Largest angle between the stylus and the direction in which a ball stands off the table (rad).
    pub cone: f64,
    /// Distance that solids on the tool's side keep from those on the workpiece's (mm).
    pub keep: f64,
    /// Touch each ball this many times at a low latitude, and half as often at a high one, besides the pole: to qualify the
    /// probe. 0: five touches, which find its centre.
    pub around: usize,
    /// Refuse rows whose touches bring the stylus too close to another ball; with solids or posts that are described, all
    /// that come too close to anything are refused anyhow.
    pub keeps_clear: bool,
}

impl Default for Probe {
    /// A ball of 20 mm and a stylus tip of 6 mm, touches from 5 mm before to 3 mm beyond the surface, and the stylus
    /// up to 60° from the direction in which the ball stands off the table.
    fn default() -> Self {
        Self {
            radius: 13.0,
            stylus: 3.0,
            clearance: 5.0,
            search: 3.0,
            cone: 60.0_f64.to_radians(),
            keep: 1.0,
            around: 0,
            keeps_clear: false,
        }
    }
}

/// A touch, as axis positions (mm, deg).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Beside the ball, at the height of the approach.
    pub over: PerAxis,
    /// Where the touch begins.
    pub begin: PerAxis,
    /// Where the touch ends if there is no contact.
    pub end: PerAxis,
}

/// The probing of one ball, as axis positions (mm, deg).
#[derive(Clone, Debug, PartialEq)]
pub struct Touching {
    /// With the stylus centre at the ball centre.
    pub centre: PerAxis,
    /// As far from the ball along the stylus as the travel allows; axes turn there.
    pub away: PerAxis,
    /// Above the pole, where the touches begin and end.
    pub above: PerAxis,
    /// The touches: at the pole, then around the tool axis.
    pub touches: Vec<Touch>,
}

impl Probe {
    /// Number of touches per ball.
    #[must_use]
    pub fn per_ball(&self) -> usize {
        self.directions().len()
    }

    /// Angle around the tool axis and latitude (rad) of each touch; the pole comes first.
    fn directions(&self) -> Vec<[f64; 2]> {
        let ring = |count: usize, latitude: f64| {
            (0..count).map(move |k| {
                let turn = (k as f64 + 0.5) * std::f64::consts::TAU / count as f64;
                [turn, latitude]
            })
        };
        let pole = [[0.0, std::f64::consts::FRAC_PI_2]];
        match self.around {
            0 => pole
                .into_iter()
                .chain(ring(PER_BALL - 1, LATITUDE))
                .collect(),
            around => pole
                .into_iter()
                .chain(ring(around, LOW))
                .chain(ring(around.div_ceil(2), HIGH))
                .collect(),
        }
    }
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
    let angle = to_spindle.dot(&ball.away).clamp(-1.0, 1.0).acos();
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
                (side * turn.cos() + other * turn.sin()) * latitude.cos()
                    + to_spindle * latitude.sin()
            }
        };
        let begin = match number {
            0 => out * near,
            _ => out * (near / latitude.cos()),
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
            return Err(Unreachable::Meets(meeting));
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

impl Touching {
    pub(super) fn positions(&self) -> impl Iterator<Item = &PerAxis> {
        let touches = self.touches.iter();
        let of = touches.flat_map(|t| [&t.over, &t.begin, &t.end]);
        of.chain([&self.above, &self.centre])
    }
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

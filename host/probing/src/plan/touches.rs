//! The five touches with which a probe finds the centre of a ball.

use super::scene::{Scene, is_described};
use super::touch::{Probe, Touch, Touching};
use nalgebra::{Matrix3, Vector3};
use trueaxis_identify::formats::artefact::{Artefact, Ball};
use trueaxis_identify::formats::probings::Probing;
use trueaxis_identify::instrument::turned;
use trueaxis_identify::simulate::{reach, three_linear};
use trueaxis_model::errors::{ErrorModel, Situation};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{Machine, PerAxis};

/// Why a ball cannot be probed at a position.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct Unreachable(String);

impl Unreachable {
    /// A ball without a place.
    pub(super) fn no_place() -> Self {
        Self("it has no nominal_mm in the artefact".to_owned())
    }

    fn no_way() -> Self {
        Self("the linear axes cannot bring the stylus there".to_owned())
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
    let centre = TipAtCentre::new(machine, artefact, ball, probing, probe.cone)?;
    let touching = centre.touching(ball, probe)?;
    if probe.keeps_clear || is_described(machine, artefact) {
        let scene = Scene::new(machine, artefact, probe, probing.spindle);
        scene
            .touching(&touching, ball)
            .map_or(Ok(()), |meets| Err(Unreachable(meets)))?;
    }
    Ok(touching)
}

/// The nominal machine with the tip of the stylus at the centre of a ball.
struct TipAtCentre<'a> {
    machine: &'a Machine,
    linear: [usize; 3],
    q: PerAxis,
    to_spindle: Vector3<f64>,
    /// How the tip moves with each linear axis.
    ways: [Vector3<f64>; 3],
    /// From a way of the tip to the ways of the linear axes.
    to_axes: Matrix3<f64>,
}

impl<'a> TipAtCentre<'a> {
    fn new(
        machine: &'a Machine,
        artefact: &Artefact,
        ball: &Ball,
        probing: &Probing,
        cone: f64,
    ) -> Result<Self, Unreachable> {
        let centre = ball.nominal.ok_or_else(Unreachable::no_place)?;
        let perfect = ErrorModel::perfect(machine);
        let kinematics = Kinematics::new(machine, &perfect);
        let tip = artefact.stylus.place(machine);
        let tip = turned(machine.tool_axis, probing.spindle) * tip;
        let linear = three_linear(machine).ok_or_else(Unreachable::no_way)?;
        let q = reach(&kinematics, probing, &tip, &centre).ok_or_else(Unreachable::no_way)?;
        let pose = trueaxis_kinematics::Nominal::new(machine).pose(&q, None);
        let to_spindle = Vector3::from(machine.direction(&pose));
        let angle = libm::acos(to_spindle.dot(&ball.away).clamp(-1.0, 1.0));
        if angle > cone {
            return Err(Unreachable(format!(
                "the stylus would be {:.0}° from the direction in which the ball points away from the table",
                angle.to_degrees()
            )));
        }
        let found = kinematics.sensitivity(&q, &Situation::default(), &tip);
        let ways = linear.map(|i| {
            let axis = &machine.axes[i];
            let way: Vector3<f64> = found.by_intra[i].column(axis.letter.component()).into();
            if axis.reversed { -way } else { way }
        });
        let to_axes = Matrix3::from_columns(&ways).try_inverse();
        let to_axes = to_axes.ok_or_else(Unreachable::no_way)?;
        Ok(Self {
            machine,
            linear,
            q,
            to_spindle,
            ways,
            to_axes,
        })
    }

    /// The position of the machine with the tip this way from the centre.
    fn at(&self, way: &Vector3<f64>) -> PerAxis {
        let mut moved = self.q;
        for (i, step) in self.linear.into_iter().zip((self.to_axes * way).iter()) {
            moved[i] += step;
        }
        self.machine.to_command(&moved)
    }

    fn across(&self, v: &Vector3<f64>) -> Vector3<f64> {
        v - self.to_spindle * v.dot(&self.to_spindle)
    }

    /// From where touches around the ball are counted: halfway between the directions of the stem if it shows, or of the
    /// linear axis that is most nearly perpendicular to the tool.
    fn side(&self, ball: &Ball) -> Vector3<f64> {
        let stem = self.across(&ball.away);
        let [first, others @ ..] = self.ways.map(|way| self.across(&way));
        // The first of two equal ones.
        let longer = |longest: Vector3<f64>, way| longest.norm() + ANGLE < Vector3::norm(way);
        let longest = (others.iter()).fold(
            first,
            |most, way| if longer(most, way) { *way } else { most },
        );
        (if stem.norm() > ANGLE { stem } else { longest }).normalize()
    }

    fn touching(&self, ball: &Ball, probe: &Probe) -> Result<Touching, Unreachable> {
        let to_spindle = self.to_spindle;
        let side = self.side(ball);
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
                over: self.at(&(self.across(&begin) + above)),
                begin: self.at(&begin),
                end: self.at(&(out * (probe.radius - probe.search))),
            }
        };
        let mut touching = Touching {
            centre: self.machine.to_command(&self.q),
            away: self.at(&above),
            above: self.at(&above),
            touches: (probe.directions().into_iter().enumerate())
                .map(touch)
                .collect(),
        };
        for position in touching.positions() {
            inside(self.machine, position)?;
        }
        let room = self.room(&touching.above);
        touching.away = self.at(&(to_spindle * (near + room)));
        Ok(touching)
    }

    /// How far (mm) the tip can go towards the spindle from above the ball.
    fn room(&self, above: &PerAxis) -> f64 {
        let mut farthest = FAR;
        let step = self.to_axes * self.to_spindle;
        for (i, step) in self.linear.into_iter().zip(step.iter()) {
            let axis = &self.machine.axes[i];
            let step = axis.to_command(*step);
            if !axis.modulo && step.abs() > ANGLE {
                let end = if step > 0.0 {
                    axis.travel[1] - SPARE
                } else {
                    axis.travel[0] + SPARE
                };
                farthest = farthest.min((end - above[i]) / step);
            }
        }
        farthest.max(0.0)
    }
}

/// Directions that differ by less than this (rad) are equal.
const ANGLE: f64 = 1e-6;

fn inside(machine: &Machine, position: &PerAxis) -> Result<(), Unreachable> {
    for (axis, position) in machine.axes.iter().zip(position) {
        let [low, high] = axis.travel;
        if !axis.modulo && !(low..=high).contains(position) {
            let letter = axis.letter;
            let reason = format!("{letter} = {position:.3} is outside its travel");
            return Err(Unreachable(reason));
        }
    }
    Ok(())
}

//! What must not meet while a machine probes: the solids of the machine file, balls with their posts, and the stylus.

use super::touch::{Probe, Touching};
use crate::clearance::{Body, BodyPair, may_meet, nearest};
use nalgebra::{Rotation3, Unit, Vector3};
use trueaxis_identify::formats::artefact::{Artefact, Ball};
use trueaxis_identify::instrument::turned;
use trueaxis_kinematics::Htm;
use trueaxis_model::machine::{Branch, Carrier, Machine, PerAxis, SolidShape};

/// How close a move may come to the ball that is touched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
    /// As to any other ball.
    Far,
    /// It must not be touched.
    Near,
    /// It is touched by the stylus.
    Touch,
}

/// What a body is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum BodyPart {
    Stylus,
    Tool,
    /// Index of its ball in the artefact.
    Ball(usize),
    Post(usize),
    Table,
    Fixed,
}

/// Part of the clearance of touches that is kept from balls; the rest is for errors of their positions.
const KEPT: f64 = 0.9;

/// True if more is known than balls and the tip of the stylus.
pub(super) fn is_described(machine: &Machine, artefact: &Artefact) -> bool {
    !machine.solids.is_empty()
        || artefact.stylus.shaft.is_some()
        || artefact.balls.iter().any(|ball| ball.post.is_some())
}

/// Everything that must not meet, with the spindle at one angle.
#[derive(Clone, Debug)]
pub(super) struct Scene<'a> {
    machine: &'a Machine,
    artefact: &'a Artefact,
    probe: Probe,
    bodies: Vec<Body>,
    parts: Vec<BodyPart>,
}

impl<'a> Scene<'a> {
    /// With the spindle at an angle (deg).
    pub fn new(machine: &'a Machine, artefact: &'a Artefact, probe: &Probe, spindle: f64) -> Self {
        let tip = turned(machine.tool_axis, spindle) * artefact.stylus.place(machine);
        Self::with_stylus(machine, artefact, probe, tip, 0.0)
    }

    /// With the room that the stylus takes while the spindle turns.
    pub fn turning(machine: &'a Machine, artefact: &'a Artefact, probe: &Probe) -> Self {
        let mut tip = artefact.stylus.place(machine);
        let along = tip[machine.tool_axis];
        tip[machine.tool_axis] = 0.0;
        let off = tip.norm();
        let mut middle = Vector3::zeros();
        middle[machine.tool_axis] = along;
        Self::with_stylus(machine, artefact, probe, middle, off)
    }

    /// With the tip here in the spindle frame (mm), and everything above it thicker by this at its radius.
    fn with_stylus(
        machine: &'a Machine,
        artefact: &'a Artefact,
        probe: &Probe,
        tip: Vector3<f64>,
        thicker: f64,
    ) -> Self {
        let mut scene = Self {
            machine,
            artefact,
            probe: *probe,
            bodies: Vec::new(),
            parts: Vec::new(),
        };
        scene.add_stylus(tip, thicker);
        for (number, ball) in artefact.balls.iter().enumerate() {
            let Some(centre) = ball.nominal else { continue };
            let radius = probe.radius - probe.stylus;
            let place = Htm::translation(centre);
            scene.add(
                BodyPart::Ball(number),
                Carrier::Workpiece,
                SolidShape::Sphere { radius },
                place,
            );
            if let Some(post) = ball.post {
                let thick = post.diameter / 2.0;
                // From where it leaves the ball.
                let begin = (radius * radius - thick * thick).max(0.0).sqrt();
                let half = (post.height - begin).max(0.0) / 2.0;
                let place = along(&(centre - ball.away * (begin + half)), &ball.away);
                let shape = SolidShape::Cylinder {
                    radius: thick,
                    half,
                };
                scene.add(BodyPart::Post(number), Carrier::Workpiece, shape, place);
            }
        }
        for solid in &machine.solids {
            let part = match solid.carrier {
                Carrier::Foundation => BodyPart::Fixed,
                Carrier::Spindle => BodyPart::Tool,
                Carrier::Workpiece => BodyPart::Table,
                Carrier::Axis(axis) if machine.axes[axis].branch == Branch::Tool => BodyPart::Tool,
                Carrier::Axis(_) => BodyPart::Table,
            };
            scene.add(part, solid.carrier, solid.shape, solid.place);
        }
        scene
    }

    fn add(&mut self, part: BodyPart, carrier: Carrier, shape: SolidShape, place: Htm) {
        self.parts.push(part);
        self.bodies.push(Body {
            carrier,
            shape,
            place,
        });
    }

    /// Tip, shaft and shank; the shaft is as thick as the tip unless something else is known.
    fn add_stylus(&mut self, tip: Vector3<f64>, thicker: f64) {
        let axis = self.machine.tool_axis;
        let to_face = tip[axis].abs();
        let mut up = Vector3::zeros();
        up[axis] = if tip[axis] > 0.0 { -1.0 } else { 1.0 };
        let shaft = self.artefact.stylus.shaft;
        let radius = self.probe.stylus + thicker;
        let place = Htm::translation(tip);
        self.add(
            BodyPart::Stylus,
            Carrier::Spindle,
            SolidShape::Sphere { radius },
            place,
        );
        let length = shaft.and_then(|shaft| shaft.length).unwrap_or(to_face);
        let half = length.min(to_face) / 2.0;
        let radius = shaft.map_or(self.probe.stylus, |shaft| shaft.diameter / 2.0) + thicker;
        let shape = SolidShape::Capsule { radius, half };
        let place = along(&(tip + up * half), &up);
        self.add(BodyPart::Stylus, Carrier::Spindle, shape, place);
        let rest = (to_face - length).max(0.0) / 2.0;
        if rest > 0.0 {
            let shank = shaft.and_then(|shaft| shaft.shank);
            let radius = shank.map_or(radius, |diameter| diameter / 2.0 + thicker);
            let shape = SolidShape::Cylinder { radius, half: rest };
            let place = along(&(tip + up * (length + rest)), &up);
            self.add(BodyPart::Tool, Carrier::Spindle, shape, place);
        }
    }

    /// Which bodies must stay apart on a move to or from a ball, and how far.
    fn pairs(&self, own: &str, way: Way) -> Vec<BodyPair> {
        let mut pairs = Vec::new();
        for (i, a) in self.parts.iter().enumerate() {
            for (j, b) in self.parts.iter().enumerate() {
                if let Some(keep) = self.keep(*a, *b, own, way) {
                    pairs.push(BodyPair {
                        bodies: [i, j],
                        keep,
                    });
                }
            }
        }
        pairs
    }

    /// The distance (mm) that a part keeps from another one; none if they may meet, or in the other order.
    fn keep(&self, a: BodyPart, b: BodyPart, own: &str, way: Way) -> Option<f64> {
        let keep = self.probe.keep;
        let from_ball = keep.max(KEPT * self.probe.clearance);
        let is_own = |ball: usize| self.artefact.balls[ball].name == own;
        match (a, b) {
            (BodyPart::Stylus, BodyPart::Ball(ball)) if is_own(ball) => match way {
                Way::Far => Some(KEPT * self.probe.clearance),
                Way::Near => Some(0.0),
                Way::Touch => None,
            },
            // It stands where its ball is, and touches end there.
            (BodyPart::Stylus | BodyPart::Tool, BodyPart::Ball(ball) | BodyPart::Post(ball))
                if is_own(ball) && way != Way::Far =>
            {
                Some(keep)
            }
            (
                BodyPart::Stylus | BodyPart::Tool | BodyPart::Fixed,
                BodyPart::Ball(_) | BodyPart::Post(_),
            ) => Some(from_ball),
            (BodyPart::Stylus | BodyPart::Tool, BodyPart::Table | BodyPart::Fixed) => Some(keep),
            _ => None,
        }
    }

    /// What a move is too close to, in words.
    pub fn meeting(&self, own: &str, way: Way, from: &PerAxis, to: &PerAxis) -> Option<String> {
        self.among(&self.pairs(own, way), from, to)
    }

    fn among(&self, pairs: &[BodyPair], from: &PerAxis, to: &PerAxis) -> Option<String> {
        let found = nearest(self.machine, &self.bodies, pairs, from, to)?;
        let BodyPair { bodies, keep } = pairs[found.pair];
        let [a, b] = bodies.map(|body| self.name(body));
        let meets = match found.apart > 0.0 {
            true => format!("{a} would pass {b} at {:.2} mm", found.apart),
            false => format!("{a} would meet {b}"),
        };
        let [at, from, to] = [&found.at, from, to].map(|position| named(self.machine, position));
        Some(format!(
            "{meets} where {at} ({keep:.1} mm are asked), on the move from {from} to {to}"
        ))
    }

    /// Whether the touches of a ball, and the way to them along the stylus, are too close to anything.
    pub fn touching(&self, touching: &Touching, ball: &Ball) -> Option<String> {
        let near = touching.positions().copied().collect::<Vec<_>>();
        // A few of all pairs are near the touches at all.
        let pairs = |way| {
            let all = self.pairs(&ball.name, way);
            may_meet(self.machine, &self.bodies, &all, &near)
        };
        let [at_ball, at_touch] = [Way::Near, Way::Touch].map(pairs);
        let touches = touching.touches.iter().find_map(|touch| {
            self.among(&at_ball, &touching.above, &touch.over)
                .or_else(|| self.among(&at_ball, &touch.over, &touch.begin))
                .or_else(|| self.among(&at_touch, &touch.begin, &touch.end))
        });
        touches.or_else(|| self.meeting(&ball.name, Way::Near, &touching.away, &touching.above))
    }

    fn name(&self, body: usize) -> String {
        let ball = |ball: usize| &self.artefact.balls[ball].name;
        match self.parts[body] {
            BodyPart::Stylus => "the stylus".to_owned(),
            BodyPart::Ball(number) => format!("ball {}", ball(number)),
            BodyPart::Post(number) => format!("the post of ball {}", ball(number)),
            // Solids of the file come last; a tool before them is the shank.
            BodyPart::Tool | BodyPart::Table | BodyPart::Fixed => {
                let solids = &self.machine.solids;
                match body.checked_sub(self.bodies.len() - solids.len()) {
                    Some(number) => format!("`{}`", solids[number].name),
                    None => "the shank of the stylus".to_owned(),
                }
            }
        }
    }
}

/// A frame with its z axis in a direction.
fn along(origin: &Vector3<f64>, way: &Vector3<f64>) -> Htm {
    let z = Unit::new_normalize(*way);
    // Opposite directions have no single rotation between them; a shape is the same upside down.
    let turn = Rotation3::rotation_between(&Vector3::z(), &z);
    let turn = turn.unwrap_or_else(Rotation3::identity);
    Htm {
        r: turn.into_inner(),
        t: *origin,
    }
}

/// Axis positions in words.
fn named(machine: &Machine, position: &PerAxis) -> String {
    let axes = machine.axes.iter().zip(position);
    let words: Vec<String> = axes
        .map(|(axis, at)| format!("{}{at:.1}", axis.letter))
        .collect();
    words.join(" ")
}

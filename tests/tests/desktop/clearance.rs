//! Clearances over moves, compared with dense sampling on random machines.

use nalgebra::Vector3;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::{Htm, Kinematics};
use trueaxis_model::machine::{Branch, Carrier, Machine, PerAxis, SolidShape};
use trueaxis_probing::clearance::{Body, BodyPair, RESOLVED, distance, nearest};
use trueaxis_tests::{Fixed, random_machines, usual_or_all};

/// Times at which a move is looked at, and points of the surface of one of the bodies.
const TIMES: usize = 200;
const POINTS: usize = 300;

fn unit(random: &mut Fixed) -> Vector3<f64> {
    Vector3::from_fn(|_, _| random.within(0.0, 1.0) - 0.5).normalize()
}

fn body(random: &mut Fixed, carrier: Carrier, number: usize) -> Body {
    let mut size = |least: f64, most: f64| least + (most - least) * random.within(0.0, 1.0);
    let shape = match number % 4 {
        0 => SolidShape::Sphere {
            radius: size(2.0, 30.0),
        },
        1 => SolidShape::Capsule {
            radius: size(2.0, 10.0),
            half: size(5.0, 60.0),
        },
        2 => SolidShape::Box([size(5.0, 80.0), size(5.0, 80.0), size(5.0, 80.0)]),
        _ => SolidShape::Cylinder {
            radius: size(5.0, 80.0),
            half: size(2.0, 60.0),
        },
    };
    let place = std::array::from_fn(|i| match i {
        0..3 => size(-150.0, 150.0),
        _ => size(-3.0, 3.0),
    });
    Body {
        carrier,
        shape,
        place: Htm::from_xyz_abc(place),
    }
}

/// A point of the surface of a shape, or inside, in its own frame.
fn point(random: &mut Fixed, shape: &SolidShape) -> Vector3<f64> {
    let way = unit(random);
    let along = 2.0 * random.within(0.0, 1.0) - 1.0;
    match *shape {
        SolidShape::Sphere { radius } => way * radius,
        SolidShape::Capsule { radius, half } => way * radius + Vector3::z() * along * half,
        SolidShape::Box(half) => {
            Vector3::from_fn(|i, _| half[i] * (2.0 * random.within(0.0, 1.0) - 1.0).signum())
        }
        SolidShape::Cylinder { radius, half } => {
            let out = Vector3::new(way.x, way.y, 0.0).normalize() * radius;
            out + Vector3::z() * half.copysign(along)
        }
    }
}

/// Distance of a point from a shape around the origin.
fn from_point(own: &Vector3<f64>, shape: &SolidShape) -> f64 {
    let out = |v: f64, half: f64| (v.abs() - half).max(0.0);
    match *shape {
        SolidShape::Sphere { radius } => own.norm() - radius,
        SolidShape::Capsule { radius, half } => {
            Vector3::new(own.x, own.y, out(own.z, half)).norm() - radius
        }
        SolidShape::Box(half) => Vector3::from_fn(|i, _| out(own[i], half[i])).norm(),
        SolidShape::Cylinder { radius, half } => {
            out(own.x.hypot(own.y), radius).hypot(out(own.z, half))
        }
    }
}

/// Where a body is, from the place of one axis after the other.
fn place(machine: &Machine, q: &PerAxis, body: &Body) -> Htm {
    let (branch, last, end) = match body.carrier {
        Carrier::Foundation => return body.place,
        Carrier::Axis(axis) => (machine.axes[axis].branch, axis, machine.axes[axis].frame),
        Carrier::Spindle => (Branch::Tool, machine.axes.len(), machine.spindle),
        Carrier::Workpiece => (Branch::Workpiece, machine.axes.len(), machine.workpiece),
    };
    // At zero a frame is where the file says; each axis moves all that it carries, about its own frame at zero.
    let axes = machine.axes.iter().enumerate();
    let carried = axes.filter(|(i, axis)| axis.branch == branch && *i <= last);
    carried.fold(Htm::identity(), |moved, (i, axis)| {
        let by = if axis.reversed { -q[i] } else { q[i] };
        let mut own = [0.0; 6];
        own[axis.letter.component() + if axis.letter.is_rotary() { 3 } else { 0 }] = by;
        moved * axis.frame * Htm::from_xyz_abc(own) * axis.frame.inverse()
    }) * end
        * body.place
}

#[test]
fn no_sample_is_closer_than_what_is_proven() {
    let machines = random_machines::cases(usual_or_all(8, 60));
    let mut random = Fixed::new(5);
    let (mut clear, mut close) = (0, 0);
    for case in &machines {
        let machine = &case.machine;
        let perfect = ErrorModel::perfect(machine);
        let kinematics = Kinematics::new(machine, &perfect);
        for number in 0..12 {
            let axis = |branch: Branch, random: &mut Fixed| {
                let of: Vec<usize> = (0..machine.axes.len())
                    .filter(|i| machine.axes[*i].branch == branch)
                    .collect();
                let end = match branch {
                    Branch::Tool => Carrier::Spindle,
                    Branch::Workpiece => Carrier::Workpiece,
                };
                let chosen = (random.within(0.0, 1.0) * (of.len() + 1) as f64) as usize;
                of.get(chosen).map_or(end, |axis| Carrier::Axis(*axis))
            };
            let carriers = [Branch::Tool, Branch::Workpiece].map(|b| axis(b, &mut random));
            let bodies = [
                body(&mut random, carriers[0], number),
                body(&mut random, carriers[1], number / 3),
            ];
            let mut somewhere = || {
                let mut position = PerAxis::default();
                for (at, axis) in position.iter_mut().zip(&machine.axes) {
                    let [low, high] = axis.travel;
                    *at = low + (high - low) * random.within(0.0, 1.0);
                }
                position
            };
            let (from, to) = (somewhere(), somewhere());
            let points: Vec<Vector3<f64>> = (0..POINTS)
                .map(|_| point(&mut random, &bodies[0].shape))
                .collect();
            let mut sampled = f64::INFINITY;
            for time in 0..=TIMES {
                let part = time as f64 / TIMES as f64;
                let position: PerAxis = std::array::from_fn(|i| from[i] + part * (to[i] - from[i]));
                let q = machine.to_kinematic(&position);
                let [a, b] = [0, 1].map(|i| place(machine, &q, &bodies[i]));
                let between = b.inverse() * a;
                for point in &points {
                    let own = between.r * point + between.t;
                    sampled = sampled.min(from_point(&own, &bodies[1].shape));
                }
                let found = distance((&bodies[0].shape, &a), (&bodies[1].shape, &b));
                assert!(found.most <= found.least + 1e-4, "{found:?}");
            }
            // Samples are points of the move: it comes at least as close as they do.
            for keep in [
                0.0,
                sampled - 5.0,
                sampled - 0.5,
                sampled + 0.02,
                sampled + 10.0,
            ] {
                let pair = BodyPair {
                    bodies: [0, 1],
                    keep: keep.max(0.0),
                };
                let found = nearest(machine, &bodies, &[pair], &from, &to);
                let Some(found) = found else {
                    clear += 1;
                    assert!(sampled >= pair.keep, "{}: {sampled} {pair:?}", case.seed);
                    continue;
                };
                close += 1;
                assert!(found.apart < pair.keep + RESOLVED + 1e-9);
                assert!(found.apart <= 0.0 || found.apart <= sampled + RESOLVED + 1e-6);
                // It is a position of the move, where the two are that close.
                let q = machine.to_kinematic(&found.at);
                let [a, b] = [0, 1].map(|i| place(machine, &q, &bodies[i]));
                let there = distance((&bodies[0].shape, &a), (&bodies[1].shape, &b));
                assert!(
                    (there.most - found.apart).abs() < 1e-5,
                    "{there:?} {found:?}"
                );
                let way = (0..machine.axes.len())
                    .find(|i| (to[*i] - from[*i]).abs() > 1.0)
                    .map(|i| (i, (found.at[i] - from[i]) / (to[i] - from[i])));
                if let Some((_, part)) = way {
                    assert!((0.0..=1.0).contains(&part));
                    for i in 0..machine.axes.len() {
                        let there = from[i] + part * (to[i] - from[i]);
                        assert!((there - found.at[i]).abs() < 1e-6);
                    }
                }
            }
            // The places are those of the tool's pose.
            let q = machine.to_kinematic(&from);
            let [workpiece, spindle] = [Carrier::Workpiece, Carrier::Spindle].map(|carrier| {
                let shape = SolidShape::Sphere { radius: 1.0 };
                let origin = Htm::identity();
                let body = Body {
                    carrier,
                    shape,
                    place: origin,
                };
                place(machine, &q, &body)
            });
            let tool = workpiece.inverse() * spindle * Htm::translation(machine.tip.into());
            assert!((tool.t - kinematics.nominal(&q, None).t).norm() < 1e-9);
        }
    }
    assert!(clear > 50 && close > 50, "{clear} {close}");
}

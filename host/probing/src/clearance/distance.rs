//! The distance between two convex shapes, by the algorithm of Gilbert, Johnson and Keerthi (1988).

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use trueaxis_kinematics::Htm;
use trueaxis_model::machine::SolidShape;

/// Bounds of a distance (mm): it is at least `least` and at most `most`. Negative if two round shapes are in each other;
/// shapes whose inner parts overlap are as far in each other as their radii, or farther.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Apart {
    /// VerifiedFigures by a plane between the shapes.
    pub least: f64,
    /// Between a point of one and a point of the other.
    pub most: f64,
}

/// The bounds are this close (mm), unless rounding prevents it.
const CLOSE: f64 = 1e-6;
/// Largest number of planes tried; round shapes need up to 40.
const PLANES: usize = 100;
/// Distances below this are zero (mm): rounding of positions of 1 m.
const ZERO: f64 = 1e-9;

/// The distance between two shapes at places in the same frame.
#[must_use]
pub fn distance(a: (&SolidShape, &Htm), b: (&SolidShape, &Htm)) -> Apart {
    let round = radius(a.0) + radius(b.0);
    // The point of the difference of both inner parts that is farthest in a direction.
    let farthest = |way: &Vector3<f64>| extreme(a, way) - extreme(b, &-way);
    let mut nearest = farthest(&(b.1.t - a.1.t));
    let mut points = vec![nearest];
    let mut least = 0.0_f64;
    for _ in 0..PLANES {
        let length = nearest.norm();
        if length < ZERO {
            break;
        }
        let point = farthest(&-nearest);
        least = least.max(nearest.dot(&point) / length);
        if length - least < CLOSE || points.contains(&point) {
            break;
        }
        points.push(point);
        let (next, spanned_by) = smallest(&points);
        // Rounding: no nearer point can be found.
        if next.norm_squared() >= length * length {
            break;
        }
        (nearest, points) = (next, spanned_by);
    }
    let most = nearest.norm();
    let most = if most < ZERO { 0.0 } else { most };
    Apart {
        least: least.min(most) - round,
        most: most - round,
    }
}

/// The radius by which the inner part of a shape is inflated.
fn radius(shape: &SolidShape) -> f64 {
    match *shape {
        SolidShape::Sphere { radius } | SolidShape::Capsule { radius, .. } => radius,
        SolidShape::Box(_) | SolidShape::Cylinder { .. } => 0.0,
    }
}

/// The point of a shape's inner part that is farthest in a direction.
fn extreme((shape, place): (&SolidShape, &Htm), way: &Vector3<f64>) -> Vector3<f64> {
    let own = place.r.transpose() * way;
    let point = match *shape {
        SolidShape::Sphere { .. } => Vector3::zeros(),
        SolidShape::Capsule { half, .. } => Vector3::z() * half.copysign(own.z),
        SolidShape::Box(half) => Vector3::from_fn(|i, _| half[i].copysign(own[i])),
        SolidShape::Cylinder { radius, half } => {
            let across = libm::hypot(own.x, own.y);
            let out = if across > 0.0 { radius / across } else { 0.0 };
            Vector3::new(own.x * out, own.y * out, half.copysign(own.z))
        }
    };
    place.r * point + place.t
}

/// The point nearest to the origin of the convex hull of at most four points, and those of them that span it: the last
/// one and others.
fn smallest(points: &[Vector3<f64>]) -> (Vector3<f64>, Vec<Vector3<f64>>) {
    let last = points.len() - 1;
    let mut best = (points[last], 0);
    for subset in 1..1_usize << last {
        if let Some(point) = in_plane(points[last], &chosen(&points[..last], subset))
            && point.norm_squared() < best.0.norm_squared()
        {
            best = (point, subset);
        }
    }
    let mut spanned_by = chosen(&points[..last], best.1);
    spanned_by.push(points[last]);
    (best.0, spanned_by)
}

fn chosen(points: &[Vector3<f64>], subset: usize) -> Vec<Vector3<f64>> {
    let is_in = |(i, _): &(usize, &Vector3<f64>)| subset >> i & 1 == 1;
    (points.iter().enumerate().filter(is_in))
        .map(|(_, point)| *point)
        .collect()
}

/// The point nearest to the origin of the plane through all points, if it lies between them.
fn in_plane(first: Vector3<f64>, others: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    let edges: Vec<Vector3<f64>> = others.iter().map(|point| point - first).collect();
    let product = |i: usize, j: usize| edges[i].dot(&edges[j]);
    let down = |i: usize| -edges[i].dot(&first);
    let parts: Vec<f64> = match edges.len() {
        1 => vec![down(0) / product(0, 0)],
        2 => (Matrix2::from_fn(product).try_inverse()? * Vector2::from_fn(|i, _| down(i)))
            .iter()
            .copied()
            .collect(),
        _ => (Matrix3::from_fn(product).try_inverse()? * Vector3::from_fn(|i, _| down(i)))
            .iter()
            .copied()
            .collect(),
    };
    let point = (edges.iter().zip(&parts)).fold(first, |point, (edge, part)| point + edge * *part);
    let is_between = parts.iter().sum::<f64>() <= 1.0 && parts.iter().all(|part| *part >= 0.0);
    (is_between && point.iter().all(|v| v.is_finite())).then_some(point)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;
    use std::f64::consts::PI;

    fn drawn(random: &mut Pcg64Mcg, kind: usize) -> (SolidShape, Htm) {
        let mut size = |least: f64, most: f64| least + (most - least) * random.random::<f64>();
        let shape = match kind {
            0 => SolidShape::Sphere {
                radius: size(1.0, 30.0),
            },
            1 => SolidShape::Capsule {
                radius: size(1.0, 10.0),
                half: size(1.0, 60.0),
            },
            2 => SolidShape::Box([size(1.0, 80.0), size(1.0, 80.0), size(1.0, 80.0)]),
            _ => SolidShape::Cylinder {
                radius: size(1.0, 60.0),
                half: size(1.0, 60.0),
            },
        };
        let mut place = [0.0; 6];
        for (i, value) in place.iter_mut().enumerate() {
            *value = if i < 3 {
                size(-150.0, 150.0)
            } else {
                size(-PI, PI)
            };
        }
        (shape, Htm::from_xyz_abc(place))
    }

    /// Distance of a point from a shape, by its own coordinates.
    fn from_point(point: &Vector3<f64>, (shape, place): &(SolidShape, Htm)) -> f64 {
        let own = place.r.transpose() * (point - place.t);
        let out = |v: f64, half: f64| (v.abs() - half).max(0.0);
        match *shape {
            SolidShape::Sphere { radius } => own.norm() - radius,
            SolidShape::Capsule { radius, half } => {
                Vector3::new(own.x, own.y, out(own.z, half)).norm() - radius
            }
            SolidShape::Box(half) => Vector3::from_fn(|i, _| out(own[i], half[i])).norm(),
            SolidShape::Cylinder { radius, half } => {
                libm::hypot(out(libm::hypot(own.x, own.y), radius), out(own.z, half))
            }
        }
    }

    /// The smallest distance between both shapes: alternating projections onto two convex sets converge to it.
    fn by_projection(a: &(SolidShape, Htm), b: &(SolidShape, Htm)) -> f64 {
        let mut point = b.1.t;
        for _ in 0..20_000 {
            point = projected(&point, a);
            let next = projected(&point, b);
            point = next;
        }
        let on_a = projected(&point, a);
        (on_a - point).norm() - radius(&a.0) - radius(&b.0)
    }

    /// The point of a shape's inner part that is nearest to a point.
    fn projected(point: &Vector3<f64>, (shape, place): &(SolidShape, Htm)) -> Vector3<f64> {
        let own = place.r.transpose() * (point - place.t);
        let inside = |v: f64, half: f64| v.clamp(-half, half);
        let near = match *shape {
            SolidShape::Sphere { .. } => Vector3::zeros(),
            SolidShape::Capsule { half, .. } => Vector3::z() * inside(own.z, half),
            SolidShape::Box(half) => Vector3::from_fn(|i, _| inside(own[i], half[i])),
            SolidShape::Cylinder { radius, half } => {
                let across = libm::hypot(own.x, own.y);
                let part = if across > radius {
                    radius / across
                } else {
                    1.0
                };
                Vector3::new(own.x * part, own.y * part, inside(own.z, half))
            }
        };
        place.r * near + place.t
    }

    #[test]
    fn bounds_meet_at_the_distance_of_points_and_of_projections() {
        let mut random = Pcg64Mcg::seed_from_u64(3);
        for number in 0..112 {
            let a = drawn(&mut random, number % 4);
            let b = drawn(&mut random, number / 4 % 4);
            let found = distance((&a.0, &a.1), (&b.0, &b.1));
            assert!(found.least <= found.most, "{number}: {found:?}");
            assert!(
                found.most - found.least < 2.0 * CLOSE,
                "{number}: {found:?}"
            );
            let other = distance((&b.0, &b.1), (&a.0, &a.1));
            assert!((other.most - found.most).abs() < 2.0 * CLOSE);
            if let SolidShape::Sphere { radius } = a.0 {
                let exact = from_point(&a.1.t, &b) - radius;
                assert!((found.most - exact).abs() < 2.0 * CLOSE || exact < 0.0);
            }
            // Projections of touching shapes converge slowly: the distance is below theirs.
            let projected = by_projection(&a, &b);
            let is_far = found.least + radius(&a.0) + radius(&b.0) > 1.0;
            assert!(
                projected > found.least - ZERO,
                "{number}: {projected} {found:?}"
            );
            if is_far {
                assert!(
                    projected - found.most < 1e-4,
                    "{number}: {projected} {found:?}"
                );
            }
        }
    }

    #[test]
    fn parallel_faces_edges_and_the_same_place_are_no_exception() {
        let cube = SolidShape::Box([10.0; 3]);
        let at = |x: f64, y: f64| Htm::translation(Vector3::new(x, y, 0.0));
        for (x, y, expected) in [(25.0, 0.0, 5.0), (25.0, 3.0, 5.0), (23.0, 24.0, 5.0)] {
            let found = distance((&cube, &at(0.0, 0.0)), (&cube, &at(x, y)));
            assert!((found.most - expected).abs() < CLOSE && found.most - found.least < CLOSE);
        }
        for x in [0.0, 1.0, 20.0] {
            let found = distance((&cube, &at(0.0, 0.0)), (&cube, &at(x, 0.0)));
            assert!(found.least <= 0.0 && found.most < CLOSE, "{x} {found:?}");
        }
        let ball = SolidShape::Sphere { radius: 4.0 };
        let found = distance((&ball, &at(0.0, 0.0)), (&ball, &at(6.0, 0.0)));
        assert!((found.least + 2.0).abs() < CLOSE && (found.most + 2.0).abs() < CLOSE);
    }
}

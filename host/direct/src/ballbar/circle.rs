//! Circular tests (ISO 230-4): the circular deviation G, the radial deviation F and the circular hysteresis H.

use super::sphere::{FittedSphere, fitted};
use nalgebra::{Matrix4, Vector3, Vector4};
use std::f64::consts::TAU;
use trueaxis_model::numbers::{ascending, by};

/// Readings of one or two turns: angle (rad) from the first axis towards the second, and excess of the bar over its
/// nominal length (mm).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BallBarTurns {
    /// Turning from the first axis towards the second.
    pub counter_clockwise: Vec<(f64, f64)>,
    /// Turning back.
    pub clockwise: Vec<(f64, f64)>,
}

impl BallBarTurns {
    /// The largest angle (rad) between neighbouring readings of a turn.
    #[must_use]
    pub fn widest_gap(&self) -> f64 {
        let of = |turn: &Vec<(f64, f64)>| {
            let mut angles: Vec<f64> = turn
                .iter()
                .map(|(angle, _)| angle.rem_euclid(TAU))
                .collect();
            ascending(&mut angles);
            let first = angles.first().map(|first| first + TAU);
            let next = angles.iter().copied().skip(1).chain(first);
            let gaps = angles.iter().zip(next).map(|(angle, next)| next - angle);
            gaps.fold(0.0, f64::max)
        };
        of(&self.counter_clockwise).max(of(&self.clockwise))
    }
}

/// Results of a circular test (mm).
#[derive(Clone, Debug, PartialEq)]
pub struct Circle {
    /// Centre of the least-squares circle through all readings: the setup, along the first and the second axis.
    pub centre: [f64; 2],
    /// Radius minus the nominal radius.
    pub size: f64,
    /// G of each turn that was measured: the radial separation of the two closest concentric circles that enclose
    /// it.
    pub deviation: [Option<f64>; 2],
    /// Like `deviation`, about the turn's least-squares circle.
    pub least_squares: [Option<f64>; 2],
    /// G of both turns together, if both were measured.
    pub bidirectional: Option<f64>,
    /// F: largest and smallest radius minus the nominal one, about the least-squares centre.
    pub radial: [f64; 2],
    /// Like `radial`, of each turn that was measured, about the common centre.
    pub radial_of_turn: [Option<[f64; 2]>; 2],
    /// H: largest difference of the two turns at the same angle, about the common centre, if both were measured.
    pub hysteresis: Option<f64>,
}

/// Why no circle can be fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CircleError {
    /// The readings cover too short an arc, or there are fewer than four.
    #[error("the readings do not cover enough of a circle to determine both centre and radius")]
    TooFew,
}

/// Largest number of exchanges. Each widens the band; a dozen are common.
const EXCHANGES: usize = 500;
/// A band that is wider by less than this fraction is the same: rounding.
const SAME: f64 = 1e-9;

impl Circle {
    /// Evaluates readings with a bar of nominal length `radius` (mm).
    ///
    /// # Errors
    /// [`CircleError`].
    pub fn of(radius: f64, turns: &BallBarTurns) -> Result<Self, CircleError> {
        let point = |(angle, reading): &(f64, f64)| {
            let (sine, cosine) = libm::sincos(*angle);
            Vector3::new(cosine, sine, 0.0) * (radius + reading)
        };
        let both = [&turns.counter_clockwise, &turns.clockwise];
        let points = both.map(|turn| turn.iter().map(point).collect::<Vec<_>>());
        let all = points.concat();
        let common = fit(&all)?;
        let off = [common.centre.x, common.centre.y];
        let mut deviation = [None; 2];
        let mut least_squares = [None; 2];
        for (turn, points) in points.iter().enumerate() {
            if !points.is_empty() {
                least_squares[turn] = Some(fit(points)?.range());
                deviation[turn] = Some(band(points, &common)?);
            }
        }
        let is_both = deviation.iter().all(Option::is_some);
        let radial = |residuals: &[f64]| {
            let (low, high) = (residuals.iter())
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), r| {
                    (low.min(*r), high.max(*r))
                });
            [high, low].map(|r| r + common.radius - radius)
        };
        let (forth, back) = common.residuals.split_at(points[0].len());
        Ok(Self {
            centre: off,
            size: common.radius - radius,
            deviation,
            least_squares,
            bidirectional: is_both.then(|| band(&all, &common)).transpose()?,
            radial: radial(&common.residuals),
            radial_of_turn: [forth, back].map(|own| (!own.is_empty()).then(|| radial(own))),
            hysteresis: is_both.then(|| hysteresis(turns, &common)),
        })
    }
}

fn fit(points: &[Vector3<f64>]) -> Result<FittedSphere, CircleError> {
    match points.len() {
        0..4 => Err(CircleError::TooFew),
        _ => fitted(points).map_err(|_| CircleError::TooFew),
    }
}

/// Largest difference between the readings of the first turn and the second turn, interpolated linearly.
fn hysteresis(turns: &BallBarTurns, common: &FittedSphere) -> f64 {
    let [forth, back] = [&turns.counter_clockwise, &turns.clockwise];
    let split = forth.len();
    let other: Vec<(f64, f64)> = (back.iter())
        .zip(&common.residuals[split..])
        .map(|((angle, _), r)| (angle.rem_euclid(std::f64::consts::TAU), *r))
        .collect();
    let other = by(other, |(angle, _)| *angle);
    let at = |angle: f64| {
        let next = other.partition_point(|(a, _)| *a < angle);
        let (after, before) = (
            other[next % other.len()],
            other[(next + other.len() - 1) % other.len()],
        );
        let way = (after.0 - before.0).rem_euclid(std::f64::consts::TAU);
        match way > 0.0 {
            true => {
                let part = (angle - before.0).rem_euclid(std::f64::consts::TAU) / way;
                before.1 + part.min(1.0) * (after.1 - before.1)
            }
            false => after.1,
        }
    };
    let pairs = forth.iter().zip(&common.residuals);
    let differences =
        pairs.map(|((angle, _), r)| (r - at(angle.rem_euclid(std::f64::consts::TAU))).abs());
    differences.fold(0.0, f64::max)
}

/// The radial separation of the closest two concentric circles that enclose the points: the smallest band, found by
/// exchange. Linearized about a close circle; the second-order error is the square of a few µm divided by the
/// radius.
fn band(points: &[Vector3<f64>], about: &FittedSphere) -> Result<f64, CircleError> {
    let row = |point: &Vector3<f64>| {
        let off = point - about.centre;
        let distance = off.norm();
        let direction = Vector3::new(off.x / distance, off.y / distance, 1.0);
        (direction, distance - about.radius)
    };
    let rows: Vec<(Vector3<f64>, f64)> = points.iter().map(row).collect();
    // Start with readings that are far from each other: one in each quarter, if the circle is complete.
    let farthest = |[x, y]: [f64; 2]| {
        let along = |k: &usize| rows[*k].0.x * x + rows[*k].0.y * y;
        let farthest = (0..rows.len()).max_by(|a, b| along(a).total_cmp(&along(b)));
        farthest.unwrap_or(0)
    };
    let mut chosen = [[1.0, 0.1], [-0.1, 1.0], [-1.0, -0.1], [0.1, -1.0]].map(farthest);
    let mut level = reference(&rows, chosen).ok_or(CircleError::TooFew)?;
    for _ in 0..EXCHANGES {
        let [u, v, r, half] = level;
        let off = |(row, wanted): &(Vector3<f64>, f64)| wanted - row.dot(&Vector3::new(u, v, r));
        let worst = (0..rows.len())
            .max_by(|a, b| off(&rows[*a]).abs().total_cmp(&off(&rows[*b]).abs()))
            .ok_or(CircleError::TooFew)?;
        if off(&rows[worst]).abs() <= half.abs() * (1.0 + SAME) {
            break;
        }
        // The exchange that makes the band of the four points widest.
        let exchanged = (0..4).map(|place| {
            let mut next = chosen;
            next[place] = worst;
            next
        });
        let levels = exchanged.filter_map(|next| Some((next, reference(&rows, next)?)));
        let best = levels.max_by(|a, b| a.1[3].abs().total_cmp(&b.1[3].abs()));
        match best {
            Some((next, found)) if found[3].abs() > half.abs() => (chosen, level) = (next, found),
            _ => break,
        }
    }
    Ok(2.0 * level[3].abs())
}

/// The centre, the radius and half the width of the band defined by four readings. All are equally far from the
/// circle: outside if their factor in the vanishing sum of rows is positive, inside if it is negative.
fn reference(rows: &[(Vector3<f64>, f64)], chosen: [usize; 4]) -> Option<[f64; 4]> {
    let row = |k: usize| rows[chosen[k]].0;
    // Factors of the vanishing sum: the minors.
    let minor = |skip: usize| {
        let rest: Vec<usize> = (0..4).filter(|k| *k != skip).collect();
        let sign = if skip.is_multiple_of(2) { 1.0 } else { -1.0 };
        sign * row(rest[0]).dot(&row(rest[1]).cross(&row(rest[2])))
    };
    let factors = [0, 1, 2, 3].map(minor);
    if factors.iter().all(|f| *f == 0.0) {
        return None;
    }
    let matrix = Matrix4::from_fn(|k, c| match c {
        0..3 => row(k)[c],
        _ => factors[k].signum(),
    });
    let wanted = Vector4::from_fn(|k, _| rows[chosen[k]].1);
    let solved = matrix.lu().solve(&wanted)?;
    Some(solved.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn turn(count: u32, reading: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
        let angles = (0..count).map(|k| TAU * f64::from(k) / f64::from(count));
        angles.map(|angle| (angle, reading(angle))).collect()
    }

    /// The smallest band, by a fine search over centres that is independent of the exchange.
    fn searched(readings: &[(f64, f64)]) -> f64 {
        let mut centre = [0.0, 0.0];
        let width = |[u, v]: [f64; 2]| {
            let left = readings
                .iter()
                .map(|(a, r)| r - u * libm::cos(*a) - v * libm::sin(*a));
            let (low, high) = left.fold((f64::MAX, f64::MIN), |(l, h), r| (l.min(r), h.max(r)));
            high - low
        };
        let mut step = 0.01;
        while step > 1e-9 {
            let mut best = (width(centre), centre);
            for k in 0..64 {
                let (sine, cosine) = libm::sincos(TAU * f64::from(k) / 64.0);
                let next = [centre[0] + step * cosine, centre[1] + step * sine];
                let found = width(next);
                if found < best.0 {
                    best = (found, next);
                }
            }
            if best.1 == centre {
                step *= 0.5;
            }
            centre = best.1;
        }
        width(centre)
    }

    #[test]
    fn squareness_makes_an_ellipse_of_known_deviation() {
        // 40 µrad of squareness on a bar of 100 mm: 4 µm sin cos, so the band is 4 µm and F is ±2 µm.
        let reading = |a: f64| 4e-3 * libm::sin(a) * libm::cos(a);
        let turns = BallBarTurns {
            counter_clockwise: turn(360, reading),
            clockwise: turn(360, |a| reading(a) + 1e-3),
        };
        let found = Circle::of(100.0, &turns).unwrap();
        // Second order: 2 µm squared, divided by 100 mm.
        for deviation in found.deviation.into_iter().chain(found.least_squares) {
            assert!((deviation.unwrap() - 4e-3).abs() < 1e-7, "{found:?}");
        }
        assert!((found.hysteresis.unwrap() - 1e-3).abs() < 1e-9);
        assert!((found.bidirectional.unwrap() - 5e-3).abs() < 1e-7);
        assert!((found.radial[0] - 3e-3).abs() < 1e-7 && (found.radial[1] + 2e-3).abs() < 1e-7);
        assert!((found.size - 0.5e-3).abs() < 1e-7);
    }

    #[test]
    fn the_smallest_band_is_that_of_a_search_and_never_wider_than_that_of_least_squares() {
        for seed in 0..60_u32 {
            let mut state = seed.wrapping_mul(2_654_435_761).wrapping_add(12_345);
            let mut random = move || {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f64::from(state >> 8) / f64::from(1 << 24)
            };
            let count = 4 + (random() * 60.0) as u32;
            let readings = turn(count, |_| 0.0);
            let readings: Vec<_> = readings
                .into_iter()
                .map(|(a, _)| (a, 5e-3 * random() * random()))
                .collect();
            let turns = BallBarTurns {
                counter_clockwise: readings.clone(),
                clockwise: Vec::new(),
            };
            let found = Circle::of(1e4, &turns).unwrap();
            let (band, squares) = (found.deviation[0].unwrap(), found.least_squares[0].unwrap());
            let searched = searched(&readings);
            // The search ends at steps of 1e-9; the second order is 5 µm squared, divided by 10 m.
            assert!((band - searched).abs() < 1e-8, "{seed}: {band} {searched}");
            assert!(band <= squares + 1e-9, "{seed}");
            assert_eq!(found.hysteresis, None);
        }
    }

    #[test]
    fn both_turns_at_the_same_angles_are_one_circle() {
        // Angles as in files.
        let angles = (0..360).map(|k| f64::from(k).to_radians());
        let turn: Vec<_> = angles
            .map(|a| (a, 4e-3 * libm::sin(a) * libm::cos(a)))
            .collect();
        for radius in [50.0, 100.0, 150.0] {
            let turns = BallBarTurns {
                counter_clockwise: turn.clone(),
                clockwise: turn.clone(),
            };
            let found = Circle::of(radius, &turns).unwrap();
            assert!((found.bidirectional.unwrap() - 4e-3).abs() < 1e-7);
            assert_eq!(found.hysteresis, Some(0.0));
        }
    }

    #[test]
    fn a_bar_off_the_centre_is_no_deviation() {
        let off = |a: f64| 0.02 * libm::cos(a) - 0.03 * libm::sin(a);
        let exact = |a: f64| {
            let along = off(a);
            let across = 0.02_f64.powi(2) + 0.03_f64.powi(2) - along * along;
            along + (1e4 - across).sqrt() - 100.0
        };
        let turns = BallBarTurns {
            counter_clockwise: turn(90, exact),
            clockwise: turn(45, exact),
        };
        let found = Circle::of(100.0, &turns).unwrap();
        assert!((found.centre[0] - 0.02).abs() < 1e-11 && (found.centre[1] + 0.03).abs() < 1e-11);
        assert!(found.deviation.into_iter().all(|g| g.unwrap() < 1e-11));
        assert!(found.size.abs() < 1e-11);
    }

    #[test]
    fn too_short_an_arc_and_too_few_readings_are_refused() {
        let three = BallBarTurns {
            counter_clockwise: turn(3, |_| 0.0),
            clockwise: Vec::new(),
        };
        assert_eq!(Circle::of(100.0, &three), Err(CircleError::TooFew));
        let arc = BallBarTurns {
            counter_clockwise: (0..50).map(|k| (1e-7 * f64::from(k), 0.0)).collect(),
            clockwise: Vec::new(),
        };
        assert_eq!(Circle::of(100.0, &arc), Err(CircleError::TooFew));
    }
}

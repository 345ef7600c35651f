//! Arcs and helices.

use super::axes::{COUNT, PerLetter, is_rotary};
use std::f64::consts::TAU;
use trueaxis_model::numbers::ascending;

/// An arc in a plane, while all other axes move evenly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// From here (mm, degrees).
    pub from: PerLetter,
    /// To here.
    pub to: PerLetter,
    /// First and second axis of the plane, and its normal.
    pub axes: [usize; 3],
    /// The centre, along the two axes of the plane.
    pub centre: [f64; 2],
    /// The angle it turns, rad; negative clockwise.
    pub sweep: f64,
}

impl Arc {
    /// From its ends, its centre and its direction; equal ends are a full turn. `turns` adds whole ones.
    #[must_use]
    pub fn new(
        from: PerLetter,
        to: PerLetter,
        axes: [usize; 3],
        centre: [f64; 2],
        clockwise: bool,
        turns: u32,
    ) -> Self {
        let angle = |p: &PerLetter| libm::atan2(p[axes[1]] - centre[1], p[axes[0]] - centre[0]);
        let same = (0..2).all(|k| (to[axes[k]] - from[axes[k]]).abs() < 1e-9);
        let mut sweep = angle(&to) - angle(&from);
        if clockwise {
            sweep = -sweep;
        }
        sweep = sweep.rem_euclid(TAU);
        if same || sweep == 0.0 {
            sweep = TAU;
        }
        sweep += TAU * f64::from(turns.saturating_sub(1));
        Self {
            from,
            to,
            axes,
            centre,
            sweep: if clockwise { -sweep } else { sweep },
        }
    }

    /// Radius at the start and at the end: the same but for rounded words.
    #[must_use]
    pub fn radii(&self) -> [f64; 2] {
        let radius = |p: &PerLetter| {
            libm::hypot(
                p[self.axes[0]] - self.centre[0],
                p[self.axes[1]] - self.centre[1],
            )
        };
        [radius(&self.from), radius(&self.to)]
    }

    /// The position at a part t of the way, 0 to 1.
    #[must_use]
    pub fn at(&self, t: f64) -> PerLetter {
        if t <= 0.0 {
            return self.from;
        }
        if t >= 1.0 {
            return self.to;
        }
        let mut at: PerLetter =
            std::array::from_fn(|i| self.from[i] + t * (self.to[i] - self.from[i]));
        let [i, j, _] = self.axes;
        let begin = libm::atan2(self.from[j] - self.centre[1], self.from[i] - self.centre[0]);
        let [r0, r1] = self.radii();
        let radius = r0 + t * (r1 - r0);
        let (sine, cosine) = libm::sincos(begin + t * self.sweep);
        at[i] = self.centre[0] + radius * cosine;
        at[j] = self.centre[1] + radius * sine;
        at
    }

    /// The way per part of it, at a part t.
    #[must_use]
    pub fn slope(&self, t: f64) -> PerLetter {
        let mut slope: PerLetter = std::array::from_fn(|i| self.to[i] - self.from[i]);
        let [i, j, _] = self.axes;
        let begin = libm::atan2(self.from[j] - self.centre[1], self.from[i] - self.centre[0]);
        let [r0, r1] = self.radii();
        let radius = r0 + t * (r1 - r0);
        let (sine, cosine) = libm::sincos(begin + t * self.sweep);
        slope[i] = (r1 - r0) * cosine - radius * self.sweep * sine;
        slope[j] = (r1 - r0) * sine + radius * self.sweep * cosine;
        slope
    }

    /// Parts of the way at which an axis of the plane turns round, in order.
    #[must_use]
    pub fn turns_round(&self) -> Vec<f64> {
        let [i, j, _] = self.axes;
        let begin = libm::atan2(self.from[j] - self.centre[1], self.from[i] - self.centre[0]);
        let quarter = TAU / 4.0;
        let (low, high) = (begin.min(begin + self.sweep), begin.max(begin + self.sweep));
        let first = (low / quarter).ceil() as i64;
        let last = (high / quarter).floor() as i64;
        let mut parts: Vec<f64> = (first..=last)
            .map(|n| (n as f64 * quarter - begin) / self.sweep)
            .filter(|t| *t > 1e-9 && *t < 1.0 - 1e-9)
            .collect();
        ascending(&mut parts);
        parts
    }

    /// Length (mm), with the other linear axes.
    #[must_use]
    pub fn length(&self) -> f64 {
        let [r0, r1] = self.radii();
        let mut square = (self.sweep * 0.5 * (r0 + r1)).powi(2);
        for axis in 0..COUNT {
            if !self.axes[..2].contains(&axis) && !is_rotary(axis) && axis < 3 {
                square += (self.to[axis] - self.from[axis]).powi(2);
            }
        }
        square.sqrt()
    }

    /// How many turns it begins.
    #[must_use]
    pub fn turns(&self) -> u32 {
        (self.sweep.abs() / TAU - 1e-9).ceil().max(1.0) as u32
    }

    /// The axes of the plane (bits) of one that ends where it begins in the plane, otherwise none.
    #[must_use]
    pub fn closed(&self) -> u16 {
        let [i, j, _] = self.axes;
        let meets = |axis: usize| self.from[axis] == self.to[axis];
        match meets(i) && meets(j) {
            true => 1 << i | 1 << j,
            false => 0,
        }
    }
}

/// The centre of an arc by its radius (negative: more than half a turn); the cause if there is none.
pub(crate) fn centre_by_radius(
    from: [f64; 2],
    to: [f64; 2],
    radius: f64,
    clockwise: bool,
) -> Result<[f64; 2], String> {
    let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    let chord = libm::hypot(dx, dy);
    if chord < 1e-9 {
        return Err(
            "an arc by its radius whose ends are the same: its centre is undefined".to_owned(),
        );
    }
    let half = 0.5 * chord;
    let r = radius.abs();
    // What rounded words may be off, of a half circle.
    if half > r + 0.01 {
        return Err(format!(
            "the radius does not fit: it is {r:.4} mm, and the ends are {chord:.4} mm apart"
        ));
    }
    let height = (r * r - half * half).max(0.0).sqrt();
    // To the left of the way for the smaller arc that turns counterclockwise.
    let side = if clockwise == (radius > 0.0) {
        -1.0
    } else {
        1.0
    };
    let middle = [from[0] + 0.5 * dx, from[1] + 0.5 * dy];
    Ok([
        middle[0] - side * height * dy / chord,
        middle[1] + side * height * dx / chord,
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(x: f64, y: f64, z: f64) -> PerLetter {
        let mut at = [0.0; COUNT];
        at[..3].copy_from_slice(&[x, y, z]);
        at
    }

    #[test]
    fn a_helix_passes_its_quarters_and_ends_where_it_should() {
        let arc = Arc::new(
            point(10.0, 0.0, 0.0),
            point(10.0, 0.0, 8.0),
            [0, 1, 2],
            [0.0, 0.0],
            false,
            2,
        );
        assert!((arc.sweep - 2.0 * TAU).abs() < 1e-15);
        let quarter = arc.at(0.125);
        for (at, expected) in quarter.iter().zip([0.0, 10.0, 1.0]) {
            assert!((at - expected).abs() < 1e-12);
        }
        let rounds = arc.turns_round();
        assert_eq!(rounds.len(), 7);
        assert!((rounds[0] - 0.125).abs() < 1e-15);
        let expected = libm::hypot(2.0 * TAU * 10.0, 8.0);
        assert!((arc.length() - expected).abs() < 1e-12);
    }

    #[test]
    fn a_radius_gives_the_centre_of_the_smaller_or_the_larger_arc() {
        let (from, to) = ([0.0, 0.0], [10.0, 10.0]);
        for (radius, clockwise, expected) in [
            (10.0, false, [0.0, 10.0]),
            (10.0, true, [10.0, 0.0]),
            (-10.0, false, [10.0, 0.0]),
            (-10.0, true, [0.0, 10.0]),
        ] {
            let centre = centre_by_radius(from, to, radius, clockwise).unwrap();
            for (at, expected) in centre.iter().zip(expected) {
                assert!((at - expected).abs() < 1e-12, "{radius} {clockwise}");
            }
            let arc = Arc::new(
                point(0.0, 0.0, 0.0),
                point(10.0, 10.0, 0.0),
                [0, 1, 2],
                centre,
                clockwise,
                1,
            );
            assert_eq!(arc.sweep.abs() < 3.2, radius > 0.0);
        }
        assert!(centre_by_radius(from, to, 7.0, true).is_err());
        assert!(centre_by_radius(from, from, 7.0, true).is_err());
    }
}

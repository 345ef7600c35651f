//! The path of Figure 4.11: half meridians of a hemisphere, each travelled both ways, and the equator between them.

use std::fmt::Write;

/// A hemisphere over the equator of X and Y, about the program's zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hemisphere {
    /// Length of the bar (mm).
    pub radius: f64,
    /// Number of half meridians, evenly spaced over half a turn.
    pub meridians: u32,
    /// Steps per half meridian.
    pub steps: u32,
}

/// A point of the path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathPoint {
    /// X, Y and Z relative to the centre (mm).
    pub at: [f64; 3],
    /// False where the bar is being engaged or disengaged.
    pub is_read: bool,
}

/// The steps do not place a point on every meridian.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{steps} steps of half a meridian are no whole number of steps between {meridians} meridians, or odd"
)]
pub struct Uneven {
    meridians: u32,
    steps: u32,
}

/// Distance outside the sphere at which the bar is engaged and disengaged (mm), and distance inside it while feeding
/// in.
const OUTSIDE: [f64; 3] = [0.6, 0.4, 0.2];
const INSIDE: f64 = -0.2;

impl Default for Hemisphere {
    /// The path of the document: a bar of 150 mm, five meridians, steps of 0.1 degrees.
    fn default() -> Self {
        Self {
            radius: 150.0,
            meridians: 5,
            steps: 1800,
        }
    }
}

impl Hemisphere {
    /// A point from azimuth and elevation above the equator (deg), and its distance outside the sphere (mm).
    fn place(&self, azimuth: f64, height: f64, outside: f64, is_read: bool) -> PathPoint {
        let (sine, cosine) = libm::sincos(azimuth.to_radians());
        let (up, flat) = libm::sincos(height.to_radians());
        PathPoint {
            at: [flat * cosine, flat * sine, up].map(|part| (self.radius + outside) * part),
            is_read,
        }
    }

    /// The path: engagement; every meridian both ways, feeding in at the top of the middle one; along the equator to
    /// the next one; disengagement. With the document's numbers it has 19 809 points.
    ///
    /// # Errors
    /// [`Uneven`]: the next meridian does not start after a whole number of steps, or there is no step at the top.
    pub fn path(&self) -> Result<Vec<PathPoint>, Uneven> {
        let Self {
            meridians, steps, ..
        } = *self;
        if meridians == 0 || steps == 0 || !steps.is_multiple_of(meridians) || steps % 2 == 1 {
            return Err(Uneven { meridians, steps });
        }
        let degrees = |step: u32| 180.0 * f64::from(step) / f64::from(steps);
        let mut path = Vec::new();
        path.extend(OUTSIDE.map(|outside| self.place(0.0, 0.0, outside, false)));
        path.push(self.place(0.0, 0.0, 0.0, true));
        let between = steps / meridians;
        for meridian in 0..meridians {
            let azimuth = degrees(meridian * between);
            for step in 1..=steps {
                path.push(self.place(azimuth, degrees(step), 0.0, true));
                if meridian == meridians / 2 && step == steps / 2 {
                    path.extend([INSIDE, 0.0].map(|out| self.place(azimuth, 90.0, out, false)));
                }
            }
            let back = (0..steps).rev();
            path.extend(back.map(|step| self.place(azimuth, degrees(step), 0.0, true)));
            let next = 1..=between;
            path.extend(next.map(|step| self.place(azimuth + degrees(step), 0.0, 0.0, true)));
        }
        let last = OUTSIDE.into_iter().rev();
        path.extend(last.map(|outside| self.place(180.0, 0.0, outside, false)));
        Ok(path)
    }
}

/// The path as a program: words with four decimals, zero at the centre (G54), at a feed rate in mm/min.
#[must_use]
pub fn program(path: &[PathPoint], feed: f64) -> String {
    let mut text = String::from("%\nG21 G90 G17 G94 G54\n");
    for (number, PathPoint { at: [x, y, z], .. }) in path.iter().enumerate() {
        match number {
            0 => text += "G0 ",
            1 => {
                let _ = write!(text, "G1 F{feed} ");
            }
            _ => {}
        }
        // Avoids negative zeros.
        let [x, y, z] = [x, y, z].map(|word| (word * 1e4).round() / 1e4 + 0.0);
        let _ = writeln!(text, "X{x:.4} Y{y:.4} Z{z:.4}");
    }
    text + "M30\n%\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_path_of_the_document_has_its_19809_places() {
        let path = Hemisphere::default().path().unwrap();
        assert_eq!(path.len(), 19_809);
        for PathPoint { at, is_read } in &path {
            let distance = at.iter().map(|c| c * c).sum::<f64>().sqrt();
            assert!((distance - 150.0).abs() < if *is_read { 1e-10 } else { 0.61 });
            assert!(at[2] >= -1e-10, "a hemisphere");
        }
        // A step is 0.1 degrees, on meridians and on the equator.
        let read: Vec<_> = path.iter().filter(|place| place.is_read).collect();
        for pair in read.windows(2) {
            let square: f64 = (0..3)
                .map(|i| (pair[1].at[i] - pair[0].at[i]).powi(2))
                .sum();
            let step = 300.0 * libm::sin((0.05_f64).to_radians());
            assert!((square.sqrt() - step).abs() < 1e-9, "{pair:?}");
        }
    }

    #[test]
    fn meridians_that_steps_do_not_meet_are_refused() {
        for (meridians, steps) in [(7, 1800), (0, 10), (5, 0), (5, 15)] {
            let uneven = Hemisphere {
                meridians,
                steps,
                ..Hemisphere::default()
            };
            assert!(uneven.path().is_err(), "{meridians} {steps}");
        }
        let one = Hemisphere {
            meridians: 1,
            steps: 4,
            radius: 1.0,
        };
        let text = program(&one.path().unwrap(), 200.0);
        assert!(text.contains("\nG0 X1.6000 Y0.0000 Z0.0000\nG1 F200 X1.4000 Y0.0000 Z0.0000\n"));
        assert!(text.contains("X0.0000 Y0.0000 Z1.0000\nX0.0000 Y0.0000 Z0.8000\n"));
    }
}

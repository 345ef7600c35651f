//! Evaluates readings of a ball-bar on a sphere: setup, size and form (Eqs. 15 to 17, Table 4-4).

use nalgebra::{Matrix4, Vector3, Vector4};
use trueaxis_model::numbers::extremes;

/// There are fewer readings, or readings in fewer directions, than unknowns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the readings do not determine both centre and radius")]
pub struct TooFew;

/// The least-squares sphere, or circle, through points.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedSphere {
    /// Centre of the least-squares sphere.
    pub centre: Vector3<f64>,
    /// Radius of the least-squares sphere.
    pub radius: f64,
    /// Distance of each point from the centre, minus the radius.
    pub residuals: Vec<f64>,
}

impl FittedSphere {
    /// Largest minus smallest residual.
    #[must_use]
    pub fn range(&self) -> f64 {
        let [low, high] = extremes(self.residuals.iter().copied());
        high - low
    }

    /// The standard deviation of the residuals.
    #[must_use]
    pub fn deviation(&self) -> f64 {
        let count = self.residuals.len() as f64;
        let mean = self.residuals.iter().sum::<f64>() / count;
        let squares: f64 = self.residuals.iter().map(|r| (r - mean).powi(2)).sum();
        (squares / (count - 1.0)).sqrt()
    }
}

/// Largest number of Gauss–Newton steps: each reduces the error by a factor of the last step divided by the radius.
const STEPS: usize = 30;
/// Singular values (squares here) below this fraction of the largest count as zero: the points lie in a plane.
const FLAT: f64 = 1e-10;
/// A step below this fraction of the radius is rounding.
const STILL: f64 = 1e-14;

/// Fits a sphere by least squares of the distances. If all points are in a plane, fits a circle in it; the centre
/// stays in the plane, starting from its point nearest to zero.
///
/// # Errors
/// [`TooFew`].
pub fn fitted(points: &[Vector3<f64>]) -> Result<FittedSphere, TooFew> {
    let count = points.len() as f64;
    if points.len() < 3 {
        return Err(TooFew);
    }
    let mut centre = points.iter().sum::<Vector3<f64>>() / count;
    // The mean of a hemisphere is half a radius above its centre, so first estimate the centre.
    let mut radius = points.iter().map(|p| (p - centre).norm()).sum::<f64>() / count;
    for _ in 0..STEPS {
        let (normal, wanted) = linearized(points, &centre, radius)?;
        let svd = normal.svd(true, true);
        let least = FLAT * svd.singular_values.max();
        // A plane has one singular value of zero; a line has more.
        if svd.singular_values.iter().filter(|s| **s > least).count() < 3 {
            return Err(TooFew);
        }
        let step = svd.solve(&wanted, least).map_err(|_| TooFew)?;
        centre += step.xyz();
        radius += step.w;
        if !(radius > 0.0 && radius.is_finite()) {
            return Err(TooFew);
        }
        if step.norm() < STILL * radius {
            break;
        }
    }
    let residuals = points.iter().map(|p| (p - centre).norm() - radius);
    Ok(FittedSphere {
        centre,
        radius,
        residuals: residuals.collect(),
    })
}

/// The normal equations of the next step.
fn linearized(
    points: &[Vector3<f64>],
    centre: &Vector3<f64>,
    radius: f64,
) -> Result<(Matrix4<f64>, Vector4<f64>), TooFew> {
    let mut normal = Matrix4::zeros();
    let mut wanted = Vector4::zeros();
    for point in points {
        let off = point - centre;
        let distance = off.norm();
        if distance == 0.0 {
            return Err(TooFew);
        }
        let row = Vector4::new(off.x / distance, off.y / distance, off.z / distance, 1.0);
        normal += row * row.transpose();
        wanted += row * (distance - radius);
    }
    Ok((normal, wanted))
}

/// Results from readings of a ball-bar.
#[derive(Clone, Debug, PartialEq)]
pub struct Sphere {
    /// The setup of Eq. 16: position of the tool's centre of motion relative to the workpiece ball (mm, in X, Y and
    /// Z).
    pub setup: [f64; 3],
    /// Readings with the setup removed (mm), Eq. 17.
    pub without_setup: Vec<f64>,
    /// Size error (mm): radius of the fitted sphere minus the nominal one (Table 4-4).
    pub size: f64,
    /// The sphere fitted to the readings; its residuals are the form error.
    pub fitted: FittedSphere,
}

impl Sphere {
    /// Evaluates readings: nominal directions of the bar (unit vectors), and its length minus `radius` (mm).
    ///
    /// # Errors
    /// [`TooFew`].
    pub fn of(radius: f64, readings: &[(Vector3<f64>, f64)]) -> Result<Self, TooFew> {
        let mut normal = nalgebra::Matrix3::zeros();
        let mut wanted = Vector3::zeros();
        for (direction, reading) in readings {
            normal += direction * direction.transpose();
            wanted += direction * *reading;
        }
        let svd = normal.svd(true, true);
        let least = FLAT * svd.singular_values.max();
        let setup = svd.solve(&wanted, least).map_err(|_| TooFew)?;
        let without = readings.iter().map(|(d, reading)| reading - d.dot(&setup));
        let points = readings.iter().map(|(d, reading)| d * (radius + reading));
        let fitted = fitted(&points.collect::<Vec<_>>())?;
        Ok(Self {
            setup: setup.into(),
            without_setup: without.collect(),
            size: fitted.radius - radius,
            fitted,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::Hemisphere;
    use super::*;

    fn directions() -> Vec<Vector3<f64>> {
        let few = Hemisphere {
            radius: 1.0,
            meridians: 5,
            steps: 60,
        };
        let path = few.path().unwrap();
        let read = path.iter().filter(|place| place.is_read);
        read.map(|place| Vector3::from(place.at).normalize())
            .collect()
    }

    /// Exact readings of a sphere with another radius and centre.
    fn elsewhere(centre: Vector3<f64>, radius: f64, nominal: f64) -> Vec<(Vector3<f64>, f64)> {
        let all = directions().into_iter();
        all.map(|d| {
            let along = d.dot(&centre);
            let across = centre.norm_squared() - along * along;
            (d, along + (radius * radius - across).sqrt() - nominal)
        })
        .collect()
    }

    #[test]
    fn a_sphere_that_is_elsewhere_and_larger_has_no_form_error() {
        let centre = Vector3::new(0.03, -0.05, 0.02);
        let found = Sphere::of(150.0, &elsewhere(centre, 150.0193, 150.0)).unwrap();
        // f64 positions of 150 mm are accurate to 3e-14 mm, sums of 600 somewhat less.
        assert!((found.size - 0.0193).abs() < 1e-11, "{}", found.size);
        assert!((found.fitted.centre - centre).norm() < 1e-11);
        assert!(found.fitted.range() < 1e-11);
    }

    #[test]
    fn the_setup_of_the_document_is_taken_out_as_its_equations_say() {
        // Without other errors the linear setup is the centre, up to its square divided by twice the radius.
        let centre = Vector3::new(0.01, -0.02, 0.015);
        let found = Sphere::of(150.0, &elsewhere(centre, 150.0, 150.0)).unwrap();
        assert!((Vector3::from(found.setup) - centre).norm() < 0.03_f64.powi(2) / 150.0);
        let most = found
            .without_setup
            .iter()
            .fold(0.0_f64, |m, r| m.max(r.abs()));
        assert!(most < 0.03_f64.powi(2) / 150.0, "{most}");
    }

    #[test]
    fn form_is_what_no_sphere_explains() {
        let mut readings = elsewhere(Vector3::zeros(), 10.0, 10.0);
        let wave = |d: &Vector3<f64>| 1e-3 * (d.x * d.y);
        for (direction, reading) in &mut readings {
            *reading += wave(direction);
        }
        let found = Sphere::of(10.0, &readings).unwrap();
        let waves = readings.iter().map(|(d, _)| wave(d));
        let (low, high) = waves.fold((f64::MAX, f64::MIN), |(l, h), w| (l.min(w), h.max(w)));
        // A product of x and y is orthogonal to every sphere on evenly distributed directions; these nearly are.
        assert!((found.fitted.range() / (high - low) - 1.0).abs() < 0.1);
        assert!(found.fitted.deviation() < 0.5 * found.fitted.range());
    }

    #[test]
    fn a_circle_is_fitted_in_its_plane_and_a_line_is_refused() {
        let circle = |k: f64| Vector3::new(3.0 + 2.0 * libm::cos(k), 1.0 + 2.0 * libm::sin(k), 0.0);
        let points: Vec<_> = (0..40).map(|k| circle(0.15 * f64::from(k))).collect();
        let found = fitted(&points).unwrap();
        assert!((found.centre - Vector3::new(3.0, 1.0, 0.0)).norm() < 1e-12);
        assert!((found.radius - 2.0).abs() < 1e-12);
        let line: Vec<_> = (0..9).map(|k| Vector3::x() * f64::from(k)).collect();
        assert_eq!(fitted(&line), Err(TooFew));
        assert_eq!(fitted(&points[..2]), Err(TooFew));
    }
}

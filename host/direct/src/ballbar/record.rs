//! What a ball-bar shows, as it is written for programs and read by people, in µm.

use super::{BallBarTurns, Circle, CircleError, Sphere, TooFew};
use nalgebra::Vector3;
use serde::Serialize;
use trueaxis_model::numbers::extremes;

/// Results on a sphere.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SphereRecord {
    /// Number of readings.
    pub readings: usize,
    /// Place of the centre, in X, Y and Z (source document, Eq. 16).
    pub setup_um: [f64; 3],
    /// Largest minus smallest reading, with the setup removed (Eq. 17).
    pub range_um: f64,
    /// Root mean square of the same readings.
    pub rms_um: f64,
    /// Mean radius, less the length of the bar (Table 4-4).
    pub size_um: f64,
    /// Largest minus smallest distance from the fitted sphere.
    pub form_um: f64,
    /// Standard deviation of the same distances.
    pub form_deviation_um: f64,
}

impl SphereRecord {
    /// Evaluates readings (mm) in directions, taken with a bar of length `radius` (mm).
    ///
    /// # Errors
    /// [`TooFew`] readings, or none in some directions.
    pub fn of(radius: f64, readings: &[(Vector3<f64>, f64)]) -> Result<Self, TooFew> {
        let found = Sphere::of(radius, readings)?;
        let left = &found.without_setup;
        let [low, high] = extremes(left.iter().copied());
        let squares: f64 = left.iter().map(|r| r * r).sum();
        Ok(Self {
            readings: readings.len(),
            setup_um: found.setup.map(um),
            range_um: um(high - low),
            rms_um: um((squares / left.len() as f64).sqrt()),
            size_um: um(found.size),
            form_um: um(found.fitted.range()),
            form_deviation_um: um(found.fitted.deviation()),
        })
    }
}

/// Results on circles to ISO 230-4. Pairs are counter-clockwise and clockwise; `None` for a direction that was not read.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CircleRecord {
    /// Letters of both axes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plane: Option<String>,
    /// Number of readings.
    pub readings: usize,
    /// Centre, from the nominal one.
    pub centre_um: [f64; 2],
    /// Mean radius, less the length of the bar.
    pub size_um: f64,
    /// Circular deviation G, about the centre of the smallest band.
    pub g_um: [Option<f64>; 2],
    /// Circular deviation about the centre of the least-squares circle.
    pub g_least_squares_um: [Option<f64>; 2],
    /// Of both directions together.
    pub g_bidirectional_um: Option<f64>,
    /// Largest radial deviation F.
    pub f_max_um: f64,
    /// Smallest radial deviation F.
    pub f_min_um: f64,
    /// Smallest and largest F of each direction.
    pub f_um: [Option<[f64; 2]>; 2],
    /// Circular hysteresis H.
    pub h_um: Option<f64>,
}

impl CircleRecord {
    /// Evaluates circles measured with a bar of length `radius` (mm).
    ///
    /// # Errors
    /// [`CircleError`]: too few readings, or a part of the circle without any.
    pub fn of(radius: f64, plane: Option<&str>, turns: &BallBarTurns) -> Result<Self, CircleError> {
        let found = Circle::of(radius, turns)?;
        let [f_max_um, f_min_um] = found.radial.map(um);
        Ok(Self {
            plane: plane.map(str::to_owned),
            readings: turns.counter_clockwise.len() + turns.clockwise.len(),
            centre_um: found.centre.map(um),
            size_um: um(found.size),
            g_um: found.deviation.map(|g| g.map(um)),
            g_least_squares_um: found.least_squares.map(|g| g.map(um)),
            g_bidirectional_um: found.bidirectional.map(um),
            f_max_um,
            f_min_um,
            f_um: (found.radial_of_turn).map(|f| f.map(|[high, low]| [um(low), um(high)])),
            h_um: found.hysteresis.map(um),
        })
    }
}

/// Converts mm to µm, rounded to 0.1 nm, with no negative zero.
fn um(mm: f64) -> f64 {
    (mm * 1e7).round() / 1e4 + 0.0
}

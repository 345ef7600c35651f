//! The results of `trueaxis ballbar`.

use super::super::bad_input::BadInput;
use super::super::files;
use nalgebra::Vector3;
use serde::Serialize;
use trueaxis_measure::ballbar::{BallBarTurns, Circle, Sphere};

/// The results as JSON; the text output is made from the same struct.
#[derive(Default, Serialize)]
pub struct BallbarAnswer<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub machine: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub before: Option<OnSphere>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub after: Option<OnSphere>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured: Option<OnSphere>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub circle: Option<OnCircle>,
}

/// Results on a sphere (µm).
#[derive(Serialize)]
pub struct OnSphere {
    readings: usize,
    /// Eq. 16, in X, Y and Z.
    setup_um: [f64; 3],
    /// Largest minus smallest reading, with the setup removed (Eq. 17).
    range_um: f64,
    /// Root mean square of the same readings.
    rms_um: f64,
    /// Table 4-4.
    size_um: f64,
    form_um: f64,
    form_deviation_um: f64,
}

impl OnSphere {
    /// Evaluates readings (mm) taken with a bar of length `radius` (mm).
    pub fn of(radius: f64, readings: &[(Vector3<f64>, f64)]) -> Result<Self, BadInput> {
        let found = Sphere::of(radius, readings).map_err(|error| {
            BadInput::new(
                error.to_string(),
                "read the bar in directions all over a hemisphere: the path of `trueaxis ballbar path` does",
            )
        })?;
        let left = &found.without_setup;
        let fold = |start: f64, f: fn(f64, f64) -> f64| left.iter().copied().fold(start, f);
        let squares: f64 = left.iter().map(|r| r * r).sum();
        Ok(Self {
            readings: readings.len(),
            setup_um: found.setup.map(um),
            range_um: um(fold(f64::NEG_INFINITY, f64::max) - fold(f64::INFINITY, f64::min)),
            rms_um: um((squares / left.len() as f64).sqrt()),
            size_um: um(found.size),
            form_um: um(found.fitted.range()),
            form_deviation_um: um(found.fitted.deviation()),
        })
    }
}

/// Results on circles (µm), ISO 230-4.
#[derive(Serialize)]
pub struct OnCircle {
    #[serde(skip_serializing_if = "Option::is_none")]
    plane: Option<String>,
    readings: usize,
    centre_um: [f64; 2],
    size_um: f64,
    /// G counter-clockwise and clockwise: from the smallest band, and about the least-squares circle.
    g_um: [Option<f64>; 2],
    g_least_squares_um: [Option<f64>; 2],
    /// G of both directions together.
    g_bidirectional_um: Option<f64>,
    f_max_um: f64,
    f_min_um: f64,
    /// F counter-clockwise and clockwise: smallest and largest.
    f_um: [Option<[f64; 2]>; 2],
    h_um: Option<f64>,
}

impl OnCircle {
    /// Evaluates circles measured with a bar of length `radius` (mm).
    pub fn of(radius: f64, plane: Option<&str>, turns: &BallBarTurns) -> Result<Self, BadInput> {
        let found = Circle::of(radius, turns).map_err(|error| {
            BadInput::new(
                error.to_string(),
                "read the bar all around, in each direction that is in the file",
            )
        })?;
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

impl BallbarAnswer<'_> {
    pub fn print(&self, json: bool) -> Result<(), BadInput> {
        if json {
            return files::print_json(self);
        }
        let mut text = String::new();
        let spheres = [
            ("before", &self.before),
            ("after", &self.after),
            ("measured", &self.measured),
        ];
        let spheres: Vec<(&str, &OnSphere)> = spheres
            .into_iter()
            .filter_map(|(name, found)| Some((name, found.as_ref()?)))
            .collect();
        if let Some((_, first)) = spheres.first() {
            text += &format!("hemisphere, {} readings (µm)\n", first.readings);
            text += &format!(
                "{:9} {:>9} {:>9} {:>9} {:>9} {:>9}   setup\n",
                "", "size", "form", "form std", "range", "rms"
            );
        }
        for (name, found) in spheres {
            let [x, y, z] = found.setup_um;
            text += &format!(
                "{name:9} {:>9.3} {:>9.3} {:>9.3} {:>9.3} {:>9.3}   X {x:.3}, Y {y:.3}, Z {z:.3}\n",
                found.size_um, found.form_um, found.form_deviation_um, found.range_um, found.rms_um
            );
        }
        if let Some(circle) = &self.circle {
            circle.print(&mut text);
        }
        files::print(&text)
    }
}

impl OnCircle {
    fn print(&self, text: &mut String) {
        let plane = self.plane.as_deref();
        let of = plane.map_or(String::new(), |plane| format!("({plane})"));
        *text += &format!("circle {of}, {} readings (µm)\n", self.readings);
        let turns = self.g_um.iter().zip(self.g_least_squares_um);
        for ((g, squares), name) in turns.zip(["counter-clockwise", "clockwise"]) {
            if let (Some(g), Some(squares)) = (g, squares) {
                *text += &format!(
                    "  G{of} {name:18} {g:>9.3}   about the circle of least squares {squares:.3}\n"
                );
            }
        }
        if let Some(both) = self.g_bidirectional_um {
            *text += &format!("  G{of} {:18} {both:>9.3}\n", "both together");
        }
        let is_both = self.f_um.iter().all(Option::is_some);
        let turns = self.f_um.iter().flatten().filter(|_| is_both);
        for ([low, high], name) in turns.zip(["counter-clockwise", "clockwise"]) {
            *text += &format!("  F{of} {name:18} {low:>9.3} to {high:.3}\n");
        }
        *text += &format!(
            "  F{of} {:18} {:>9.3} to {:.3}, mean {:.3}\n",
            "", self.f_min_um, self.f_max_um, self.size_um
        );
        if let Some(h) = self.h_um {
            *text += &format!("  H{of} {:18} {h:>9.3}\n", "");
        }
        let [a, b] = self.centre_um;
        *text += &format!("  centre at {a:.3}, {b:.3} from the nominal one\n");
    }
}

//! The results of `trueaxis ballbar`.

use super::super::bad_input::BadInput;
use super::super::output;
use serde::Serialize;
use trueaxis_direct::ballbar::{CircleError, CircleRecord, SphereRecord, TooFew};

/// The results as JSON; the text output is made from the same struct.
#[derive(Default, Serialize)]
pub struct BallbarAnswer<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub machine: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub before: Option<SphereRecord>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub after: Option<SphereRecord>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured: Option<SphereRecord>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub circle: Option<CircleRecord>,
}

/// Too few readings on a sphere.
pub fn bad_sphere(error: TooFew) -> BadInput {
    BadInput::new(
        error.to_string(),
        "read the bar in directions all over a hemisphere: the path of `trueaxis ballbar path` does",
    )
}

/// Too few readings on a circle.
pub fn bad_circle(error: CircleError) -> BadInput {
    BadInput::new(
        error.to_string(),
        "read the bar all around, in each direction that is in the file",
    )
}

impl BallbarAnswer<'_> {
    pub fn print(&self, json: bool) -> Result<(), BadInput> {
        if json {
            return output::print_json(self);
        }
        let mut text = String::new();
        let spheres = [
            ("before", &self.before),
            ("after", &self.after),
            ("measured", &self.measured),
        ];
        let spheres: Vec<(&str, &SphereRecord)> = spheres
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
            print_circle(circle, &mut text);
        }
        output::print(&text)
    }
}

/// Prints results on circles.
fn print_circle(circle: &CircleRecord, text: &mut String) {
    let plane = circle.plane.as_deref();
    let of = plane.map_or(String::new(), |plane| format!("({plane})"));
    *text += &format!("circle {of}, {} readings (µm)\n", circle.readings);
    let turns = circle.g_um.iter().zip(circle.g_least_squares_um);
    for ((g, squares), name) in turns.zip(["counter-clockwise", "clockwise"]) {
        if let (Some(g), Some(squares)) = (g, squares) {
            *text += &format!(
                "  G{of} {name:18} {g:>9.3}   about the circle of least squares {squares:.3}\n"
            );
        }
    }
    if let Some(both) = circle.g_bidirectional_um {
        *text += &format!("  G{of} {:18} {both:>9.3}\n", "both together");
    }
    let is_both = circle.f_um.iter().all(Option::is_some);
    let turns = circle.f_um.iter().flatten().filter(|_| is_both);
    for ([low, high], name) in turns.zip(["counter-clockwise", "clockwise"]) {
        *text += &format!("  F{of} {name:18} {low:>9.3} to {high:.3}\n");
    }
    *text += &format!(
        "  F{of} {:18} {:>9.3} to {:.3}, mean {:.3}\n",
        "", circle.f_min_um, circle.f_max_um, circle.size_um
    );
    if let Some(h) = circle.h_um {
        *text += &format!("  H{of} {:18} {h:>9.3}\n", "");
    }
    let [a, b] = circle.centre_um;
    *text += &format!("  centre at {a:.3}, {b:.3} from the nominal one\n");
}

//! What a qualification found, as it is written for programs and said in sentences.

use super::{Qualified, TouchSuspect};
use crate::probe_file::Lobe;
use crate::spheres::Touched;
use serde::Serialize;

/// A qualified probe.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct QualifiedRecord {
    /// Number of touches.
    pub touches: usize,
    /// Standard deviation of a touch.
    pub noise_um: f64,
    /// Effective radius of the tip.
    pub tip_radius_mm: f64,
    /// Standard uncertainty of the radius.
    pub tip_radius_standard_uncertainty_um: f64,
    /// What the radius is more at the pole.
    pub pole_um: f64,
    /// Standard uncertainty of `pole_um`.
    pub pole_standard_uncertainty_um: f64,
    /// Lobes of the probe across the stylus.
    pub lobes: Vec<LobeRecord>,
    /// Place of the tip, as far as the touches show it.
    pub tip_mm: [Option<f64>; 3],
    /// Standard uncertainty of that place.
    pub tip_standard_uncertainty_um: [Option<f64>; 3],
    /// Number of rotary positions.
    pub positions: usize,
    /// How far apart the centres of the ball are that they show (root mean square).
    pub ball_apart_um: Option<f64>,
    /// What the touches do not show.
    pub undetermined: Vec<String>,
    /// What does not fit.
    pub outliers: Vec<String>,
}

/// A lobe, from ball to tip.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LobeRecord {
    /// How often it repeats around the stylus.
    pub order: usize,
    /// Part with the cosine of the angle about the stylus.
    pub cosine_um: f64,
    /// Part with the sine of the angle about the stylus.
    pub sine_um: f64,
    /// Standard uncertainty of either.
    pub standard_uncertainty_um: f64,
}

fn um(mm: f64) -> f64 {
    mm * 1e3
}

impl QualifiedRecord {
    /// Of a qualification by the touches of a log.
    #[must_use]
    pub fn of(found: &Qualified, log: &[Touched]) -> Self {
        let file = &found.file;
        let lobe = |lobe: &Lobe| LobeRecord {
            order: lobe.order,
            cosine_um: um(lobe.cosine),
            sine_um: um(lobe.sine),
            standard_uncertainty_um: um(lobe.uncertainty),
        };
        Self {
            touches: found.touches,
            noise_um: um(found.noise),
            tip_radius_mm: file.radius,
            tip_radius_standard_uncertainty_um: um(file.radius_uncertainty),
            pole_um: um(file.shape.pole),
            pole_standard_uncertainty_um: um(file.pole_uncertainty),
            lobes: file.shape.lobes.iter().map(lobe).collect(),
            tip_mm: file.tip,
            tip_standard_uncertainty_um: found.tip_uncertainty.map(|value| value.map(um)),
            positions: found.positions,
            ball_apart_um: found.apart.map(um),
            undetermined: found.undetermined.iter().map(ToString::to_string).collect(),
            outliers: found.warnings(log),
        }
    }
}

impl Qualified {
    /// A sentence about everything that does not fit, with the line of the log.
    #[must_use]
    pub fn warnings(&self, log: &[Touched]) -> Vec<String> {
        let sentence = |outlier: &TouchSuspect| match outlier {
            TouchSuspect::Touch(touch, off) => format!(
                "line {}: this touch is {:+.1} µm from where the others put the ball: look at it, and remove it if it is wrong",
                log[*touch].line,
                um(*off)
            ),
            TouchSuspect::Moved(touch, by) => format!(
                "the ball was moved by {:.1} µm (x {:.1}, y {:.1}, z {:.1}) before line {}: look whether it is loose, and touch it again",
                um(by.norm()),
                um(by.x),
                um(by.y),
                um(by.z),
                log[*touch].line
            ),
        };
        let shift = self.shift.map(|shift| {
            format!(
                "from line {} on, the ball is seen {:.1} µm elsewhere (x {:.1}, y {:.1}, z {:.1}); with that the rotary positions agree to {:.1} µm instead of {:.1}: look whether it was moved; if it was not, the machine has an error that begins to matter there",
                log[shift.touch].line,
                um(shift.by.norm()),
                um(shift.by.x),
                um(shift.by.y),
                um(shift.by.z),
                um(shift.apart[1]),
                um(shift.apart[0])
            )
        });
        self.outliers.iter().map(sentence).chain(shift).collect()
    }
}

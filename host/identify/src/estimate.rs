//! Values of all unknowns, and what they leave of the readings.

use crate::instrument::Setting;
use nalgebra::Vector3;
use trueaxis_model::errors::ErrorModel;

/// Values of all unknowns.
#[derive(Clone, Debug)]
pub(crate) struct Estimate {
    /// The machine; boxed, because it is large for a stack.
    pub errors: Box<ErrorModel>,
    pub stylus: Vector3<f64>,
    pub balls: Vec<Vector3<f64>>,
    /// The set-ups of instruments, and the tool points that they observe.
    pub settings: Vec<Setting>,
    pub tools: Vec<Vector3<f64>>,
    /// Drift of the artefact (`None`) and of set-ups: along and about x, y and z (mm/h, rad/h), if it is looked for.
    pub drift: Vec<(Option<usize>, [f64; 6])>,
}

impl Estimate {
    /// The drift of the artefact or of a set-up, if it is looked for.
    pub fn drift_of(&self, source: Option<usize>) -> Option<[f64; 6]> {
        let mut all = self.drift.iter();
        all.find(|(of, _)| *of == source).map(|(_, drift)| *drift)
    }
}

/// The result for a probing: vector from the ball to the tip (mm, workpiece frame). For an observation of an
/// instrument: the reading that is expected less the actual one (mm; the components that it lacks are 0).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowResult {
    /// With the nominal machine, and balls and stylus fitted to it.
    pub before: Vector3<f64>,
    /// With the identified machine.
    pub after: Vector3<f64>,
    /// False if it fits so badly that it should be checked.
    pub is_trusted: bool,
}

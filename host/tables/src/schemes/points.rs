//! Points of a table whose values are known in closed form.

use trueaxis::{Direction, DraftBank, Interpolation, SampleFormat};
use trueaxis_model::machine::{Axis, Machine};

/// Points along an axis, as the runtime computes them.
pub struct Points {
    input: u8,
    start: f32,
    step: f32,
    modulo: bool,
    /// Their positions (mm, rad).
    pub at: Vec<f64>,
}

impl Points {
    /// Evenly spaced over the travel of an axis: with both ends, or over a whole period of an axis that rotates
    /// without limits, where the first point follows the last.
    pub fn over(machine: &Machine, axis: usize, count: usize) -> Self {
        let it: &Axis = &machine.axes[axis];
        let [low, high] = it.travel;
        let intervals = if it.modulo { count } else { count - 1 };
        let (start, step) = (low as f32, ((high - low) / intervals as f64) as f32);
        // Sample at the points that the runtime computes from start and step.
        let at = |k: usize| it.to_kinematic(f64::from(start) + k as f64 * f64::from(step));
        Self {
            input: axis as u8,
            start,
            step,
            modulo: it.modulo,
            at: (0..count).map(at).collect(),
        }
    }

    /// The two ends, for tables that are straight lines.
    pub fn ends(machine: &Machine, axis: usize) -> Self {
        Self::over(machine, axis, 2)
    }

    /// A bank of tables with these points; each column holds the values of one.
    pub fn bank(&self, format: SampleFormat, columns: Vec<Vec<f64>>) -> DraftBank {
        let column = |values: Vec<f64>| values.into_iter().map(|v| v as f32).collect();
        DraftBank {
            input: self.input,
            start: self.start,
            step: self.step,
            modulo: self.modulo,
            direction: Direction::Both,
            interpolation: Interpolation::Linear,
            format,
            columns: columns.into_iter().map(column).collect(),
        }
    }
}

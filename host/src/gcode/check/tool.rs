//! What the exact machine does with the tool, before and after.

use super::{Along, Check};
use crate::errors::{Situation, Switches};
use crate::gcode::axes::{self, COUNT, PerLetter};
use crate::gcode::trace::Lost;
use crate::kinematics::Htm;
use crate::machine::PerAxis;
use trueaxis::Travel;

impl Check<'_> {
    /// Errors of the tool where it should be at `q`, uncorrected and at what is written.
    pub(super) fn tool(
        &mut self,
        along: &Along<'_>,
        q: &PerLetter,
        at: &PerLetter,
    ) -> Result<(), Lost> {
        let Some((exact, kinematics)) = &self.exact else {
            return Ok(());
        };
        let machine = exact.machine;
        let moved = along.field.axes(at)?;
        let position = |q: &PerLetter| -> PerAxis {
            let mut position = [0.0; COUNT];
            for (place, axis) in machine.axes.iter().enumerate() {
                let letter = axes::index(axis.letter.char() as u8).unwrap_or_default();
                position[place] = axis.within_turn(q[letter]);
            }
            machine.to_kinematic(&position[..machine.axes.len()])
        };
        let mut situation = Situation::default();
        for (place, axis) in machine.axes.iter().enumerate() {
            let letter = axes::index(axis.letter.char() as u8).unwrap_or_default();
            // Where tables tell directions apart, both have turned when the hysteresis is passed.
            let way = match self.tables.directional & (1 << letter) {
                0 => self.all[letter],
                _ => along.travel.travel[letter],
            };
            situation.sign[place] = match way {
                Travel::Positive => 1.0,
                Travel::Negative => -1.0,
                Travel::Unknown => 0.0,
            };
        }
        situation.length = along.field.length;
        let nominal = kinematics.nominal(&position(q), situation.length);
        let actual = |q: &PerLetter| kinematics.actual(&position(q), &situation, &Switches::ALL);
        let error = |pose: &Htm| {
            let tip = (pose.t - nominal.t).norm() * 1e3;
            let (a, b) = (machine.direction(pose), machine.direction(&nominal));
            let off: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
            (tip, off.sqrt() * 1e6)
        };
        let (before, after) = (error(&actual(q)), error(&actual(&moved)));
        let path = self.found.tool_path.get_or_insert_default();
        if after.0 > self.spreads[1].largest() {
            path.worst_line = along.segment.line;
        }
        for (spread, value) in self
            .spreads
            .iter_mut()
            .zip([before.0, after.0, before.1, after.1])
        {
            spread.add(value);
        }
        Ok(())
    }
}

//! What the exact machine does with the tool, before and after.

use super::along::Along;
use super::{Check, CheckError};
use crate::axes::{self, COUNT, PerLetter};
use crate::program::Segment;
use crate::trace::{Field, Travels};
use trueaxis::Travel;
use trueaxis_model::errors::{Situation, Switches};
use trueaxis_model::kinematics::Htm;
use trueaxis_model::machine::{Machine, PerAxis};

/// Lengths that are the same (mm).
const SAME: f64 = 1e-3;

impl Check<'_> {
    /// Errors of the tool where it should be at `q`, uncorrected and at what is written.
    pub(super) fn tool(
        &mut self,
        field: &Field<'_>,
        segment: &Segment,
        travel: &Travels,
        q: &PerLetter,
        at: &PerLetter,
    ) -> Result<(), CheckError> {
        let Some((exact, kinematics)) = &self.exact else {
            return Ok(());
        };
        let machine = exact.machine;
        let moved = field.axes(at);
        let moved = moved.map_err(|_| CheckError::Outside(segment.line))?;
        self.play.come_to(&moved);
        let (planned, moved) = (positions(machine, q), positions(machine, &moved));
        let situation = Situation {
            sign: self.signs(machine, travel),
            length: segment.length,
            ..Situation::default()
        };
        let nominal = kinematics.nominal(&planned, situation.length);
        let actual = |at: &PerAxis| kinematics.actual(at, &situation, &Switches::ALL);
        let written = Situation {
            sign: self.signs_in_play(machine, &situation.sign),
            ..situation
        };
        let corrected = kinematics.actual(&moved, &written, &Switches::ALL);
        let own = machine.tool_length();
        if !self.tables.takes_length && situation.length.is_some_and(|l| (l - own).abs() > SAME) {
            let situation = Situation {
                length: None,
                ..situation
            };
            let nominal_own = kinematics.nominal(&planned, None);
            let own = kinematics.actual(&moved, &situation, &Switches::ALL);
            let other = actual(&moved).t - nominal.t;
            let um = (other - (own.t - nominal_own.t)).norm() * 1e3;
            if um > self.found.length_um {
                self.found.length_um = um;
                self.found.length_line = segment.line;
            }
        }
        let error = |pose: &Htm| {
            let tip = (pose.t - nominal.t).norm() * 1e3;
            let (a, b) = (machine.direction(pose), machine.direction(&nominal));
            let off: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
            (tip, off.sqrt() * 1e6)
        };
        let (before, after) = (error(&actual(&planned)), error(&corrected));
        let turned = (corrected.t - actual(&moved).t).norm() * 1e3;
        let path = self.found.tool_path.get_or_insert_default();
        path.turned_um = path.turned_um.max(turned);
        if after.0 > self.spreads[1].largest() {
            path.worst_line = segment.line;
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

    /// Which way each axis of the machine has moved last.
    fn signs(&self, machine: &Machine, travel: &Travels) -> PerAxis {
        let mut signs = PerAxis::default();
        for (place, axis) in machine.axes.iter().enumerate() {
            let letter = axes::of_machine(axis.letter);
            // Where tables tell directions apart, both have turned when the reversal threshold is passed.
            let way = match self.tables.directional & (1 << letter) {
                0 => self.all[letter],
                _ => travel[letter],
            };
            signs[place] = match way {
                Travel::Positive => 1.0,
                Travel::Negative => -1.0,
                Travel::Unknown => 0.0,
            };
        }
        signs
    }

    /// Like `signs`, where axes with play stand in it.
    fn signs_in_play(&self, machine: &Machine, signs: &PerAxis) -> PerAxis {
        let mut signs = *signs;
        if self.axes_turn() {
            for (sign, axis) in signs.iter_mut().zip(&machine.axes) {
                let letter = axes::of_machine(axis.letter);
                *sign = self.play.sign_of(letter).unwrap_or(*sign);
            }
        }
        signs
    }

    /// Which way every axis goes at a part of the way.
    pub(super) fn head(
        &mut self,
        along: &Along<'_>,
        segment: &Segment,
        t: f64,
    ) -> Result<(), CheckError> {
        if self.exact.is_none() {
            return Ok(());
        }
        let (from, to) = if t < 0.999 {
            (t, t + 0.001)
        } else {
            (t - 0.001, t)
        };
        let at = |t: f64| {
            let q = along.field.axes(&segment.path.at(t));
            q.map_err(|_| CheckError::Outside(segment.line))
        };
        let (from, to) = (at(from)?, at(to)?);
        for i in 0..COUNT {
            let by = to[i] - from[i];
            if by > 1e-9 {
                self.all[i] = Travel::Positive;
            } else if by < -1e-9 {
                self.all[i] = Travel::Negative;
            }
        }
        Ok(())
    }
}

/// Positions of the axes of a machine, as its kinematics take them.
fn positions(machine: &Machine, q: &PerLetter) -> PerAxis {
    let mut position = [0.0; COUNT];
    for (place, axis) in machine.axes.iter().enumerate() {
        let letter = axes::of_machine(axis.letter);
        position[place] = axis.within_turn(q[letter]);
    }
    machine.to_kinematic(&position[..machine.axes.len()])
}

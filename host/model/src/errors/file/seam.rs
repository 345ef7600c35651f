//! Checks that error motions of axes without limits close over the turn.

use super::{ErrorsFile, MotionPart, PartKind, unit};
use crate::errors::{ErrorModel, Parameter, ParameterKind, Situation, Switches};
use crate::machine::{Axis, Machine, PerAxis};
use crate::source::FileError;

/// Permitted difference at the seam (mm or rad); smaller ones are not visible in any table.
const CLOSED: f64 = 1e-9;
/// Part of the turn that a table may leave out (rad): rounding of degrees.
const COVERED: f64 = 1e-9;

impl ErrorModel {
    /// Refuses motions that jump at the seam of the turn, in any direction of travel or at any temperature.
    pub(super) fn check_seams(
        &self,
        file: &ErrorsFile,
        machine: &Machine,
    ) -> Result<(), FileError> {
        for (index, axis) in machine.axes.iter().enumerate().filter(|(_, a)| a.modulo) {
            let ends = axis.travel.map(|t| axis.to_kinematic(t));
            for component in 0..6 {
                let parts = self.parts(file, machine, index, component);
                let short = |p: &&MotionPart<'_>| match &p.kind {
                    PartKind::Table(table) => {
                        table.at.first().is_none_or(|a| *a > ends[0] + COVERED)
                            || table.at.last().is_none_or(|a| *a < ends[1] - COVERED)
                    }
                    _ => false,
                };
                if let Some(part) = parts.iter().find(short) {
                    let [low, high] = axis.travel;
                    return Err(FileError::at(
                        part.span.clone(),
                        format!(
                            "{} does not cover the turn of axis {}, which is endless",
                            part.name, axis.letter
                        ),
                        format!("not all of {low} to {high} deg"),
                        format!(
                            "give values from {low} to {high} deg, equal at both ends, where the position begins anew"
                        ),
                    ));
                }
                let gap = self.gap(machine, index, component, ends);
                if gap.abs() > CLOSED {
                    return Err(self.jump(axis, index, component, &parts, ends, gap));
                }
            }
        }
        Ok(())
    }

    /// The largest difference (mm or rad) between the ends of the turn, for any direction and sensor.
    fn gap(&self, machine: &Machine, index: usize, component: usize, ends: [f64; 2]) -> f64 {
        let mut situations = [-1.0, 1.0]
            .map(|sign| Situation {
                sign: PerAxis::from([sign; 6]),
                ..Situation::default()
            })
            .to_vec();
        for (sensor, thermal) in self.sensors.iter().enumerate() {
            let mut warm = Situation::default();
            warm.kelvin[sensor] = thermal.largest_kelvin();
            situations.push(warm);
        }
        let difference = |situation: &Situation| {
            let [low, high] = ends.map(|q| {
                let error = self.intra_at(machine, index, q, situation, &Switches::ALL);
                error.map_or(0.0, |e| e[component])
            });
            high - low
        };
        let gaps = situations.iter().map(difference);
        gaps.fold(
            0.0,
            |most, gap| if gap.abs() > most.abs() { gap } else { most },
        )
    }

    /// The error message, at the part with the largest jump.
    fn jump(
        &self,
        axis: &Axis,
        index: usize,
        component: usize,
        parts: &[MotionPart<'_>],
        ends: [f64; 2],
        gap: f64,
    ) -> FileError {
        let at = ends.map(|q| self.at_known(index, component, q));
        let opens = |p: &MotionPart<'_>| (p.kind.value(at[1]) - p.kind.value(at[0])).abs();
        let worst = parts.iter().max_by(|a, b| opens(a).total_cmp(&opens(b)));
        let name = worst.map_or("an error motion", |p| &p.name);
        let remedy = match worst.map(|p| &p.kind) {
            Some(PartKind::Table(_)) => {
                "make the first and the last value equal, in each direction of travel".to_owned()
            }
            _ => {
                let constant = Parameter {
                    component,
                    axis: axis.letter.char(),
                    kind: ParameterKind::Degree(0),
                };
                let motion = &constant.to_string()[..3];
                format!(
                    "use harmonics ({motion}c1, {motion}s1 …), which close, or a table whose first and last value are equal"
                )
            }
        };
        let (letter, [from, to]) = (axis.letter, axis.travel);
        FileError::at(
            worst.map_or(0..0, |p| p.span.clone()),
            format!(
                "{name} does not close over the turn of axis {letter}, which is endless: the error at {to} deg is {gap:.3e} {} off that at {from} deg",
                unit(component)
            ),
            format!("jumps at {letter} = {to} deg"),
            remedy,
        )
    }
}

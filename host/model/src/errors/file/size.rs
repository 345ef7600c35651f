//! Checks that errors are physically possible everywhere in the travel, at all temperatures.

use super::{ErrorsFile, MotionPart, PartKind, known, limit, unphysical};
use crate::errors::{ErrorModel, ParameterKind, Situation, Switches};
use crate::machine::{Machine, PerAxis};
use crate::source::FileError;

/// Number of positions along a travel at which sizes are checked.
const STEPS: u16 = 100;

impl ErrorModel {
    /// Refuses locations and motions outside the range of small errors.
    pub(super) fn check_size(&self, file: &ErrorsFile, machine: &Machine) -> Result<(), FileError> {
        self.check_locations(file, machine)?;
        for (index, axis) in machine.axes.iter().enumerate() {
            let [low, high] = axis.travel.map(|t| axis.to_kinematic(t));
            for step in 0..=STEPS {
                let q = low + (high - low) * f64::from(step) / f64::from(STEPS);
                let Some(largest) = self.largest(machine, index, q) else {
                    break;
                };
                // NaN counts as too large.
                let within = |component: usize| largest[component] <= limit(component);
                let Some(component) = (0..6).find(|c| !within(*c)) else {
                    continue;
                };
                return Err(self.too_large(file, machine, [index, component], q));
            }
        }
        Ok(())
    }

    /// An error of a component of an axis, at the part that contributes most at this position.
    fn too_large(
        &self,
        file: &ErrorsFile,
        machine: &Machine,
        [index, component]: [usize; 2],
        q: f64,
    ) -> FileError {
        let axis = &machine.axes[index];
        let parts = self.parts(file, machine, index, component);
        let held = self.at_known(index, component, q);
        let share = |p: &MotionPart<'_>| p.kind.value(held).abs();
        let worst = parts.iter().max_by(|a, b| share(a).total_cmp(&share(b)));
        let (span, name) = worst.map_or_else(
            || (file.machine.span(), format!("an error of {}", axis.letter)),
            |p| (p.span.clone(), p.name.clone()),
        );
        let mut error = unphysical(span, &name, component);
        let (place, unit) = (axis.to_command(q), axis.unit());
        error.label = format!("at {} = {place:.1} {unit}", axis.letter);
        error.remedy.push_str(match worst.map(|p| &p.kind) {
                    Some(PartKind::Change(..)) => {
                        "; range_kelvin is the temperature difference that must be covered"
                    }
                    _ => {
                        "; if it is a polynomial known in a part of the travel only, say where under [calibrated]"
                    }
                });
        error
    }

    /// Checks locations at the ends of the temperature ranges.
    fn check_locations(&self, file: &ErrorsFile, machine: &Machine) -> Result<(), FileError> {
        for (name, span, entry) in file.changes() {
            let parameter = known(name, machine)?;
            let cold = self.parameters.get(&parameter).copied().unwrap_or(0.0);
            let kelvin = self.largest_kelvin(entry);
            let largest = cold.abs() + entry.per_kelvin.abs() * kelvin;
            let component = parameter.component;
            if parameter.kind == ParameterKind::Inter && largest > limit(component) {
                let name = format!("the thermal change of {parameter}");
                let mut error = unphysical(span, &name, component);
                error.label = format!("at {kelvin} K from the reference");
                return Err(error);
            }
        }
        Ok(())
    }

    /// The largest magnitude of each component of an axis' error at a position (mm or rad), in either direction and
    /// at any temperature; `None` if it has no error motions.
    fn largest(&self, machine: &Machine, index: usize, q: f64) -> Option<[f64; 6]> {
        let at =
            |situation: &Situation| self.intra_at(machine, index, q, situation, &Switches::ALL);
        let cold = at(&Situation::default())?;
        // It is the sum of a part without dependence on direction and temperatures, and the contribution of each.
        let mut others = vec![Situation {
            sign: PerAxis::from([1.0; 6]),
            ..Situation::default()
        }];
        for (sensor, thermal) in self.sensors.iter().enumerate() {
            let mut warm = Situation::default();
            warm.kelvin[sensor] = thermal.largest_kelvin();
            others.push(warm);
        }
        let mut largest = cold.map(f64::abs);
        for other in others {
            let other = at(&other)?;
            for ((l, o), c) in largest.iter_mut().zip(other).zip(cold) {
                *l += (o - c).abs();
            }
        }
        Some(largest)
    }
}

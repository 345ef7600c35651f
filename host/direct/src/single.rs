//! Single readings of a glass scale, a dial and a square: one parameter from each.

use crate::square::candidates;
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind};
use trueaxis_model::explain::{Bench, BenchState, REACH, Sense};
use trueaxis_model::machine::Machine;

/// A reading, positive where the tool is farther in the direction of a positive command, seen from the workpiece. Axes
/// are linear ones, by index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Single {
    /// A glass scale or laser along an axis: the deviation per travel (mm per mm).
    Scale {
        /// The axis.
        axis: usize,
        /// Deviation per travel.
        slope: f64,
    },
    /// A dial along an axis: the reading after positive travel less that after negative travel (mm).
    Reversal {
        /// The axis.
        axis: usize,
        /// The difference (mm).
        difference: f64,
    },
    /// A square with one leg along `aligned`; a dial moved along the other leg by `moved` reads in the direction of
    /// `aligned` (mm per mm).
    Square {
        /// The axis along the first leg.
        aligned: usize,
        /// The axis that moves along the other leg.
        moved: usize,
        /// Reading per travel.
        slope: f64,
    },
}

/// Size of the parameter (rad, mm/mm) with which its effect is found; of a reversal in mm.
const SMALL: f64 = 1e-6;

impl Single {
    /// The parameter that explains a reading, with its value: the one that, alone, shows it on the exact model. `None`
    /// if none does, as on machines whose axes are not at right angles.
    #[must_use]
    pub fn parameter(&self, machine: &Machine) -> Option<(Parameter, f64)> {
        let own = |axis: usize, kind| {
            let letter = machine.axes[axis].letter;
            Parameter {
                component: letter.component(),
                axis: letter.char(),
                kind,
            }
        };
        let (candidates, read): (Vec<Parameter>, f64) = match *self {
            Self::Scale { axis, slope } => (vec![own(axis, ParameterKind::Degree(1))], slope),
            Self::Reversal { axis, difference } => {
                (vec![own(axis, ParameterKind::Backlash)], difference)
            }
            Self::Square {
                aligned,
                moved,
                slope,
            } => (candidates(machine, [aligned, moved]).collect(), slope),
        };
        let shown = candidates.into_iter().map(|parameter| {
            let mut errors = ErrorModel::perfect(machine);
            errors.set(machine, parameter, SMALL);
            (parameter, self.read(machine, &errors) / SMALL)
        });
        let mut shown = shown.filter(|(_, gain)| gain.abs() > 0.9);
        let (parameter, gain) = shown.next()?;
        Some((parameter, read / gain))
    }

    /// What the instrument shows on a machine with these errors, in the unit of the reading.
    #[must_use]
    pub fn read(&self, machine: &Machine, errors: &ErrorModel) -> f64 {
        let bench = Bench::new(machine, errors, Default::default());
        let home = BenchState::at(bench.home());
        match *self {
            Self::Scale { axis, .. } => {
                let [from, to] = bench.span(axis, bench.travel(axis));
                let ends = [from, to].map(|q| home.with(axis, q));
                let deviation = bench.deviation(&ends[0], &ends[1]);
                bench.reads(Sense::In(axis), &deviation, &ends[1].q) / (to - from)
            }
            Self::Reversal { axis, .. } => {
                let [mut before, mut after] = [home; 2];
                before.sign[axis] = -1.0;
                after.sign[axis] = 1.0;
                let deviation = bench.deviation(&before, &after);
                bench.reads(Sense::In(axis), &deviation, &after.q)
            }
            Self::Square { aligned, moved, .. } => {
                let span = bench.span(moved, bench.travel(moved));
                bench.square(aligned, moved, span).value / REACH
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two machines of `docs/src/measurement.md`, and its tables.
    #[test]
    fn signs_are_those_of_the_manual() {
        let router = include_str!("../../../examples/router/machine.toml");
        let mill = include_str!("../../../examples/mill-21/machine.toml");
        for (text, sign) in [(router, 1.0), (mill, -1.0)] {
            let machine = Machine::from_toml(text).unwrap();
            let index = |letter: char| {
                let is = |axis: &trueaxis_model::machine::Axis| axis.letter.char() == letter;
                machine.axes.iter().position(is).unwrap()
            };
            let [x, y, z] = ['X', 'Y', 'Z'].map(index);
            let square = |aligned, moved| Single::Square {
                aligned,
                moved,
                slope: 30e-6,
            };
            let scale = |axis, slope| Single::Scale { axis, slope };
            let reversal = Single::Reversal {
                axis: x,
                difference: 4e-3,
            };
            for (single, name, expected) in [
                (scale(x, 20e-6), "EXX1", sign * 20e-6),
                (scale(z, -20e-6), "EZZ1", -20e-6),
                (reversal, "EXXb", sign * 2e-3),
                (square(x, y), "EC0X", 30e-6),
                (square(y, x), "EC0X", 30e-6),
                (square(x, z), "EB0Z", 30e-6),
                (square(y, z), "EA0Z", -30e-6),
            ] {
                let (parameter, value) = single.parameter(&machine).unwrap();
                assert_eq!(parameter.to_string(), name);
                assert!(
                    (value - expected).abs() < 1e-9,
                    "{name}: {value}, not {expected}"
                );
                // A machine with it shows the reading.
                let mut errors = ErrorModel::perfect(&machine);
                errors.set(&machine, parameter, value);
                let read = single.read(&machine, &errors);
                let (Single::Scale { slope: shown, .. }
                | Single::Reversal {
                    difference: shown, ..
                }
                | Single::Square { slope: shown, .. }) = single;
                // The second order of 30 µrad.
                assert!((read - shown).abs() < 2e-9, "{name}: {read}, not {shown}");
            }
        }
    }
}

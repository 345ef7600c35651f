//! The error model: the errors of every axis as functions of its commanded position.

use crate::{
    Change, MAX_AXES, MAX_SENSORS, Machine, Motion, Parameter, ParameterKind, PerAxis, Table,
};
use heapless::Vec;

/// Quantities other than axis positions on which the errors depend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Situation {
    /// Direction of travel of each axis: +1, −1, or 0 if unknown.
    pub sign: PerAxis,
    /// Tool length (mm along the tool axis) that replaces the machine's own.
    pub length: Option<f64>,
    /// Temperature of each sensor relative to its reference (K).
    pub kelvin: [f64; MAX_SENSORS],
    /// Positions (mm, rad) that replace those at which the errors are evaluated when deciding whether a motion is
    /// outside its calibrated range and holds its end value, and which linear piece of a measured table applies.
    pub pieces_by: Option<PerAxis>,
}

impl Default for Situation {
    /// Unknown directions, the machine's own tool, all sensors at their reference temperatures.
    fn default() -> Self {
        Self {
            sign: [0.0; MAX_AXES],
            length: None,
            kelvin: [0.0; MAX_SENSORS],
            pieces_by: None,
        }
    }
}

/// Selects the axes whose error motions apply in full.
///
/// A linear axis that is switched off keeps the part that is affine in its position (constants and scales), a rotary
/// one its constant part. With all axes off, the reference correction is affine in every linear position and depends on
/// rotary positions through their sines and cosines only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Switches {
    /// The axes that are on.
    pub on: [bool; MAX_AXES],
    /// Constants that replace the omitted errors of an axis that is off (`[x y z a b c]`, mm, rad), so that the omitted
    /// part is small.
    pub instead: [[f64; 6]; MAX_AXES],
}

impl Switches {
    /// All error motions apply.
    pub const ALL: Self = Self {
        on: [true; MAX_AXES],
        instead: [[0.0; 6]; MAX_AXES],
    };
    /// Every optional part is omitted.
    pub const NONE: Self = Self {
        on: [false; MAX_AXES],
        ..Self::ALL
    };

    /// The replacement constants of an axis that is off.
    pub(crate) fn instead_of(&self, index: usize) -> Option<&[f64; 6]> {
        (!self.on[index]).then_some(&self.instead[index])
    }
}

/// Temperature dependence of an inter-axis error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InterChange {
    /// The axis, or the number of axes for the spindle, as in [`ErrorModel::inter`].
    pub index: usize,
    /// Component 0…5 of `[x y z a b c]`.
    pub component: usize,
    /// Index of the sensor.
    pub sensor: usize,
    /// Change (mm or rad) per kelvin from the sensor's reference.
    pub per_kelvin: f64,
}

/// Maximum number of changes of inter-axis errors: one for each component of each axis and of the spindle.
const MAX_INTER_CHANGES: usize = 6 * (MAX_AXES + 1);

/// All errors of a machine. `P` stores the points of tabulated motions: borrowed, or owned where there is a heap.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorModel<P = &'static [f64]> {
    /// Inter-axis errors `[x y z a b c]` (mm, rad) of each axis, then of the spindle.
    pub inter: [[f64; 6]; MAX_AXES + 1],
    /// Temperature dependences of inter-axis errors.
    pub inter_thermal: Vec<InterChange, MAX_INTER_CHANGES>,
    /// Error motions `[x y z a b c]` of each axis.
    pub motions: [[Motion<P>; 6]; MAX_AXES],
    /// Calibrated range of the error motions of each axis (mm or rad).
    pub calibrated: [[f64; 2]; MAX_AXES],
}

/// Bit sets of the error motions of one axis: which exist, which hold their end values, and which apply in full
/// although the axis is switched off.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Carried {
    there: u8,
    holds: u8,
    stays: u8,
}

impl ErrorModel<&[f64]> {
    /// A machine without errors. The points of tabulated motions, if any are added, are borrowed.
    #[must_use]
    pub fn perfect(machine: &Machine) -> Self {
        Self::new(machine)
    }
}

impl<P> ErrorModel<P> {
    /// A machine without errors, with another storage type for the points of tabulated motions.
    #[must_use]
    pub fn new(machine: &Machine) -> Self {
        let endless = |index: usize| machine.axes.get(index).is_some_and(|a| a.modulo);
        Self {
            inter: [[0.0; 6]; MAX_AXES + 1],
            inter_thermal: Vec::new(),
            motions: core::array::from_fn(|index| {
                core::array::from_fn(|_| Motion {
                    endless: endless(index),
                    ..Motion::default()
                })
            }),
            calibrated: core::array::from_fn(|index| {
                let travel = |a: &crate::Axis| a.travel.map(|t| a.to_kinematic(t));
                machine.axes.get(index).map_or([0.0; 2], travel)
            }),
        }
    }

    /// Sets one parameter (mm, rad, per mmᵏ or radᵏ).
    ///
    /// Returns false and sets nothing if the machine has no such axis, or the axis no such parameter (harmonics of a
    /// linear axis, a degree that is too high).
    pub fn set(&mut self, machine: &Machine, parameter: Parameter, value: f64) -> bool {
        let Some(index) = place(machine, parameter) else {
            return false;
        };
        if parameter.kind == ParameterKind::Inter {
            self.inter[index][parameter.component] = value;
            return true;
        }
        self.motions[index][parameter.component].set(parameter.kind, value)
    }

    /// Makes one parameter change with the temperature of a sensor, by this much (mm, rad, per mmᵏ or radᵏ) per kelvin
    /// from the sensor's reference.
    ///
    /// Returns false and changes nothing where [`Self::set`] does, for backlash, for an invalid sensor index, and if
    /// there is no room for another change ([`MAX_CHANGES`](crate::MAX_CHANGES) for each error motion).
    pub fn set_per_kelvin(
        &mut self,
        machine: &Machine,
        parameter: Parameter,
        sensor: usize,
        per_kelvin: f64,
    ) -> bool {
        let Some(index) = place(machine, parameter) else {
            return false;
        };
        let component = parameter.component;
        match parameter.kind {
            _ if sensor >= MAX_SENSORS => false,
            ParameterKind::Backlash => false,
            ParameterKind::Inter => {
                let change = InterChange {
                    index,
                    component,
                    sensor,
                    per_kelvin,
                };
                self.inter_thermal.push(change).is_ok()
            }
            kind => {
                let change = Change {
                    kind,
                    sensor,
                    per_kelvin,
                };
                self.motions[index][component].thermal.push(change).is_ok()
            }
        }
    }

    /// Assigns measured values to an error motion (component 0…5 of axis `index`); its coefficients are kept.
    ///
    /// Returns false and changes nothing if there are no points, if the numbers of values and positions differ, or if
    /// the positions do not increase.
    pub fn tabulate(&mut self, index: usize, component: usize, table: Table<P>) -> bool
    where
        P: AsRef<[f64]>,
    {
        let at = table.at.as_ref();
        let negative = table.negative.as_ref().unwrap_or(&table.positive).as_ref();
        let right = !at.is_empty()
            && table.positive.as_ref().len() == at.len()
            && negative.len() == at.len()
            && at.windows(2).all(|w| w[0] < w[1]);
        if right {
            self.motions[index][component].table = Some(table);
        }
        right
    }

    /// The inter-axis error of an axis (or the spindle, index n) at a temperature.
    #[must_use]
    pub fn inter_at(&self, index: usize, kelvin: &[f64; MAX_SENSORS]) -> [f64; 6] {
        let mut error = self.inter[index];
        for change in &self.inter_thermal {
            if change.index == index {
                error[change.component] += change.per_kelvin * kelvin[change.sensor];
            }
        }
        error
    }

    /// The error motions that an axis has.
    pub(crate) fn carried(&self, index: usize, linear: bool) -> Carried {
        let mut carried = Carried::default();
        for (component, motion) in self.motions[index].iter().enumerate() {
            carried.there |= u8::from(!motion.is_zero()) << component;
            carried.holds |= u8::from(motion.holds()) << component;
            // The affine part: constants and scales of length.
            let stays = linear && component < 3 && !motion.holds();
            carried.stays |= u8::from(stays) << component;
        }
        carried
    }

    /// True if switching the axis off has an effect: it is linear and has motions that are not affine in its position,
    /// or angular ones that vary.
    #[must_use]
    pub fn bends(&self, machine: &Machine, index: usize) -> bool {
        !machine.axes[index].letter.is_rotary()
            && self.motions[index]
                .iter()
                .enumerate()
                .any(|(component, m)| m.varies() && (component >= 3 || m.holds()))
    }

    /// True if the errors of an axis depend on its direction of travel.
    #[must_use]
    pub fn reverses(&self, index: usize) -> bool {
        self.motions[index].iter().any(Motion::reverses)
    }
}

impl<P: AsRef<[f64]>> ErrorModel<P> {
    /// The intra-axis error `[x y z a b c]` of an axis (mm, rad) at its commanded position (mm or rad), or `None` if it
    /// has none.
    #[must_use]
    pub fn intra_at(
        &self,
        machine: &Machine,
        index: usize,
        q: f64,
        situation: &Situation,
        switches: &Switches,
    ) -> Option<[f64; 6]> {
        let linear = !machine.axes[index].letter.is_rotary();
        let instead = switches.instead_of(index);
        self.intra(self.carried(index, linear), index, q, situation, instead)
    }

    /// The pose error of an axis, given its motions. With `instead`, only the part that remains when the axis is
    /// switched off, plus the replacement constants.
    pub(crate) fn intra(
        &self,
        carried: Carried,
        index: usize,
        q: f64,
        situation: &Situation,
        instead: Option<&[f64; 6]>,
    ) -> Option<[f64; 6]> {
        if carried.there == 0 {
            return None;
        }
        let by = situation.pieces_by.map(|by| by[index]);
        let held = self.held(index, q, by);
        let sign = situation.sign[index];
        let mut error = [0.0; 6];
        for (component, (e, motion)) in error.iter_mut().zip(&self.motions[index]).enumerate() {
            let is = |set: u8| set >> component & 1 == 1;
            if !is(carried.there) {
                continue;
            }
            *e = match instead {
                Some(instead) if !is(carried.stays) => {
                    motion.constant(&situation.kelvin) + motion.backlash * sign + instead[component]
                }
                _ => {
                    let at = if is(carried.holds) { held } else { q };
                    let piece = if at == q { by.unwrap_or(q) } else { at };
                    motion.value_by(at, piece, sign, &situation.kelvin)
                }
            };
        }
        Some(error)
    }
}

impl<P> ErrorModel<P> {
    /// Position at which a motion that holds its end value is evaluated, for an axis at `q` (mm or rad). `by`, if
    /// given, decides in place of `q`.
    #[must_use]
    pub fn held(&self, index: usize, q: f64, by: Option<f64>) -> f64 {
        let [low, high] = self.calibrated[index];
        match by {
            None if q < low => low,
            None if q > high => high,
            // Points of tables are f32, so a position meant to be the end may be slightly outside.
            Some(by) if by < low - 1e-6 * (high - low) => low,
            Some(by) if by > high + 1e-6 * (high - low) => high,
            _ => q,
        }
    }

    /// What a parameter adds to its component of the error of its axis, per unit of it, at the command `q` (mm, rad): 1
    /// for an inter-axis error, the direction of travel for backlash, and for a coefficient its power, cosine or sine,
    /// held where the motion holds its end value. `None` if the machine has no such parameter.
    #[must_use]
    pub fn per_unit(
        &self,
        machine: &Machine,
        parameter: Parameter,
        q: &PerAxis,
        situation: &Situation,
    ) -> Option<f64> {
        let index = place(machine, parameter)?;
        Some(match parameter.kind {
            ParameterKind::Inter => 1.0,
            ParameterKind::Backlash => situation.sign[index],
            kind => {
                let by = situation.pieces_by.map(|by| by[index]);
                let motion = &self.motions[index][parameter.component];
                kind.basis(match motion.holds() {
                    true => self.held(index, q[index], by),
                    false => q[index],
                })
            }
        })
    }
}

/// The axis of a parameter (the number of axes for the spindle), if the machine has it.
fn place(machine: &Machine, parameter: Parameter) -> Option<usize> {
    let inter = parameter.kind == ParameterKind::Inter;
    if parameter.axis == 'S' {
        return inter.then_some(machine.axes.len());
    }
    let index = machine.index(parameter.axis)?;
    let harmonic = matches!(
        parameter.kind,
        ParameterKind::Cosine(_) | ParameterKind::Sine(_)
    );
    (!harmonic || machine.axes[index].letter.is_rotary()).then_some(index)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Axis, Branch, Letter};

    fn machine() -> Machine {
        Machine::new(&[
            Axis::new(Letter::X, Branch::Workpiece, [-200.0, 200.0]),
            Axis::new(Letter::Y, Branch::Tool, [-200.0, 200.0]),
            Axis::new(Letter::Z, Branch::Tool, [0.0, 300.0]),
            Axis::new(Letter::A, Branch::Tool, [-90.0, 90.0]),
        ])
        .unwrap()
    }

    fn set(errors: &mut ErrorModel, name: &str, value: f64) -> bool {
        errors.set(&machine(), Parameter::parse(name).unwrap(), value)
    }

    #[test]
    fn what_a_machine_does_not_have_cannot_be_set() {
        let perfect = ErrorModel::perfect(&machine());
        let mut errors = perfect.clone();
        for name in ["EXB1", "EXXc1", "EZZs8", "EA0C"] {
            assert!(!set(&mut errors, name, 1e-3), "{name}");
        }
        let backlash = Parameter::parse("EXXb").unwrap();
        assert!(!errors.set_per_kelvin(&machine(), backlash, 0, 1e-6));
        let scale = Parameter::parse("EXX1").unwrap();
        assert!(!errors.set_per_kelvin(&machine(), scale, MAX_SENSORS, 1e-6));
        assert_eq!(errors, perfect);
    }

    #[test]
    fn tables_with_wrong_points_are_not_taken() {
        let mut errors = ErrorModel::perfect(&machine());
        for (at, positive, negative) in [
            (&[0.0, 1.0][..], &[0.0][..], None),
            (&[0.0, 0.0], &[0.0, 1.0], None),
            (&[0.0, 1.0], &[0.0, 1.0], Some(&[0.0][..])),
            (&[], &[], None),
        ] {
            let table = Table {
                at,
                positive,
                negative,
            };
            assert!(!errors.tabulate(0, 0, table));
        }
    }

    #[test]
    fn what_bends_holds_outside_the_calibrated_range_and_can_be_switched_off() {
        let machine = machine();
        let mut errors = ErrorModel::perfect(&machine);
        for (name, value) in [("EXX0", 1.0), ("EXX1", 1e-3), ("EYX0", 2.0), ("EYX2", 1e-4)] {
            assert!(set(&mut errors, name, value));
        }
        assert!(errors.bends(&machine, 0) && !errors.bends(&machine, 1));
        errors.calibrated[0] = [-100.0, 100.0];
        let mut off = Switches::ALL;
        off.on[0] = false;
        let at = |situation: &Situation, switches: &Switches| {
            let error = errors.intra_at(&machine, 0, 150.0, situation, switches);
            error.map(|e| [e[0], e[1]]).unwrap()
        };
        let mut situation = Situation::default();
        // The scale continues, while the parabola keeps its value at 100 mm.
        assert_eq!(at(&situation, &Switches::ALL), [1.15, 3.0]);
        assert_eq!(at(&situation, &off), [1.15, 2.0]);
        off.instead[0][1] = 0.5;
        assert_eq!(at(&situation, &off), [1.15, 2.5]);
        situation.pieces_by = Some([50.0; 6]);
        assert_eq!(at(&situation, &Switches::ALL), [1.15, 4.25]);
    }

    #[test]
    fn locations_change_with_temperature() {
        let machine = machine();
        let mut errors = ErrorModel::perfect(&machine);
        assert!(set(&mut errors, "EZ0S", 0.5));
        let parameter = Parameter::parse("EZ0S").unwrap();
        assert!(errors.set_per_kelvin(&machine, parameter, 2, -0.25));
        let mut kelvin = [0.0; MAX_SENSORS];
        kelvin[2] = 4.0;
        assert_eq!(errors.inter_at(4, &kelvin)[2], -0.5);
    }
}

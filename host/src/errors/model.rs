//! The error model: what every axis does wrong, as functions of its commanded position.

use super::parameter::{Parameter, ParameterKind};
use crate::machine::{MAX_AXES, Machine, PerAxis};
use std::collections::BTreeMap;

/// The most temperature sensors: one auxiliary input is kept for the tool length.
pub const MAX_SENSORS: usize = trueaxis::AUXILIARIES - 1;

/// A temperature sensor that error parameters depend on.
#[derive(Clone, Debug, PartialEq)]
pub struct Thermal {
    /// Name of the sensor.
    pub sensor: String,
    /// Its temperature (°C) at which the parameters hold as written.
    pub reference_celsius: f64,
    /// Differences to the reference (K) that a compensation must cover.
    pub range_kelvin: [f64; 2],
}

/// One error motion: a component of the error of one axis along its travel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Motion {
    /// Coefficients of degree 0, 1, 2 … (mm or rad, per mmᵏ or radᵏ).
    pub coefficients: Vec<f64>,
    /// Half of the reversal value (mm or rad).
    pub backlash: f64,
    /// Measured values instead of coefficients: positions (mm or rad), values (mm or rad).
    pub table: Option<(Vec<f64>, Vec<f64>)>,
    /// Change of a coefficient: degree, sensor index, per kelvin.
    pub thermal: Vec<(usize, usize, f64)>,
}

impl Motion {
    /// True if it keeps its end value outside the calibrated range: it is tabulated or has
    /// coefficients of degree 2 or more. Degrees 0 and 1 alone are a location or a scale and
    /// stay valid everywhere.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.table.is_some()
            || self.coefficients.len() > 2
            || self.thermal.iter().any(|(degree, _, _)| *degree >= 2)
    }

    /// True if it is not the same along the whole axis.
    #[must_use]
    pub fn varies(&self) -> bool {
        self.coefficients.iter().skip(1).any(|c| *c != 0.0)
            || self.table.is_some()
            || self.thermal.iter().any(|(degree, _, _)| *degree >= 1)
    }

    /// True if it is zero everywhere, in every direction and at every temperature.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        self.coefficients.iter().all(|c| *c == 0.0)
            && self.backlash == 0.0
            && self.table.is_none()
            && self.thermal.is_empty()
    }

    /// The value (mm or rad) at a position (mm or rad) inside the calibrated range, coming with
    /// `sign` (+1, −1, or 0 if unknown), at `kelvin` from the sensors' references.
    fn value(&self, q: f64, sign: f64, kelvin: &[f64; MAX_SENSORS]) -> f64 {
        let mut value = self
            .coefficients
            .iter()
            .rev()
            .fold(0.0, |sum, c| sum * q + c);
        for (degree, sensor, per_kelvin) in &self.thermal {
            value += per_kelvin * kelvin[*sensor] * q.powi(*degree as i32);
        }
        if let Some((at, values)) = &self.table {
            value += interpolate(at, values, q);
        }
        value + self.backlash * sign
    }

    /// The constant part (degree 0) alone.
    fn constant(&self, kelvin: &[f64; MAX_SENSORS]) -> f64 {
        let mut value = self.coefficients.first().copied().unwrap_or(0.0);
        for (degree, sensor, per_kelvin) in &self.thermal {
            if *degree == 0 {
                value += per_kelvin * kelvin[*sensor];
            }
        }
        value
    }
}

/// Linear between the points, the end value outside.
fn interpolate(at: &[f64], values: &[f64], q: f64) -> f64 {
    let above = at.partition_point(|a| *a <= q);
    if above == 0 {
        return values[0];
    }
    if above == at.len() {
        return values[at.len() - 1];
    }
    let t = (q - at[above - 1]) / (at[above] - at[above - 1]);
    values[above - 1] + (values[above] - values[above - 1]) * t
}

/// What, beside the axis positions, the errors depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Situation {
    /// Direction of travel of each axis: +1, −1, or 0 if unknown.
    pub sign: PerAxis,
    /// Tool length (mm along the tool axis) instead of the machine's own.
    pub length: Option<f64>,
    /// Temperature of each sensor from its reference (K).
    pub kelvin: [f64; MAX_SENSORS],
    /// Positions (mm, rad) that decide, instead of those at which the errors are evaluated,
    /// whether a motion is outside its calibrated range and holds its end value.
    pub hold_by: Option<PerAxis>,
}

impl Default for Situation {
    /// Unknown directions, the machine's own tool, reference temperature.
    fn default() -> Self {
        Self {
            sign: [0.0; MAX_AXES],
            length: None,
            kelvin: [0.0; MAX_SENSORS],
            hold_by: None,
        }
    }
}

/// Which axes' error motions count in full.
///
/// A linear axis that is switched off keeps what is affine in its position (constants and
/// scales), a rotary one what is constant: with all of them off, the exact correction is affine in
/// every linear position and depends on rotary positions through their sines and cosines only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Switches(pub [bool; MAX_AXES]);

impl Switches {
    /// Everything counts.
    pub const ALL: Self = Self([true; MAX_AXES]);
}

/// All errors of a machine.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorModel {
    /// The parameters as written (mm, rad, per mmᵏ or radᵏ).
    pub parameters: BTreeMap<Parameter, f64>,
    /// Their standard uncertainties, where given.
    pub standard_uncertainty: BTreeMap<Parameter, f64>,
    /// Inter-axis errors `[x y z a b c]` of each axis, then of the spindle.
    pub inter: Vec<[f64; 6]>,
    /// Change of an inter-axis error: index as in `inter`, component, sensor, per kelvin.
    pub inter_thermal: Vec<(usize, usize, usize, f64)>,
    /// Error motions `[x y z a b c]` of each axis.
    pub motions: Vec<[Motion; 6]>,
    /// Where the error motions of each axis are known (mm or rad).
    pub calibrated: Vec<[f64; 2]>,
    /// The sensors that thermal coefficients name.
    pub sensors: Vec<Thermal>,
    /// Per axis: whether any motion of it, affine or not, is there at all.
    moving: [bool; MAX_AXES],
}

impl ErrorModel {
    /// A machine without errors.
    #[must_use]
    pub fn perfect(machine: &Machine) -> Self {
        let n = machine.axes.len();
        Self {
            parameters: BTreeMap::new(),
            standard_uncertainty: BTreeMap::new(),
            inter: vec![[0.0; 6]; n + 1],
            inter_thermal: Vec::new(),
            motions: vec![Default::default(); n],
            calibrated: machine
                .axes
                .iter()
                .map(|a| a.travel.map(|t| a.to_kinematic(t)))
                .collect(),
            sensors: Vec::new(),
            moving: [false; MAX_AXES],
        }
    }

    /// Sets one parameter (mm, rad, per mmᵏ or radᵏ).
    ///
    /// Returns false if the machine has no such axis; nothing is set then.
    pub fn set(&mut self, machine: &Machine, parameter: Parameter, value: f64) -> bool {
        let index = match parameter.axis {
            'S' => Some(machine.axes.len()),
            letter => machine.index(letter),
        };
        let Some(index) = index else { return false };
        match parameter.kind {
            ParameterKind::Inter => self.inter[index][parameter.component] = value,
            ParameterKind::Degree(k) => {
                let motion = &mut self.motions[index][parameter.component];
                let k = usize::from(k);
                if motion.coefficients.len() <= k {
                    motion.coefficients.resize(k + 1, 0.0);
                }
                motion.coefficients[k] = value;
            }
            ParameterKind::Backlash => self.motions[index][parameter.component].backlash = value,
        }
        self.parameters.insert(parameter, value);
        self.refresh();
        true
    }

    /// Recomputes what is derived from the motions; called after they were changed directly.
    pub fn refresh(&mut self) {
        for (moving, motions) in self.moving.iter_mut().zip(&self.motions) {
            *moving = motions.iter().any(|m| !m.is_zero());
        }
    }

    /// The inter-axis error of an axis (or the spindle, index n) at a temperature.
    #[must_use]
    pub fn inter_at(&self, index: usize, kelvin: &[f64; MAX_SENSORS]) -> [f64; 6] {
        let mut error = self.inter[index];
        for (axis, component, sensor, per_kelvin) in &self.inter_thermal {
            if *axis == index {
                error[*component] += per_kelvin * kelvin[*sensor];
            }
        }
        error
    }

    /// The intra-axis error `[x y z a b c]` of an axis (mm, rad) at its commanded position
    /// (mm or rad), or `None` if it has none.
    #[must_use]
    pub fn intra_at(
        &self,
        machine: &Machine,
        index: usize,
        q: f64,
        situation: &Situation,
        switches: &Switches,
    ) -> Option<[f64; 6]> {
        if !self.moving[index] {
            return None;
        }
        let [low, high] = self.calibrated[index];
        let held = match situation.hold_by {
            None if q < low => low,
            None if q > high => high,
            // Points of tables are f32: an end that is meant may come out a little outside.
            Some(by) if by[index] < low - 1e-6 * (high - low) => low,
            Some(by) if by[index] > high + 1e-6 * (high - low) => high,
            _ => q,
        };
        let full = switches.0[index];
        let linear = !machine.axes[index].letter.is_rotary();
        let mut error = [0.0; 6];
        for (component, (e, motion)) in error.iter_mut().zip(&self.motions[index]).enumerate() {
            let holds = motion.holds();
            *e = if full || (linear && component < 3 && !holds) {
                let at = if holds { held } else { q };
                motion.value(at, situation.sign[index], &situation.kelvin)
            } else {
                motion.constant(&situation.kelvin) + motion.backlash * situation.sign[index]
            };
        }
        Some(error)
    }

    /// True if switching the axis off changes anything: it is linear and carries motions that
    /// are not affine in its position, or angular ones that vary.
    #[must_use]
    pub fn bends(&self, machine: &Machine, index: usize) -> bool {
        !machine.axes[index].letter.is_rotary()
            && self.motions[index]
                .iter()
                .enumerate()
                .any(|(component, m)| m.varies() && (component >= 3 || m.holds()))
    }

    /// True if an axis has backlash in any component.
    #[must_use]
    pub fn reverses(&self, index: usize) -> bool {
        self.motions[index].iter().any(|m| m.backlash != 0.0)
    }
}

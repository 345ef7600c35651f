//! The error model with the additional content of its file.

use super::{Covariance, MAX_SENSORS, Parameter, ParameterKind, Situation};
use crate::machine::Machine;
use std::collections::BTreeMap;
use std::ops::{Deref, DerefMut};

/// One error motion: a component of the error of one axis along its travel.
pub type Motion = trueaxis_kinematics::Motion<Vec<f64>>;

/// Measured values of an error motion.
pub type Table = trueaxis_kinematics::Table<Vec<f64>>;

/// A temperature on which error parameters depend: of a sensor, with or without a lag.
#[derive(Clone, Debug, PartialEq)]
pub struct Thermal {
    /// Name of the sensor.
    pub sensor: String,
    /// Time constant (s) of the first-order lag between sensor and effect; 0 if there is none.
    pub lag: f64,
    /// The temperature (°C) at which the parameters have their values as written.
    pub reference_celsius: f64,
    /// Range of differences from the reference (K), after the lag, that a compensation must cover. Beyond it the effect
    /// stays what it is at the border.
    pub range_kelvin: [f64; 2],
    /// Largest rate (K/s) at which a controller follows the readings.
    pub rate: f64,
    /// Plausible readings (°C); a reading outside is a fault.
    pub range_celsius: [f64; 2],
}

/// All errors of a machine, with the parameters as written. Their effect on the machine is in
/// [`trueaxis_kinematics::ErrorModel`], to which this dereferences.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorModel {
    /// The parameters as written (mm, rad, per mmᵏ or radᵏ).
    pub parameters: BTreeMap<Parameter, f64>,
    /// Their standard uncertainties, where given.
    pub standard_uncertainty: BTreeMap<Parameter, f64>,
    /// The covariance of parameters in a covariance file, if there is one.
    pub correlated: Option<Covariance>,
    /// Standard uncertainties of tabulated motions, where given: by axis (index) and component 0…5, for each value
    /// (mm or rad).
    pub table_uncertainty: BTreeMap<(usize, usize), Vec<f64>>,
    /// The file confirms that slopes of tabulated straightness are meant in addition to the squareness of the same
    /// axes.
    pub slopes_beside_squareness: bool,
    /// Half-width (mm) of the interval in which 95 % of the coordinates of another warm-up or cool-down stay with the
    /// thermal coefficients, if it is known.
    pub thermal_left: Option<f64>,
    /// Standard deviation (mm) of a coordinate of the tip by errors that the model lacks, in the calibrated range, if
    /// it is known.
    pub misfit: Option<f64>,
    /// Like `misfit` (rad) of a component of the tool's direction; `None` if nothing that reads directions was measured.
    pub misfit_of_direction: Option<f64>,
    /// Errors that may exist but that the measurements could not show, each with what 10 µm (10 µrad, 10 µm/m) of it
    /// changes at the tip over the travel (µm).
    pub unseen: BTreeMap<Parameter, f64>,
    /// The temperatures that thermal coefficients refer to.
    pub sensors: Vec<Thermal>,
    model: trueaxis_kinematics::ErrorModel<Vec<f64>>,
}

impl ErrorModel {
    /// A machine without errors.
    #[must_use]
    pub fn perfect(machine: &Machine) -> Self {
        Self {
            parameters: BTreeMap::new(),
            standard_uncertainty: BTreeMap::new(),
            correlated: None,
            table_uncertainty: BTreeMap::new(),
            slopes_beside_squareness: false,
            thermal_left: None,
            misfit: None,
            misfit_of_direction: None,
            unseen: BTreeMap::new(),
            sensors: Vec::new(),
            model: trueaxis_kinematics::ErrorModel::new(machine),
        }
    }

    /// True if figures of the tip are upper bounds: it was measured in space, so that the misfit has what the model lacks, and
    /// no error is listed as not measured. An error file without a misfit says nothing of errors that it does not have.
    #[must_use]
    pub fn bounds_the_tip(&self) -> bool {
        self.misfit.is_some() && self.unseen.is_empty()
    }

    /// False if measurements show what errors that the model lacks do to the tip, but nothing shows how they turn the tool.
    #[must_use]
    pub fn is_direction_measured(&self) -> bool {
        self.misfit.is_none() || self.misfit_of_direction.is_some()
    }

    /// The scale errors of linear axes (`EXX1`) that neither a parameter nor a table gives, or that are 0 without an
    /// uncertainty. If one is missing, a scale that all axes have in common is not known either.
    #[must_use]
    pub fn missing_scales(&self, machine: &Machine) -> Vec<Parameter> {
        let axes = machine.axes.iter().enumerate();
        let linear = axes.filter(|(_, axis)| !axis.letter.is_rotary());
        let missing = linear.filter_map(|(index, axis)| {
            let scale = Parameter::scale(axis.letter.char());
            // A zero may be a line that nobody has measured.
            let is_measured = |value: &f64| *value != 0.0 || self.is_uncertain(&scale);
            let is_known = self.parameters.get(&scale).is_some_and(is_measured)
                || self.motions[index][scale.component].table.is_some();
            (!is_known).then_some(scale)
        });
        missing.collect()
    }

    /// True if the standard uncertainty of a parameter is known.
    fn is_uncertain(&self, parameter: &Parameter) -> bool {
        let correlated = self.correlated.as_ref();
        self.standard_uncertainty.contains_key(parameter)
            || correlated.is_some_and(|known| known.parameters.contains(parameter))
    }

    /// True if a table contains the motion of this parameter: all of it but its location and, if the table is the same in
    /// both directions of travel, its backlash.
    #[must_use]
    pub fn is_tabulated(&self, machine: &Machine, parameter: &Parameter) -> bool {
        let index = machine.index(parameter.axis);
        let table = index.and_then(|i| self.motions[i][parameter.component].table.as_ref());
        match parameter.kind {
            ParameterKind::Inter => false,
            ParameterKind::Backlash => table.is_some_and(|table| table.negative.is_some()),
            _ => table.is_some(),
        }
    }

    /// Sets one parameter (mm, rad, per mmᵏ or radᵏ).
    ///
    /// Returns false, and sets nothing, if the machine has no such axis or the axis no such parameter (harmonics of
    /// a linear axis).
    pub fn set(&mut self, machine: &Machine, parameter: Parameter, value: f64) -> bool {
        let known = self.model.set(machine, parameter, value);
        if known {
            self.parameters.insert(parameter, value);
        }
        known
    }

    /// The change (of its unit) of a parameter per kelvin of a temperature (by its number).
    #[must_use]
    pub fn per_kelvin(&self, machine: &Machine, parameter: Parameter, input: usize) -> f64 {
        let index = machine.index(parameter.axis);
        let spindle = machine.axes.len();
        let location = self.inter_thermal.iter().filter(|change| {
            parameter.kind == ParameterKind::Inter
                && (change.index, change.component, change.sensor)
                    == (index.unwrap_or(spindle), parameter.component, input)
        });
        let motions = index.map(|index| &self.motions[index][parameter.component]);
        let motion = motions.into_iter().flat_map(|motion| &motion.thermal);
        let motion = motion.filter(|c| c.kind == parameter.kind && c.sensor == input);
        let changes = location.map(|c| c.per_kelvin);
        changes.chain(motion.map(|c| c.per_kelvin)).sum()
    }

    /// Adds `step` to the change of a parameter per kelvin of a temperature (by its number). False, and nothing
    /// changes, where [`set_per_kelvin`](trueaxis_kinematics::ErrorModel::set_per_kelvin) refuses it.
    pub fn adjust_per_kelvin(
        &mut self,
        machine: &Machine,
        parameter: Parameter,
        input: usize,
        step: f64,
    ) -> bool {
        let before = self.per_kelvin(machine, parameter, input);
        let index = machine.index(parameter.axis).unwrap_or(machine.axes.len());
        let component = parameter.component;
        if parameter.kind == ParameterKind::Inter {
            self.model
                .inter_thermal
                .retain(|c| (c.index, c.component, c.sensor) != (index, component, input));
        } else if let Some(motions) = self.model.motions.get_mut(index) {
            let is_other =
                |c: &trueaxis_kinematics::Change| (c.kind, c.sensor) != (parameter.kind, input);
            motions[component].thermal.retain(is_other);
        }
        self.set_per_kelvin(machine, parameter, input, before + step)
    }

    /// Covariance of all parameters: those of the covariance file as given there, others with a standard uncertainty
    /// without correlations. Parameters without an uncertainty count as exact.
    #[must_use]
    pub fn covariance(&self) -> Covariance {
        let correlated = self.correlated.clone().unwrap_or_default();
        let is_other = |p: &Parameter| !correlated.parameters.contains(p);
        let others = self.standard_uncertainty.iter();
        let others = others.filter(|(p, _)| is_other(p) && self.parameters.contains_key(p));
        let others: Vec<(Parameter, f64)> = others.map(|(p, u)| (*p, *u)).collect();
        correlated.with_uncorrelated(others.into_iter())
    }

    /// The standard uncertainty (mm or rad) of a tabulated motion of an axis (by index) at its position `q` (mm or
    /// rad). Values are independent of each other, in each direction. 0 if none is given.
    #[must_use]
    pub(crate) fn table_uncertainty_at(
        &self,
        index: usize,
        component: usize,
        q: f64,
        situation: &Situation,
    ) -> f64 {
        let table = self.motions[index][component].table.as_ref();
        let Some((table, known)) = table.zip(self.table_uncertainty.get(&(index, component)))
        else {
            return 0.0;
        };
        let q = self.held(index, q, None);
        let above = table.at.partition_point(|at| *at <= q);
        let value = match (above.checked_sub(1), known.get(above)) {
            (None, _) => known[0],
            (Some(last), None) => known[last],
            (Some(below), Some(u)) => {
                let [a, b] = [below, above].map(|k| table.at[k]);
                let t = (q - a) / (b - a);
                libm::hypot((1.0 - t) * known[below], t * u)
            }
        };
        // With an unknown direction, the value is the mean of both.
        let sign = situation.sign[index];
        match table.negative {
            None => value,
            Some(_) => value * libm::hypot(0.5 * (1.0 + sign), 0.5 * (1.0 - sign)),
        }
    }
}

impl Deref for ErrorModel {
    type Target = trueaxis_kinematics::ErrorModel<Vec<f64>>;
    fn deref(&self) -> &Self::Target {
        &self.model
    }
}

impl DerefMut for ErrorModel {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.model
    }
}

const _: () = assert!(
    trueaxis::AUXILIARIES > MAX_SENSORS,
    "a tool length and all sensors fit into a blob"
);

/// Name of a temperature as an input: of its sensor, with the time constant of its lag if it has one (`bed 600 s`), in
/// three digits. `lag_rate` is 1/τ in 1/s, or 0.
#[must_use]
pub fn temperature_name(sensor: &str, lag_rate: f32) -> String {
    if lag_rate == 0.0 {
        return sensor.to_owned();
    }
    format!(
        "{sensor} {} s",
        in_three_digits(f64::from(lag_rate).recip())
    )
}

/// A time constant (s) as it is written; 0 stays 0.
#[must_use]
pub fn in_three_digits(lag: f64) -> f64 {
    format!("{lag:.2e}").parse().unwrap_or(lag)
}

//! Single entries of an error file.

use crate::errors::{ErrorModel, MAX_SENSORS, Parameter, ParameterKind, Table, Thermal};
use crate::machine::Machine;

/// The content of an entry.
#[derive(Clone, Debug, PartialEq)]
pub enum EntryKind {
    /// A parameter and its value (mm, rad, per mmᵏ or radᵏ).
    Parameter(f64),
    /// A tabulated motion.
    Table,
    /// The difference of a tabulated motion between the two directions of travel.
    TableReversal,
    /// A change of a parameter with the temperature of a sensor.
    PerKelvin {
        /// Value per kelvin.
        per_kelvin: f64,
        /// Name of the sensor.
        sensor: String,
    },
}

/// Dependence on the position of the axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Nature {
    /// None: a location or a constant.
    Constant,
    /// Proportional: a scale or an inclination.
    Slope,
    /// Any other: polynomials, harmonics, tabulated motions.
    Curve,
    /// Dependence on the direction of travel.
    Reversal,
}

/// One entry on a machine without other errors.
#[derive(Clone, Debug)]
pub struct SingleEntry<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// The parameter; for a table, that of degree 0.
    pub parameter: Parameter,
    /// The content of the entry.
    pub said: EntryKind,
    /// Range in which the motion is known (mm or rad); the whole travel for the spindle and for entries that apply
    /// everywhere.
    pub range: [f64; 2],
    table: Option<&'a Table>,
}

impl<'a> SingleEntry<'a> {
    fn new(
        machine: &'a Machine,
        errors: &'a ErrorModel,
        parameter: Parameter,
        said: EntryKind,
    ) -> Self {
        Self {
            machine,
            parameter,
            said,
            range: range(machine, errors, parameter),
            table: None,
        }
    }

    /// All entries of an error file, axis by axis in the order of the machine, the spindle last.
    #[must_use]
    pub fn all(machine: &'a Machine, errors: &'a ErrorModel) -> Vec<Self> {
        let mut all: Vec<Self> = Vec::new();
        let new = |parameter: Parameter, said| Self::new(machine, errors, parameter, said);
        let parameters = errors.parameters.iter();
        all.extend(parameters.map(|(p, value)| new(*p, EntryKind::Parameter(*value))));
        let sensor = |sensor: usize| errors.sensors.get(sensor).map(Thermal::name);
        let changed = |parameter, index, per_kelvin| {
            let sensor = sensor(index).unwrap_or_default();
            new(parameter, EntryKind::PerKelvin { per_kelvin, sensor })
        };
        let parameter = |index: usize, component: usize, kind| Parameter {
            component,
            axis: letter(machine, index),
            kind,
        };
        for change in &errors.inter_thermal {
            let parameter = parameter(change.index, change.component, ParameterKind::Inter);
            all.push(changed(parameter, change.sensor, change.per_kelvin));
        }
        for index in 0..machine.axes.len() {
            for (component, motion) in errors.motions[index].iter().enumerate() {
                for change in &motion.thermal {
                    let parameter = parameter(index, component, change.kind);
                    all.push(changed(parameter, change.sensor, change.per_kelvin));
                }
                let degree_0 = parameter(index, component, ParameterKind::Degree(0));
                let kinds = match motion.table.as_ref().map(|table| &table.negative) {
                    Some(Some(_)) => vec![EntryKind::Table, EntryKind::TableReversal],
                    Some(None) => vec![EntryKind::Table],
                    None => Vec::new(),
                };
                all.extend(kinds.into_iter().map(|said| Self {
                    table: motion.table.as_ref(),
                    ..new(degree_0, said)
                }));
            }
        }
        all.sort_by_key(Self::index);
        all
    }

    /// This value for another parameter instead of this one.
    #[must_use]
    pub fn instead(&self, parameter: Parameter, value: f64) -> Self {
        Self {
            parameter,
            said: EntryKind::Parameter(value),
            table: None,
            ..*self
        }
    }

    /// Index of its axis; the number of axes for the spindle.
    #[must_use]
    pub fn index(&self) -> usize {
        let axes = self.machine.axes.len();
        self.machine.index(self.parameter.axis).unwrap_or(axes)
    }

    /// Dependence on the position of its axis.
    #[must_use]
    pub fn nature(&self) -> Nature {
        match (&self.said, self.parameter.kind) {
            (EntryKind::Table, _) => Nature::Curve,
            (EntryKind::TableReversal, _) | (_, ParameterKind::Backlash) => Nature::Reversal,
            (_, ParameterKind::Inter | ParameterKind::Degree(0)) => Nature::Constant,
            (_, ParameterKind::Degree(1)) => Nature::Slope,
            _ => Nature::Curve,
        }
    }

    /// A machine with only this error, multiplied by `factor`, and the temperatures at which it shows.
    #[must_use]
    pub fn model(&self, factor: f64) -> (ErrorModel, [f64; MAX_SENSORS]) {
        let mut model = ErrorModel::perfect(self.machine);
        let mut kelvin = [0.0; MAX_SENSORS];
        match (&self.said, self.table) {
            (EntryKind::Parameter(value), _) => {
                model.set(self.machine, self.parameter, value * factor);
            }
            (EntryKind::PerKelvin { per_kelvin, .. }, _) => {
                kelvin[0] = 1.0;
                model.set_per_kelvin(self.machine, self.parameter, 0, per_kelvin * factor);
            }
            (said, Some(table)) => {
                let reversal = *said == EntryKind::TableReversal;
                let table = scaled(table, reversal, factor);
                model.tabulate(self.index(), self.parameter.component, table);
            }
            (_, None) => {}
        }
        (model, kelvin)
    }

    /// Largest magnitude (mm or rad).
    #[must_use]
    pub fn size(&self) -> f64 {
        let kind = self.parameter.kind;
        let value = match (&self.said, self.table) {
            (EntryKind::Parameter(value), _) => *value,
            (EntryKind::PerKelvin { per_kelvin, .. }, _) => *per_kelvin,
            (said, Some(table)) => {
                let table = scaled(table, *said == EntryKind::TableReversal, 1.0);
                let values = table.positive.iter().chain(table.negative.iter().flatten());
                return values.fold(0.0, |most: f64, v| most.max(v.abs()));
            }
            (_, None) => 0.0,
        };
        let places = self.places();
        let most = places.iter().map(|q| (value * kind.basis(*q)).abs());
        most.fold(0.0, f64::max)
    }

    /// Positions (mm or rad) of its axis to evaluate: those of a table, or enough to show a polynomial or harmonics.
    #[must_use]
    pub fn places(&self) -> Vec<f64> {
        const STEPS: u16 = 100;
        const DEGREES: f64 = 5.0;
        let [low, high] = self.range;
        if let Some(table) = self.table {
            let within = table.at.iter().copied().filter(|q| *q > low && *q < high);
            return std::iter::once(low).chain(within).chain([high]).collect();
        }
        let axis = self.machine.axes.get(self.index());
        if axis.is_some_and(|axis| axis.letter.is_rotary()) {
            let [first, last] = [low, high].map(|q| (q.to_degrees() / DEGREES).round() as i32);
            let inner = (first..=last).map(|k| (f64::from(k) * DEGREES).to_radians());
            let inner = inner.filter(|q| *q > low && *q < high);
            return std::iter::once(low).chain(inner).chain([high]).collect();
        }
        (0..=STEPS)
            .map(|k| low + (high - low) * f64::from(k) / f64::from(STEPS))
            .collect()
    }
}

/// A table for both directions of travel, or the difference between them.
fn scaled(table: &Table, reversal: bool, factor: f64) -> Table {
    let negative = table.negative.as_ref().unwrap_or(&table.positive);
    let pairs = || table.positive.iter().zip(negative);
    let (positive, negative) = match reversal {
        false => (pairs().map(|(p, n)| 0.5 * (p + n) * factor).collect(), None),
        true => {
            let half: Vec<f64> = pairs().map(|(p, n)| 0.5 * (p - n) * factor).collect();
            let minus = half.iter().map(|h| -h).collect();
            (half, Some(minus))
        }
    };
    Table {
        at: table.at.clone(),
        positive,
        negative,
    }
}

/// The travel of an axis, or its calibrated range if the motion holds its end values outside it.
fn range(machine: &Machine, errors: &ErrorModel, parameter: Parameter) -> [f64; 2] {
    let Some(index) = machine.index(parameter.axis) else {
        return [0.0; 2];
    };
    let axis = &machine.axes[index];
    let [low, high] = axis.travel.map(|t| axis.to_kinematic(t));
    let motion = &errors.motions[index][parameter.component];
    match motion.holds() && parameter.kind != ParameterKind::Inter {
        true => {
            let [from, to] = errors.calibrated[index];
            [low.max(from), high.min(to)]
        }
        false => [low, high],
    }
}

/// The letter of an axis, S for the spindle.
fn letter(machine: &Machine, index: usize) -> char {
    machine
        .axes
        .get(index)
        .map_or('S', |axis| axis.letter.char())
}

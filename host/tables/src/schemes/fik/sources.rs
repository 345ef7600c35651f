//! The errors of a machine as single sources: a value, and what it depends on.

use crate::schemes::points::Points;
use crate::schemes::products::Function;
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind, Situation, Switches};
use trueaxis_model::machine::{Machine, PerAxis};

/// One error with a value: an error parameter, or an error motion with all of its coefficients.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// `EB0A`; for a motion with several coefficients `EXX`.
    pub name: String,
    /// Value (mm, rad, per mmᵏ or radᵏ); 1 if it is included in `along`.
    pub value: f64,
    /// One unit of it in its frame, as a constant.
    pub unit: Parameter,
    /// Further factors: a function of its axis, the direction of travel, a temperature.
    pub along: Vec<Function>,
    /// True if its weight can be set on the controller.
    pub is_adjustable: bool,
}

/// All sources. Those of `adjustable` are separate, even if their value is 0.
pub fn sources(
    machine: &Machine,
    errors: &ErrorModel,
    points: &[Points],
    adjustable: &[Parameter],
) -> Vec<Source> {
    let letters = machine.axes.iter().map(|axis| axis.letter.char());
    let letters: Vec<char> = letters.chain(['S']).collect();
    let first_sensor = machine.axes.len() + usize::from(machine.length_range.is_some());
    let kelvin = |sensor: usize| Function {
        input: first_sensor + sensor,
        signed: false,
        values: points[first_sensor + sensor].at.clone(),
    };
    let mut sources = Vec::new();
    for (index, letter) in letters.iter().enumerate() {
        for component in 0..6 {
            let unit = Parameter {
                component,
                axis: *letter,
                kind: ParameterKind::Inter,
            };
            let value = errors.inter[index][component];
            let is_adjustable = adjustable.contains(&unit);
            if value != 0.0 || is_adjustable {
                sources.push(Source {
                    name: unit.to_string(),
                    value,
                    unit,
                    along: Vec::new(),
                    is_adjustable,
                });
            }
        }
    }
    for change in &errors.inter_thermal {
        let unit = Parameter {
            component: change.component,
            axis: letters[change.index],
            kind: ParameterKind::Inter,
        };
        sources.push(Source {
            name: format!("{unit} per K"),
            value: change.per_kelvin,
            unit,
            along: vec![kelvin(change.sensor)],
            is_adjustable: false,
        });
    }
    for (index, points) in points[..machine.axes.len()].iter().enumerate() {
        for component in 0..6 {
            let motion = Motion {
                machine,
                errors,
                index,
                component,
                points,
            };
            motion.sources(adjustable, &kelvin, &mut sources);
        }
    }
    sources
}

/// One error motion.
struct Motion<'a> {
    machine: &'a Machine,
    errors: &'a ErrorModel,
    index: usize,
    component: usize,
    points: &'a Points,
}

impl Motion<'_> {
    fn parameter(&self, kind: ParameterKind) -> Parameter {
        Parameter {
            component: self.component,
            axis: self.machine.axes[self.index].letter.char(),
            kind,
        }
    }

    fn source(&self, name: String, value: f64, along: Vec<Function>) -> Source {
        Source {
            name,
            value,
            unit: self.parameter(ParameterKind::Degree(0)),
            along,
            is_adjustable: false,
        }
    }

    fn position(&self, at: f64) -> PerAxis {
        let mut q = PerAxis::default();
        q[self.index] = at;
        q
    }

    /// The function of one unit of a coefficient along the axis.
    fn per_unit(&self, parameter: Parameter) -> Function {
        let signed = parameter.kind == ParameterKind::Backlash;
        let mut situation = Situation::default();
        situation.sign[self.index] = 1.0;
        let value = |at: &f64| {
            let q = self.position(*at);
            let value = self
                .errors
                .per_unit(self.machine, parameter, &q, &situation);
            value.unwrap_or_default()
        };
        Function {
            input: self.index,
            signed,
            values: self.points.at.iter().map(value).collect(),
        }
    }

    /// The values of the motion at the points, for one direction of travel.
    fn values(&self, errors: &ErrorModel, sign: f64) -> Vec<f64> {
        let mut situation = Situation::default();
        situation.sign[self.index] = sign;
        let value = |at: &f64| {
            let motions =
                errors.intra_at(self.machine, self.index, *at, &situation, &Switches::ALL);
            motions.unwrap_or_default()[self.component]
        };
        self.points.at.iter().map(value).collect()
    }

    fn sources(
        &self,
        adjustable: &[Parameter],
        kelvin: &dyn Fn(usize) -> Function,
        sources: &mut Vec<Source>,
    ) {
        let motion = &self.errors.motions[self.index][self.component];
        let is_of = |p: &&Parameter| {
            let of = self.parameter(p.kind);
            **p == of && p.kind != ParameterKind::Inter
        };
        let value = |p: &Parameter| self.errors.parameters.get(p).copied().unwrap_or(0.0);
        let mut rest = self.errors.clone();
        for parameter in adjustable.iter().filter(is_of) {
            let along = vec![self.per_unit(*parameter)];
            sources.push(Source {
                is_adjustable: true,
                ..self.source(parameter.to_string(), value(parameter), along)
            });
            rest.set(self.machine, *parameter, 0.0);
        }
        for change in &motion.thermal {
            let parameter = self.parameter(change.kind);
            let along = vec![self.per_unit(parameter), kelvin(change.sensor)];
            let name = format!("{parameter} per K");
            sources.push(self.source(name, change.per_kelvin, along));
        }
        let left = rest.parameters.iter();
        let left = left.filter(|(p, value)| is_of(p) && **value != 0.0);
        let left: Vec<(&Parameter, &f64)> = left.collect();
        if let ([(parameter, value)], None) = (&left[..], &motion.table) {
            let along = vec![self.per_unit(**parameter)];
            sources.push(self.source(parameter.to_string(), **value, along));
            return;
        }
        let name = self.parameter(ParameterKind::Degree(0)).to_string();
        let name = &name[..name.len() - 1];
        let (ahead, behind) = (self.values(&rest, 1.0), self.values(&rest, -1.0));
        let both = ahead.iter().zip(&behind);
        for (signed, values) in [
            (false, both.clone().map(|(a, b)| 0.5 * (a + b)).collect()),
            (true, both.map(|(a, b)| 0.5 * (a - b)).collect::<Vec<f64>>()),
        ] {
            if values.iter().any(|v| *v != 0.0) {
                let input = self.index;
                let along = Function {
                    input,
                    signed,
                    values,
                };
                let name = match signed {
                    true => format!("{name}, reversal"),
                    false => name.to_owned(),
                };
                sources.push(self.source(name, 1.0, vec![along]));
            }
        }
    }
}

//! What a compensation consists of, in words and numbers: axes, banks, terms, grids.

use crate::size::Size;
use serde::Serialize;
use trueaxis::{
    Auxiliary, AuxiliaryKind, Axis, Bank, Direction, Grid, Interpolation, Largest, Policy,
    SampleFormat,
};
use trueaxis_model::errors::temperature_name;
use trueaxis_model::policy::PolicyName;
use trueaxis_model::validate::Runtime;

/// Everything in a compensation except its samples.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Contents<'a> {
    /// The machine it was made for.
    pub machine: &'a str,
    /// What the rotary axes correct.
    #[serde(flatten)]
    pub policy: PolicyName,
    /// Like `policy`, as the blob stores it.
    #[serde(skip)]
    pub stored: Policy,
    /// Counts and sizes.
    #[serde(flatten)]
    pub size: Size,
    /// The axes, in the order of the compensation.
    pub axes: Vec<AxisEntry>,
    /// Inputs other than the axes.
    pub auxiliaries: Vec<AuxiliaryEntry>,
    /// Tables that share their points.
    pub bank_list: Vec<BankEntry>,
    /// Products of tables.
    pub term_list: Vec<TermEntry>,
    /// Grids of corrections.
    pub grid_list: Vec<GridEntry>,
}

/// An axis (mm, deg).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AxisEntry {
    /// Letter of the axis.
    pub name: char,
    /// `mm` or `deg`.
    pub unit: &'static str,
    /// `None`: the axis rotates without limits.
    pub travel: Option<[f32; 2]>,
    /// `None`: positions do not repeat.
    pub period: Option<f32>,
    /// Bound of its correction (mm, deg).
    pub value_bound: f32,
    /// Bound of the rate of its correction (mm/s, deg/s).
    pub rate_bound: f32,
    /// Rate of transitions (mm/s, deg/s).
    pub ramp_rate: f32,
    /// Rate at which a reversal is made up (mm/s, deg/s).
    pub reversal_rate: f32,
    /// Acceleration with which a reversal is made up (mm/s², deg/s²).
    pub reversal_acceleration: f32,
    /// Distance of reverse travel (mm, deg) after which the direction counts as reversed.
    pub reversal_threshold: f32,
}

/// An input that is not an axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AuxiliaryEntry {
    /// Name of the input.
    pub name: String,
    /// `tool length` or `temperature`.
    pub kind: &'static str,
    /// The length (mm) of the machine's own tool, or the reference temperature (°C).
    pub reference: f32,
    /// Time constant of its lag (s).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lag_s: Option<f32>,
    /// How a servo follows a temperature.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensor: Option<SensorEntry>,
}

/// How a servo follows a temperature.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SensorEntry {
    /// Largest rate (K/s) at which readings are followed.
    pub kelvin_per_s: f32,
    /// Plausible readings (°C).
    pub celsius: [f32; 2],
}

/// Tables with one input and common points.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BankEntry {
    /// The input that the tables read.
    pub input: String,
    /// First and last table number.
    pub tables: [usize; 2],
    /// Number of points.
    pub points: u32,
    /// Position of the first point.
    pub start: f32,
    /// Spacing of the points.
    pub step: f32,
    /// True if the input wraps.
    pub modulo: bool,
    /// The direction of travel for which the tables apply.
    pub direction: &'static str,
    /// Position of the last point; for cubic tables, the end of their last interval.
    pub end: f32,
    /// Interpolation between points.
    pub interpolation: &'static str,
    /// How samples are stored.
    pub samples: &'static str,
    /// Largest magnitude of each table.
    pub largest: Vec<f32>,
}

/// Weight times product of tables, added to the correction of an axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TermEntry {
    /// Letter of the corrected axis.
    pub output: char,
    /// Factor of the product.
    pub weight: f32,
    /// Limits within which the weight may be changed.
    pub limits: Option<[f32; 2]>,
    /// Numbers of the tables that are multiplied.
    pub tables: Vec<u8>,
    /// The errors that it corrects, if names were requested.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub errors: Vec<String>,
}

/// A grid of corrections.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GridEntry {
    /// The inputs.
    pub inputs: Vec<GridInputEntry>,
    /// Letters of the corrected axes.
    pub outputs: Vec<char>,
    /// How samples are stored.
    pub samples: &'static str,
}

/// An input of a grid.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GridInputEntry {
    /// Name of the input.
    pub input: String,
    /// Number of points.
    pub points: u32,
    /// Position of the first point.
    pub start: f32,
    /// Spacing of the points.
    pub step: f32,
    /// True if the input wraps.
    pub modulo: bool,
}

fn format(format: SampleFormat) -> &'static str {
    match format {
        SampleFormat::F32 => "f32",
        SampleFormat::I16 => "i16",
    }
}

fn unit(name: char) -> &'static str {
    if matches!(name, 'A' | 'B' | 'C') {
        "deg"
    } else {
        "mm"
    }
}

/// Name of an input: axes in order, then auxiliaries. Loading has checked that it exists.
pub(crate) fn input(compensation: &Largest<'_>, number: u8) -> String {
    let axes = compensation.axes();
    let number = usize::from(number);
    match axes.get(number) {
        Some(axis) => char::from(axis.name).to_string(),
        None => {
            let auxiliary = &compensation.auxiliaries()[number - axes.len()];
            temperature_name(&auxiliary.name, auxiliary.sensor.lag_rate)
        }
    }
}

/// The contents of a loaded blob.
#[must_use]
pub fn contents<'a>(runtime: &Runtime<'a>) -> Contents<'a> {
    let compensation = runtime.compensation();
    let letters: Vec<char> = (compensation.axes().iter())
        .map(|axis| char::from(axis.name))
        .collect();
    let mut next = 0;
    let banks = compensation.banks().iter().map(|bank| {
        let first = next;
        next += usize::from(bank.tables);
        BankEntry::of(compensation, bank, first)
    });
    let terms = compensation.terms().map(|term| TermEntry {
        output: letters[usize::from(term.output)],
        weight: term.weight,
        limits: term.limits,
        tables: term.factors.to_vec(),
        errors: Vec::new(),
    });
    let grids = compensation.grids().iter();
    Contents {
        machine: compensation.machine(),
        policy: compensation.policy().into(),
        stored: compensation.policy(),
        size: Size::of(runtime),
        axes: compensation.axes().iter().map(AxisEntry::of).collect(),
        auxiliaries: (compensation.auxiliaries().iter())
            .map(AuxiliaryEntry::of)
            .collect(),
        bank_list: banks.collect(),
        term_list: terms.collect(),
        grid_list: grids
            .map(|grid| GridEntry::of(compensation, grid, &letters))
            .collect(),
    }
}

impl AxisEntry {
    fn of(axis: &Axis) -> Self {
        let name = char::from(axis.name);
        Self {
            name,
            unit: unit(name),
            travel: (axis.travel != [-f32::MAX, f32::MAX]).then_some(axis.travel),
            period: (axis.period > 0.0).then_some(axis.period),
            value_bound: axis.value_bound,
            rate_bound: axis.rate_bound,
            ramp_rate: axis.ramp_rate,
            reversal_rate: axis.reversal_rate,
            reversal_acceleration: axis.reversal_acceleration,
            reversal_threshold: axis.reversal_threshold,
        }
    }
}

impl AuxiliaryEntry {
    fn of(auxiliary: &Auxiliary) -> Self {
        let sensor = &auxiliary.sensor;
        Self {
            name: auxiliary.name.to_string(),
            kind: match auxiliary.kind {
                AuxiliaryKind::ToolLength => "tool length",
                AuxiliaryKind::Temperature => "temperature",
            },
            reference: auxiliary.reference,
            lag_s: (sensor.lag_rate > 0.0).then(|| sensor.lag_rate.recip()),
            sensor: (auxiliary.kind == AuxiliaryKind::Temperature).then_some(SensorEntry {
                kelvin_per_s: sensor.rate,
                celsius: sensor.range,
            }),
        }
    }
}

impl BankEntry {
    /// A bank whose tables begin with number `first`.
    fn of(compensation: &Largest<'_>, bank: &Bank, first: usize) -> Self {
        let tables = first..first + usize::from(bank.tables);
        Self {
            input: input(compensation, bank.input),
            tables: [first, tables.end - 1],
            points: bank.points,
            start: bank.start,
            step: bank.step,
            modulo: bank.modulo,
            direction: match bank.direction {
                Direction::Both => "both",
                Direction::Positive => "positive",
                Direction::Negative => "negative",
                Direction::Signed => "signed",
            },
            end: match bank.interpolation {
                Interpolation::Linear => end(bank.start, bank.step, bank.points),
                Interpolation::Cubic => bank.end(),
            },
            interpolation: match bank.interpolation {
                Interpolation::Linear => "linear",
                Interpolation::Cubic => "cubic",
            },
            samples: format(bank.format),
            largest: tables
                .filter_map(|table| compensation.peak(table))
                .collect(),
        }
    }
}

impl GridEntry {
    fn of(compensation: &Largest<'_>, grid: &Grid, letters: &[char]) -> Self {
        let inputs = grid.axes.iter().map(|axis| GridInputEntry {
            input: input(compensation, axis.input),
            points: axis.points,
            start: axis.start,
            step: axis.step,
            modulo: axis.modulo,
        });
        let outputs = grid.outputs.iter();
        Self {
            inputs: inputs.collect(),
            outputs: outputs.map(|o| letters[usize::from(*o)]).collect(),
            samples: format(grid.format),
        }
    }
}

/// The position of the last of `points` evenly spaced points.
#[must_use]
pub fn end(start: f32, step: f32, points: u32) -> f32 {
    start + step * (points - 1) as f32
}

impl Contents<'_> {
    /// The input of each table, in the order of their numbers.
    #[must_use]
    pub fn inputs(&self) -> Vec<&str> {
        let banks = self.bank_list.iter();
        let tables = banks.map(|b| (b.input.as_str(), b.tables[1] + 1 - b.tables[0]));
        tables
            .flat_map(|(input, count)| std::iter::repeat_n(input, count))
            .collect()
    }
}

impl TermEntry {
    /// The product as text: `0.5 · T3(A) · T7(Y)`. A weight of 1 is omitted, unless there is no table or the weight
    /// is adjustable.
    #[must_use]
    pub fn product(&self, inputs: &[&str]) -> String {
        let plain = self.weight == 1.0 && self.limits.is_none() && !self.tables.is_empty();
        let weight = (!plain).then(|| self.weight.to_string());
        let tables = self.tables.iter();
        let tables = tables.map(|table| format!("T{table}({})", inputs[usize::from(*table)]));
        let product: Vec<String> = weight.into_iter().chain(tables).collect();
        product.join(" · ")
    }
}

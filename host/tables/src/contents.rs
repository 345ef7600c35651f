//! What a compensation consists of, in words and numbers: axes, banks, terms, grids.

use crate::policy::PolicyName;
use crate::size::Size;
use crate::validate::Runtime;
use serde::Serialize;
use trueaxis::{AuxiliaryKind, Direction, Grid, Interpolation, Largest, Policy, SampleFormat};

/// All of a compensation but its samples.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Contents<'a> {
    /// The machine it was made for.
    pub machine: &'a str,
    /// What rotary axes are corrected for.
    #[serde(flatten)]
    pub policy: PolicyName,
    /// The same as the blob stores it.
    #[serde(skip)]
    pub stored: Policy,
    /// Its numbers.
    #[serde(flatten)]
    pub size: Size,
    /// Its axes.
    pub axes: Vec<AxisEntry>,
    /// Its inputs beside the axes.
    pub auxiliaries: Vec<AuxiliaryEntry>,
    /// Tables with common points.
    pub bank_list: Vec<BankEntry>,
    /// Products of tables.
    pub term_list: Vec<TermEntry>,
    /// Grids.
    pub grid_list: Vec<GridEntry>,
}

/// An axis (mm, deg).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AxisEntry {
    /// Its name.
    pub name: char,
    /// `mm` or `deg`.
    pub unit: &'static str,
    /// `None`: turns without end.
    pub travel: Option<[f32; 2]>,
    /// `None`: positions do not repeat.
    pub period: Option<f32>,
    /// Bound of its correction (mm, deg).
    pub value_bound: f32,
    /// Bound of the rate of its correction (mm/s, deg/s).
    pub rate_bound: f32,
    /// Rate of transitions (mm/s, deg/s).
    pub ramp_rate: f32,
    /// How far it retreats until it has reversed (mm, deg).
    pub hysteresis: f32,
}

/// An input that is not an axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AuxiliaryEntry {
    /// Its name.
    pub name: String,
    /// `tool length` or `temperature`.
    pub kind: &'static str,
    /// The length (mm) of the machine's own tool, or the reference temperature (°C).
    pub reference: f32,
}

/// Tables with one input and common points.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BankEntry {
    /// What is read.
    pub input: String,
    /// Numbers of the first and of the last table.
    pub tables: [usize; 2],
    /// How many points.
    pub points: u32,
    /// The first.
    pub start: f32,
    /// Their distance.
    pub step: f32,
    /// True if the input wraps.
    pub modulo: bool,
    /// For which direction of travel.
    pub direction: &'static str,
    /// The last point; of cubic tables, where their last interval ends.
    pub end: f32,
    /// Between points.
    pub interpolation: &'static str,
    /// How samples are stored.
    pub samples: &'static str,
    /// Largest magnitude of each table.
    pub largest: Vec<f32>,
}

/// Weight times product of tables, added to the correction of an axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TermEntry {
    /// The axis.
    pub output: char,
    /// The weight.
    pub weight: f32,
    /// What the weight may be changed to.
    pub limits: Option<[f32; 2]>,
    /// Numbers of its tables.
    pub tables: Vec<u8>,
    /// The errors that it is for, if they were asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub errors: Vec<String>,
}

/// A grid of corrections.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GridEntry {
    /// Its inputs.
    pub inputs: Vec<GridInputEntry>,
    /// Its axes.
    pub outputs: Vec<char>,
    /// How samples are stored.
    pub samples: &'static str,
}

/// An input of a grid.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GridInputEntry {
    /// What is read.
    pub input: String,
    /// How many points.
    pub points: u32,
    /// The first.
    pub start: f32,
    /// Their distance.
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
        None => compensation.auxiliaries()[number - axes.len()]
            .name
            .to_string(),
    }
}

/// Of a loaded blob.
#[must_use]
pub fn contents<'a>(runtime: &Runtime<'a>) -> Contents<'a> {
    let compensation = runtime.compensation();
    let letters: Vec<char> = compensation
        .axes()
        .iter()
        .map(|a| char::from(a.name))
        .collect();
    let axes = compensation
        .axes()
        .iter()
        .zip(&letters)
        .map(|(axis, name)| AxisEntry {
            name: *name,
            unit: unit(*name),
            travel: (axis.travel != [-f32::MAX, f32::MAX]).then_some(axis.travel),
            period: (axis.period > 0.0).then_some(axis.period),
            value_bound: axis.value_bound,
            rate_bound: axis.rate_bound,
            ramp_rate: axis.ramp_rate,
            hysteresis: axis.hysteresis,
        });
    let auxiliaries = compensation.auxiliaries().iter().map(|a| AuxiliaryEntry {
        name: a.name.to_string(),
        kind: match a.kind {
            AuxiliaryKind::ToolLength => "tool length",
            AuxiliaryKind::Temperature => "temperature",
        },
        reference: a.reference,
    });
    let mut next = 0;
    let banks = compensation.banks().iter().map(|bank| {
        let first = next;
        next += usize::from(bank.tables);
        BankEntry {
            input: input(compensation, bank.input),
            tables: [first, next - 1],
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
            largest: (first..next)
                .filter_map(|table| compensation.peak(table))
                .collect(),
        }
    });
    let terms = compensation.terms().map(|term| TermEntry {
        output: letters[usize::from(term.output)],
        weight: term.weight,
        limits: term.limits,
        tables: term.factors.to_vec(),
        errors: Vec::new(),
    });
    let grid = |grid: &Grid| GridEntry {
        inputs: grid
            .axes
            .iter()
            .map(|axis| GridInputEntry {
                input: input(compensation, axis.input),
                points: axis.points,
                start: axis.start,
                step: axis.step,
                modulo: axis.modulo,
            })
            .collect(),
        outputs: grid
            .outputs
            .iter()
            .map(|o| letters[usize::from(*o)])
            .collect(),
        samples: format(grid.format),
    };
    Contents {
        machine: compensation.machine(),
        policy: compensation.policy().into(),
        stored: compensation.policy(),
        size: Size::of(runtime),
        axes: axes.collect(),
        auxiliaries: auxiliaries.collect(),
        bank_list: banks.collect(),
        term_list: terms.collect(),
        grid_list: compensation.grids().iter().map(grid).collect(),
    }
}

/// The end of an evenly spaced row of points.
#[must_use]
pub fn end(start: f32, step: f32, points: u32) -> f32 {
    start + step * (points - 1) as f32
}

impl Contents<'_> {
    /// What each table reads, in the order of their numbers.
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
    /// The factors: `0.5 · T3(A) · T7(Y)`. A weight of 1 goes without saying, unless there is nothing else or it
    /// may change.
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

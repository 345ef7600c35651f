//! Positions outside the travel: evaluated, but not meaningful.

use crate::errors::temperature_name;
use crate::machine::{Letter, Machine};
use serde::Serialize;
use trueaxis::Largest;

/// An axis that a motion takes outside its travel; positions have the number type of the limits.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[error(
    "{axis} is outside its travel of {} to {} {unit} at position {first} ({value} {unit}){}",
    limits[0],
    limits[1],
    others(*count)
)]
pub struct Outside<T> {
    /// The axis.
    pub axis: char,
    /// `mm` or `deg`.
    pub unit: &'static str,
    /// Lowest and highest position of its travel.
    pub limits: [T; 2],
    /// The first position outside, counted from 1 after the header.
    pub first: usize,
    /// Position of the axis there.
    pub value: T,
    /// Number of positions outside.
    pub count: usize,
}

fn others(count: usize) -> String {
    match count {
        1 => String::new(),
        2 => " and at one more".to_owned(),
        _ => format!(" and at {} more", count - 1),
    }
}

/// All axes, one per column, that leave their limits in any row; `None` means no limits.
fn outside<T: Copy + PartialOrd>(
    axes: impl Iterator<Item = (char, Option<[T; 2]>)>,
    rows: &[Vec<f64>],
    as_limits: impl Fn(f64) -> T,
) -> Vec<Outside<T>> {
    let limited = axes.enumerate().filter_map(|(i, (axis, limits))| {
        let limits = limits?;
        let column = rows.iter().map(|row| as_limits(row[i])).enumerate();
        let mut beyond = column.filter(|(_, q)| *q < limits[0] || *q > limits[1]);
        let (row, value) = beyond.next()?;
        let rotary = Letter::new(axis).is_some_and(Letter::is_rotary);
        Some(Outside {
            axis,
            unit: if rotary { "deg" } else { "mm" },
            limits,
            first: row + 1,
            value,
            count: 1 + beyond.count(),
        })
    });
    limited.collect()
}

/// The axes (mm, deg) that leave the travel stored in a compensation, where tables hold their end values. Rows are
/// those of [`evaluate`](super::evaluate).
#[must_use]
pub fn outside_compensation(compensation: &Largest<'_>, rows: &[Vec<f64>]) -> Vec<Outside<f32>> {
    let axes = compensation.axes().iter();
    let limits = axes.map(|a| (char::from(a.name), Some(a.travel)));
    outside(limits, rows, |q| q as f32)
}

/// The axes (mm, deg) that leave the travel of a machine, except axes without limits. Rows are those of
/// [`correct`](super::correct).
#[must_use]
pub fn outside_machine(machine: &Machine, rows: &[Vec<f64>]) -> Vec<Outside<f64>> {
    let axes = machine.axes.iter();
    let limits = axes.map(|a| (a.letter.char(), (!a.modulo).then_some(a.travel)));
    outside(limits, rows, |q| q)
}

/// A temperature that rows take beyond its tables, so that its effect stays what it is at the border.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[error(
    "{name} is beyond its range of {} to {} K at position {first}{}: its effect stays what it is at the border",
    range[0],
    range[1],
    others(*count)
)]
pub struct BeyondRange {
    /// Name of the input.
    pub name: String,
    /// The range (K from the reference).
    pub range: [f32; 2],
    /// The first such position, counted from 1 after the header.
    pub first: usize,
    /// Number of such positions.
    pub count: usize,
}

/// The temperatures beyond their tables. Rows are those of [`evaluate`](super::evaluate).
#[must_use]
pub fn beyond_range(compensation: &Largest<'_>, rows: &[Vec<f64>]) -> Vec<BeyondRange> {
    let axes = compensation.axes().len();
    let all = compensation.auxiliaries().iter().enumerate();
    all.filter_map(|(number, auxiliary)| {
        let range = compensation.range(number)?;
        let column = rows.iter().map(|row| row[axes + number] as f32).enumerate();
        let mut beyond = column.filter(|(_, x)| *x < range[0] || *x > range[1]);
        let (row, _) = beyond.next()?;
        Some(BeyondRange {
            name: temperature_name(&auxiliary.name, auxiliary.sensor.lag_rate),
            range,
            first: row + 1,
            count: 1 + beyond.count(),
        })
    })
    .collect()
}

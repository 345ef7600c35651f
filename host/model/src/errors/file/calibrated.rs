//! `[calibrated]`, and its default.

use super::{ErrorsFile, MAX_POSITION, axis};
use crate::errors::ErrorModel;
use crate::machine::{Axis, Machine};
use crate::source::{Exactly, FileError};
use toml::Spanned;

/// Smallest part of the travel (mm or deg) in which error motions must be known, unless the whole travel is shorter.
/// Corrections of that size are refused, so that corrected positions can be inside, too.
const LEAST: f64 = 1.0;

impl ErrorModel {
    /// Range in which error motions are known: as written, or else where all tables of the axis have points.
    pub(super) fn read_calibrated(
        &mut self,
        file: &ErrorsFile,
        machine: &Machine,
    ) -> Result<(), FileError> {
        self.keep_to_tables(machine);
        let mut written = [false; trueaxis_kinematics::MAX_AXES];
        for (name, range) in &file.calibrated {
            let index = axis(name, machine)?;
            self.calibrated[index] = written_range(range, &machine.axes[index])?;
            written[index] = true;
        }
        // An entry may also state that a table holds its end values where it has no points.
        let axes = machine.axes.iter().enumerate();
        for (index, axis) in axes.filter(|(i, _)| !written[*i]) {
            let range = self.calibrated[index].map(|c| axis.to_command(c));
            if let Some((least, found)) = too_narrow(axis, range) {
                let tables = file.tabulated.iter();
                let table = tables
                    .rev()
                    .find(|(name, _)| name.get_ref().ends_with(axis.letter.char()));
                let span = table.map_or(file.machine.span(), |(_, t)| t.get_ref().place(t));
                let (letter, unit) = (axis.letter, axis.unit());
                return Err(FileError::at(
                    span,
                    format!(
                        "the tables of axis {letter} have {found} of its travel in common, less than {least} {unit}"
                    ),
                    format!("the travel is {} to {}", axis.travel[0], axis.travel[1]),
                    format!("give positions in {unit} of the command, over the travel"),
                ));
            }
        }
        Ok(())
    }

    /// Limits the range of each axis to where all its tables have points.
    fn keep_to_tables(&mut self, machine: &Machine) {
        for index in 0..machine.axes.len() {
            let [mut low, mut high] = self.calibrated[index];
            for table in self.motions[index].iter().filter_map(|m| m.table.as_ref()) {
                if let (Some(first), Some(last)) = (table.at.first(), table.at.last()) {
                    (low, high) = (low.max(*first), high.min(*last));
                }
            }
            self.calibrated[index] = [low, high];
        }
    }
}

/// A range (mm or rad) under `[calibrated]`.
fn written_range(range: &Spanned<Exactly<2>>, axis: &Axis) -> Result<[f64; 2], FileError> {
    let unit = axis.unit();
    let Exactly([low, high]) = *range.get_ref();
    let refuse = |cause: &str, label: &str| {
        Err(FileError::at(
            range.span(),
            format!("the calibrated range of axis {} {cause}", axis.letter),
            label,
            format!("correct [calibrated]: write [lower, upper] in {unit} of the command"),
        ))
    };
    if low >= high || low.is_nan() || high.is_nan() {
        return refuse("is empty", "lower limit not below upper limit");
    }
    if low.abs() > MAX_POSITION || high.abs() > MAX_POSITION {
        return refuse("is larger than any travel", "too large");
    }
    if let Some((least, found)) = too_narrow(axis, [low, high]) {
        let [from, to] = axis.travel;
        let cause = format!("has {found} of its travel, less than {least} {unit}");
        return refuse(&cause, &format!("the travel is {from} to {to}"));
    }
    Ok([axis.to_kinematic(low), axis.to_kinematic(high)])
}

/// The required and the actual length inside the travel (mm or deg), if that is less.
fn too_narrow(axis: &Axis, [low, high]: [f64; 2]) -> Option<(f64, String)> {
    let [from, to] = axis.travel;
    let common = high.min(to) - low.max(from);
    let least = LEAST.min(to - from);
    // Allow for rounding from degrees to radians and back.
    (common < least * (1.0 - 1e-9)).then(|| {
        let found = if common <= 0.0 {
            "nothing".to_owned()
        } else {
            format!("{common:.3} {}", axis.unit())
        };
        (least, found)
    })
}

//! The points of a table in a file.

use super::raw::{HIGHEST, MISSING, MOST, Raw};
use super::reading::ReadOptions;
use super::spacing::{Spacing, whole};
use super::variable::{KnownVariable, VariableKey};
use std::ops::Range;
use trueaxis_model::source::FileError;

impl Raw<'_> {
    /// MIN, MAX and STEP, and the points that they define.
    pub fn spacing(
        &self,
        key: VariableKey,
        modulo: bool,
        unit: f64,
        doubts: &mut Vec<FileError>,
    ) -> Result<Spacing, FileError> {
        let ([min, max, step], at_step) = self.extent(key)?;
        let table = key.said();
        let exact = whole(max - min, step);
        let below = exact.unwrap_or(((max - min) / step).floor());
        if modulo && exact.is_none() {
            return Err(FileError::at(
                at_step,
                format!(
                    "STEP goes {} times into MAX - MIN of {table}, which repeats",
                    (max - min) / step
                ),
                "no whole number",
                "write STEP with all its decimals, or choose one that divides the period",
            ));
        }
        let values = self.values_in_a_row(key, below, at_step.clone())?;
        let intervals = values - 1;
        if modulo && intervals < 2 {
            return Err(self.error(
                format!("{table} repeats and has no point within its period"),
                "this table",
                "write a STEP of half the period or less",
            ));
        }
        let spacing = Spacing {
            start: (unit * min) as f32,
            step: (unit * step) as f32,
            points: if modulo { intervals } else { values },
            modulo,
        };
        if exact.is_none() {
            let last = min + intervals as f64 * step;
            doubts.push(FileError::at(
                at_step.clone(),
                format!(
                    "the last point of {table} is at {last}, not at MAX = {max}: STEP is rounded"
                ),
                "here",
                "write STEP with all its decimals, or the MAX that is meant",
            ));
        }
        match is_apart(&spacing) {
            true => Ok(spacing),
            false => Err(FileError::at(
                at_step,
                format!("STEP of {table} is too small for where it is"),
                "here",
                "points of a table must be apart",
            )),
        }
    }

    /// MIN, MAX and STEP, and the place of STEP.
    fn extent(&self, key: VariableKey) -> Result<([f64; 3], Range<usize>), FileError> {
        let (min, _) = self.needed(KnownVariable::Min, key)?;
        let (max, at_max) = self.needed(KnownVariable::Max, key)?;
        let (step, at_step) = self.needed(KnownVariable::Step, key)?;
        let table = key.said();
        if max <= min {
            return Err(FileError::at(
                at_max,
                format!("MAX of {table} is not above MIN"),
                "here",
                format!("MIN is {min}"),
            ));
        }
        if step <= 0.0 || step > max - min {
            return Err(FileError::at(
                at_step,
                format!("STEP of {table} is not between 0 and MAX - MIN"),
                "here",
                format!("{} mm or degrees are from MIN to MAX", max - min),
            ));
        }
        Ok(([min, max, step], at_step))
    }

    /// The number of consecutive values, from the first to the one at MAX.
    fn values_in_a_row(
        &self,
        key: VariableKey,
        intervals: f64,
        at_step: Range<usize>,
    ) -> Result<usize, FileError> {
        let table = key.said();
        if intervals > HIGHEST as f64 {
            return Err(FileError::at(
                at_step,
                format!("MIN, MAX and STEP of {table} make more than {HIGHEST} values"),
                "here",
                "no table of a controller has so many: correct STEP",
            ));
        }
        let name = KnownVariable::Value.name(key);
        let expected = intervals as usize + 1;
        let missing = |from: usize, to: usize| {
            let places = match from == to {
                true => format!("value {from} of {table} is"),
                false => format!("values {from} to {to} of {table} are"),
            };
            let remedy = format!(
                "{table} needs {name} 0 to {}, as MIN, MAX and STEP say: write all of them",
                expected - 1
            );
            FileError {
                label: MISSING.to_owned(),
                ..self.error(format!("{places} missing"), MISSING, remedy)
            }
        };
        let mut next = 0;
        for (k, (_, span)) in &self.values {
            if *k > next {
                return Err(missing(next, k - 1));
            }
            if next == expected {
                return Err(FileError::at(
                    span.clone(),
                    format!("value {k} of {table} is beyond MAX"),
                    "here",
                    format!(
                        "MIN, MAX and STEP make {expected} values: leave it out, or correct them"
                    ),
                ));
            }
            next += 1;
        }
        match next < expected {
            true => Err(missing(next, expected - 1)),
            false => Ok(next),
        }
    }

    /// On an axis without limits, a table must repeat after a turn.
    pub(crate) fn check_period(
        &self,
        key: VariableKey,
        spacing: &Spacing,
        input: usize,
        reading: &ReadOptions<'_>,
    ) -> Result<(), FileError> {
        let period = reading.axes.axes[input].period;
        let own = spacing.points as f32 * spacing.step;
        let times = period / own;
        if period > 0.0 && ((times - times.round()).abs() > 1e-7 * times.round() || times < 0.5) {
            let letter = reading.axes.letter(input);
            return Err(self.error(
                format!(
                    "{} repeats after {own}, which does not divide the turn of {letter}",
                    key.said()
                ),
                "this table",
                format!("MAX - MIN must be {period} or a whole part of it"),
            ));
        }
        Ok(())
    }
}

/// True if neighbouring points differ as f32.
fn is_apart(spacing: &Spacing) -> bool {
    let mut ends = [spacing.start, spacing.end() as f32].into_iter();
    (1.0 / spacing.step).is_finite()
        && ends.all(|end| end.abs() < MOST as f32 && end + spacing.step != end)
}

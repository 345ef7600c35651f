//! The points of a table in a file.

use super::raw::{HIGHEST, MOST, Raw};
use super::reading::ReadOptions;
use super::spacing::{Spacing, whole};
use super::variable::Setting;
use std::ops::Range;
use trueaxis_model::source::FileError;

impl Raw<'_> {
    /// MIN, MAX and STEP, and the points that they define.
    pub fn spacing(
        &self,
        modulo: bool,
        unit: f64,
        doubts: &mut Vec<FileError>,
    ) -> Result<Spacing, FileError> {
        let ([min, max, step], at_step) = self.extent()?;
        let table = self.key;
        let exact = whole(max - min, step);
        let times = (max - min) / step;
        if modulo && exact.is_none() {
            return Err(FileError::at(
                at_step,
                format!("STEP goes {times} times into MAX - MIN of {table}, which repeats"),
                "no whole number",
                "write STEP with all its decimals, or choose one that divides the period",
            ));
        }
        let values = self.values_in_a_row(exact.unwrap_or(times.floor()), &at_step)?;
        let intervals = values - 1;
        if modulo && intervals < 2 {
            return Err(self.error(
                format!("{table} repeats and has no point within its period"),
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
            doubts.push(FileError::here(
                at_step.clone(),
                format!(
                    "the last point of {table} is at {last}, not at MAX = {max}: STEP is rounded"
                ),
                "write STEP with all its decimals, or the MAX that is meant",
            ));
        }
        match is_apart(&spacing) {
            true => Ok(spacing),
            false => Err(FileError::here(
                at_step,
                format!("STEP of {table} is too small for where it is"),
                "points of a table must be apart",
            )),
        }
    }

    /// MIN, MAX and STEP, and the place of STEP.
    fn extent(&self) -> Result<([f64; 3], Range<usize>), FileError> {
        let (min, _) = self.needed(Setting::Min)?;
        let (max, at_max) = self.needed(Setting::Max)?;
        let (step, at_step) = self.needed(Setting::Step)?;
        let table = self.key;
        if max <= min {
            let message = format!("MAX of {table} is not above MIN");
            return Err(FileError::here(at_max, message, format!("MIN is {min}")));
        }
        if step <= 0.0 || step > max - min {
            return Err(FileError::here(
                at_step,
                format!("STEP of {table} is not between 0 and MAX - MIN"),
                format!("{} mm or degrees are from MIN to MAX", max - min),
            ));
        }
        Ok(([min, max, step], at_step))
    }

    /// The number of consecutive values, from the first to the one at MAX.
    fn values_in_a_row(&self, intervals: f64, at_step: &Range<usize>) -> Result<usize, FileError> {
        let table = self.key;
        if intervals > HIGHEST as f64 {
            return Err(FileError::here(
                at_step.clone(),
                format!("MIN, MAX and STEP of {table} make more than {HIGHEST} values"),
                "no table of a controller has so many: correct STEP",
            ));
        }
        let expected = intervals as usize + 1;
        let places = (0..).zip(self.values.keys());
        let next = places.take_while(|(next, k)| next == *k).count();
        if let Some((_, span)) = self.values.get(&expected).filter(|_| next > expected) {
            return Err(FileError::here(
                span.clone(),
                format!("value {expected} of {table} is beyond MAX"),
                format!("MIN, MAX and STEP make {expected} values: leave it out, or correct them"),
            ));
        }
        let after = self.values.range(next..).next();
        if next == expected && after.is_none() {
            return Ok(expected);
        }
        let last = after.map_or(expected, |(k, _)| *k) - 1;
        let missing = match next == last {
            true => format!("value {next} of {table} is"),
            false => format!("values {next} to {last} of {table} are"),
        };
        Err(self.error(
            format!("{missing} missing"),
            format!(
                "{table} needs {} 0 to {}, as MIN, MAX and STEP say: write all of them",
                Setting::Value.name(table),
                expected - 1
            ),
        ))
    }

    /// On an axis without limits, a table must repeat after a turn.
    pub(crate) fn check_period(
        &self,
        spacing: &Spacing,
        input: usize,
        reading: &ReadOptions<'_>,
    ) -> Result<(), FileError> {
        let period = reading.axes.axes[input].period;
        let own = spacing.points as f32 * spacing.step;
        let times = period / own;
        if period > 0.0 && ((times - times.round()).abs() > 1e-7 * times.round() || times < 0.5) {
            let letter = reading.axes.letter(input);
            let table = self.key;
            return Err(self.error(
                format!("{table} repeats after {own}, which does not divide the turn of {letter}"),
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

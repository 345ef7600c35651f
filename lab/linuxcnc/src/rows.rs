//! Rows of doubles, as played and recorded by `tape`.

use super::bench::LinuxCncBench;
use programs::files;

/// Recorded values, by column name.
pub struct RecordedRows {
    names: Vec<String>,
    values: Vec<f64>,
}

impl RecordedRows {
    /// # Errors
    /// If nothing was recorded.
    pub fn read(bench: &LinuxCncBench, name: &str, names: &[String]) -> Result<Self, String> {
        let bytes = files::read(&bench.file(name))?;
        let values: Vec<f64> = bytes
            .chunks_exact(8)
            .map(|b| f64::from_ne_bytes(b.try_into().unwrap_or_default()))
            .collect();
        if values.is_empty() || !values.len().is_multiple_of(names.len()) {
            return Err(format!("{name}: {} values", values.len()));
        }
        Ok(Self {
            names: names.to_vec(),
            values,
        })
    }

    pub fn len(&self) -> usize {
        self.values.len() / self.names.len()
    }

    /// Index of a column; its name must be one of those it was read with.
    pub fn column(&self, name: &str) -> usize {
        let found = self.names.iter().position(|n| n == name);
        found.unwrap_or_else(|| unreachable!("no column {name}"))
    }

    pub fn rows(&self) -> impl ExactSizeIterator<Item = &[f64]> {
        self.values.chunks_exact(self.names.len())
    }

    /// All values of a column.
    pub fn of(&self, name: &str) -> Vec<f64> {
        let column = self.column(name);
        self.rows().map(|row| row[column]).collect()
    }
}

/// The command of a joint is passed on with the correction of this period added, and its feedback with that of the last
/// period removed: `fed_back` is the feedback input, from the second row on.
///
/// # Errors
/// The first row that is not exact.
pub fn adds_up(
    joint: usize,
    correction: &[f64],
    [command, passed_on]: [&[f64]; 2],
    [fed_back, feedback]: [&[f64]; 2],
) -> Result<(), String> {
    for row in 0..correction.len() {
        if passed_on[row].to_bits() != (command[row] + correction[row]).to_bits() {
            return Err(format!(
                "row {row}, joint {joint}: the command does not add up"
            ));
        }
        if row > 0 && feedback[row].to_bits() != (fed_back[row - 1] - correction[row - 1]).to_bits()
        {
            return Err(format!(
                "row {row}, joint {joint}: the feedback does not add up"
            ));
        }
    }
    Ok(())
}

pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

pub fn least(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::INFINITY, f64::min)
}

/// Writes rows to be played.
pub fn play(bench: &LinuxCncBench, name: &str, rows: &[Vec<f64>]) -> Result<(), String> {
    let bytes: Vec<u8> = rows
        .iter()
        .flatten()
        .flat_map(|v| v.to_ne_bytes())
        .collect();
    bench.write(name, bytes)
}

/// Pseudo-random numbers, the same in every run.
pub struct EventNumbers(u64);

impl EventNumbers {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Knuth's multiplier; the upper half is random enough here.
    pub fn bits(&mut self) -> u32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 32) as u32
    }

    /// From `low` to `high`.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * f64::from(self.bits()) / f64::from(u32::MAX)
    }
}

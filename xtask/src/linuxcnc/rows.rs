//! Rows of doubles, as `tape` plays and records them.

use super::bench::Bench;
use std::fs;

/// What was recorded, by name of the column.
pub struct Rows {
    names: Vec<String>,
    values: Vec<f64>,
}

impl Rows {
    /// # Errors
    /// Nothing was recorded.
    pub fn read(bench: &Bench, name: &str, names: &[String]) -> Result<Self, String> {
        let bytes = fs::read(bench.file(name)).map_err(|e| format!("{name}: {e}"))?;
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

    /// Number of a column; its name is one of those that it was read with.
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

/// Writes rows to be played.
pub fn play(bench: &Bench, name: &str, rows: &[Vec<f64>]) -> Result<(), String> {
    let bytes: Vec<u8> = rows
        .iter()
        .flatten()
        .flat_map(|v| v.to_ne_bytes())
        .collect();
    bench.write(name, bytes)
}

/// Numbers without pattern, the same in every run.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Knuth's multiplier; the upper half is good enough here.
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

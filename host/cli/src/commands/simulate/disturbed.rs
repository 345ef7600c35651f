//! Disturbances of simulated readings.

use super::super::number::{finite, percent, size};
use clap::Args;
use trueaxis_direct::simulate::runs::OfReadings;

/// Noise, drift and outliers.
#[derive(Args)]
pub struct Disturbed {
    /// Standard deviation of a reading
    #[arg(long, value_name = "µm|µrad", default_value_t = 0.0, value_parser = size)]
    noise: f64,
    /// Drift of the reading from the first to the last
    #[arg(
        long,
        value_name = "µm|µrad",
        default_value_t = 0.0,
        allow_hyphen_values = true,
        value_parser = finite
    )]
    drift: f64,
    /// Percentage of readings that are outliers
    #[arg(long, value_name = "%", default_value_t = 0.0, value_parser = percent)]
    outliers: f64,
    /// Size of an outlier
    #[arg(long, value_name = "µm|µrad", default_value_t = 100.0, value_parser = size)]
    outlier: f64,
    /// Seed of the noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

impl Disturbed {
    /// The disturbances in mm or rad; `unit` is the size of the options' unit.
    pub fn of_readings(&self, unit: f64) -> OfReadings {
        OfReadings {
            noise: self.noise * unit,
            drift: self.drift * unit,
            outliers: self.outliers * 1e-2,
            outlier: self.outlier * unit,
            seed: self.seed,
        }
    }
}

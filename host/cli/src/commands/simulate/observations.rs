//! `trueaxis simulate observations`

use super::super::Outcome;
use super::super::bad_input::BadInput;
use super::super::files::{self, MachineFiles};
use super::super::number::{finite, size, three};
use super::super::output;
use clap::Args;
use std::path::{Path, PathBuf};
use trueaxis_identify::formats::observations;
use trueaxis_identify::simulate::{self, OfObservations};
use trueaxis_model::kinematics::Kinematics;

/// Simulate observations of any kind: lengths, points, displacements, angles
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis simulate observations machine.toml errors.toml --plan bar-plan.csv -o bar.csv\n\n\
The plan has the layout of the result, and needs no readings. Instruments are where its lines with #\n\
put them:\n  # [setup.bar]\n  # place_mm = [0.0, 0.0, 50.0]\n  kind,setup,X,Y,Z,A,C,sigma_um\n  length,bar,150,0,-24,0,0,0.5"
)]
pub struct SimulatedObservations {
    #[command(flatten)]
    files: MachineFiles,
    /// What is read at which positions, with the uncertainty of each reading (CSV)
    #[arg(long, value_name = "FILE.csv")]
    plan: PathBuf,
    /// Where to write the observations (CSV; default: standard output)
    #[arg(short, long, value_name = "OUT.csv")]
    output: Option<PathBuf>,
    /// Standard deviation of each reading, as a multiple of the uncertainty that its row states
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = size)]
    noise: f64,
    /// Drift of every instrument along x, y and z of the workpiece, from the first to the last reading
    #[arg(
        long,
        value_name = "µm,µm,µm",
        value_delimiter = ',',
        allow_hyphen_values = true,
        value_parser = finite
    )]
    drift: Vec<f64>,
    /// Time constant with which the drift ends, as a part of the whole time (default: linear drift)
    #[arg(long, value_name = "FRACTION", default_value_t = 0.0, value_parser = size, requires = "drift", hide_default_value = true)]
    drift_lag: f64,
    /// Seed of the noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

impl SimulatedObservations {
    pub fn run(&self) -> Result<Outcome, BadInput> {
        let inputs: [&Path; 3] = [&self.files.machine, &self.files.errors, &self.plan];
        if let Some(output) = &self.output {
            output::prepare(output, &inputs)?;
        }
        let drift = three(&self.drift, "--drift", "µm")?;
        let (machine, errors) = self.files.read()?;
        let plan = files::read_instruments(std::slice::from_ref(&self.plan), &machine)?;
        let disturbances = OfObservations {
            noise: self.noise,
            drift: drift.map(|v| v * 1e-3),
            drift_lag: self.drift_lag,
            seed: self.seed,
        };
        let kinematics = Kinematics::new(&machine, &errors);
        let measured = simulate::observations(&kinematics, &plan, &disturbances);
        let csv = observations::write(&measured, &machine);
        let said = format!("{} observations", measured.rows.len());
        output::write_or_print(self.output.as_deref(), &csv, &said)?;
        Ok(Outcome::Done)
    }
}

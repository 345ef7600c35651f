//! `trueaxis simulate touches`

use super::super::Outcome;
use super::super::bad_input::BadInput;
use super::super::files::{self, MachineFiles};
use super::super::number::{finite, size, three};
use super::super::output;
use super::super::touch_options::TouchOptions;
use super::not_simulated;
use clap::Args;
use std::path::{Path, PathBuf};
use trueaxis_identify::simulate::Disturbances;
use trueaxis_model::kinematics::Kinematics;
use trueaxis_probing::plan::{simulated_touches, touch_log};

/// Simulate the log of touches that a program of `trueaxis plan` records
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis simulate touches machine.toml errors.toml --artefact artefact.toml --plan plan.csv \\\n    \
--ball-diameter 20 --stylus-diameter 6 --noise 1 -o touches.log"
)]
pub struct Touches {
    #[command(flatten)]
    files: MachineFiles,
    /// Nominal positions of the balls, for which the program was written (artefact.toml)
    #[arg(long, value_name = "FILE")]
    artefact: PathBuf,
    /// Which ball is probed at which rotary positions (CSV)
    #[arg(long, value_name = "FILE.csv")]
    plan: PathBuf,
    /// Where to write the log (default: standard output)
    #[arg(short, long, value_name = "OUT.log")]
    output: Option<PathBuf>,
    #[command(flatten)]
    touching: TouchOptions,
    /// Displacement of the balls from their nominal positions, along x, y and z of the workpiece
    #[arg(
        long,
        value_name = "MM,MM,MM",
        value_delimiter = ',',
        allow_hyphen_values = true,
        value_parser = finite
    )]
    misplaced: Vec<f64>,
    /// Standard deviation of each touch along each axis
    #[arg(long, value_name = "µm", default_value_t = 0.0, value_parser = size)]
    noise: f64,
    /// A probe whose effective radius depends on the direction like this (as trueaxis qualify writes it)
    #[arg(long, value_name = "PROBE.toml")]
    probe: Option<PathBuf>,
    /// Seed of the noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

impl Touches {
    pub fn run(&self) -> Result<Outcome, BadInput> {
        let MachineFiles { machine, errors } = &self.files;
        let inputs: [&Path; 4] = [machine, errors, &self.artefact, &self.plan];
        if let Some(output) = &self.output {
            output::prepare(output, &inputs)?;
        }
        let misplaced = three(&self.misplaced, "--misplaced", "mm")?;
        let (machine, errors) = self.files.read()?;
        let planned = files::read_artefact(&self.artefact, &machine)?;
        let plan = files::read_plan(&self.plan, &machine)?;
        let mut artefact = planned.clone();
        for place in artefact.balls.iter_mut().filter_map(|b| b.nominal.as_mut()) {
            *place += nalgebra::Vector3::from(misplaced);
        }
        let probe = self.probe.as_deref();
        let lobing = probe.map(|path| files::read_probe(path, &machine).map(|probe| probe.shape));
        let lobing = lobing.transpose()?;
        let disturbances = Disturbances {
            noise: self.noise * 1e-3,
            seed: self.seed,
            ..Disturbances::default()
        };
        let touched = simulated_touches(
            &Kinematics::new(&machine, &errors),
            &planned,
            &artefact,
            &plan,
            &self.touching.probe()?,
            &lobing.unwrap_or_default(),
            &disturbances,
        );
        let touched = touched.map_err(|e| not_simulated(&self.plan, &e))?;
        let log = touch_log(&machine, &touched);
        let said = format!("{} touches", touched.len());
        output::write_or_print(self.output.as_deref(), &log, &said)?;
        Ok(Outcome::Done)
    }
}

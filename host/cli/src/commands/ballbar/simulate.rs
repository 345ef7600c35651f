//! `trueaxis ballbar simulate`

use super::super::Outcome;
use super::super::bad_input::BadInput;
use super::super::files::{self, MachineFiles};
use super::super::output;
use super::SimulatedTest;
use super::answer::{BallbarAnswer, bad_sphere};
use clap::Args;
use nalgebra::Vector3;
use std::path::{Path, PathBuf};
use trueaxis_direct::ballbar::{PathPoint, ReadOut, SphereRecord};
use trueaxis_model::explain::Bench;
use trueaxis_model::validate::Runtime;
use trueaxis_tables::compile::belongs;

/// Predict ball-bar readings from known errors, before and after compensation
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis ballbar simulate machine.toml errors.toml --compensation machine.trax --at X=0,Y=0,Z=-300\n\n\
The workpiece ball is where the tool's is when the axes are in the centre. -o writes the readings (those after\n\
compensation, if one is given), which `trueaxis ballbar analyse` reads."
)]
pub struct Simulate {
    #[command(flatten)]
    files: MachineFiles,
    /// Compensation that is switched on
    #[arg(long, value_name = "FILE.trax")]
    compensation: Option<PathBuf>,
    #[command(flatten)]
    test: SimulatedTest,
    /// Where to write the readings (CSV)
    #[arg(short, long, value_name = "OUT.csv")]
    output: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

impl Simulate {
    pub fn run(&self) -> Result<Outcome, BadInput> {
        let mut inputs: Vec<&Path> = vec![&self.files.machine, &self.files.errors];
        inputs.extend(self.compensation.as_deref());
        if let Some(output) = &self.output {
            output::prepare(output, &inputs)?;
        }
        let (machine, errors) = self.files.read()?;
        let path = self.test.path()?;
        let bench = Bench::new(&machine, &errors, Default::default());
        let bar = self.test.bar(&bench, &path)?;
        let radius = self.test.radius;
        // As in the file: along the axes as commands count them.
        let found = |read: &[ReadOut]| {
            let places = path.iter().filter(|place| place.is_read);
            let readings: Vec<_> = (places.zip(read))
                .map(|(place, read)| (Vector3::from(place.at).normalize(), read.deviation))
                .collect();
            SphereRecord::of(radius, &readings).map_err(bad_sphere)
        };
        let mut last = bar.read(&path, None);
        let mut answer = BallbarAnswer {
            machine: Some(&machine.name),
            before: Some(found(&last)?),
            ..BallbarAnswer::default()
        };
        if let Some(file) = &self.compensation {
            let blob = files::read_blob(file)?;
            let runtime = Runtime::load(&blob).map_err(|e| BadInput::in_blob(e, file))?;
            belongs(&machine, &errors, &runtime).map_err(|e| BadInput::mismatch(&e, file))?;
            last = bar.read(&path, Some(&runtime));
            answer.after = Some(found(&last)?);
        }
        if let Some(output) = &self.output {
            output::write(output, csv(&machine.name, radius, &path, &last).as_bytes())?;
        }
        answer.print(self.json)?;
        Ok(Outcome::Done)
    }
}

/// The readings in the format of a file.
fn csv(machine: &str, radius: f64, path: &[PathPoint], read: &[ReadOut]) -> String {
    let mut text = format!(
        "# machine = {}\n# radius_mm = {radius:?}\n# unit = \"um\"\nX,Y,Z,radial\n",
        toml::Value::from(machine)
    );
    let places = path.iter().filter(|place| place.is_read);
    for (PathPoint { at: [x, y, z], .. }, read) in places.zip(read) {
        let [x, y, z] = [x, y, z].map(|c| (c * 1e4).round() / 1e4 + 0.0);
        let um = (read.deviation * 1e7).round() / 1e4 + 0.0;
        text += &format!("{x:.4},{y:.4},{z:.4},{um:.4}\n");
    }
    text
}

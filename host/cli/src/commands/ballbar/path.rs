//! `trueaxis ballbar path`

use super::super::Outcome;
use super::super::bad_input::BadInput;
use super::super::files;
use super::super::number::positive;
use super::super::output;
use super::SimulatedTest;
use clap::Args;
use std::path::PathBuf;
use trueaxis_direct::ballbar::program;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::explain::Bench;

/// Write the hemispherical path as a program, G54 zero at its centre
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis ballbar path machine.toml --at X=0,Y=0,Z=-300 -o hemisphere.ngc\n  \
trueaxis gcode hemisphere.ngc -o corrected.ngc --compensation machine.trax --setup setup.toml\n\n\
Set G54 to the centre before it runs; the machine's travel is checked."
)]
pub struct BallBarPath {
    /// Machine description (machine.toml)
    machine: PathBuf,
    #[command(flatten)]
    test: SimulatedTest,
    /// Feed rate
    #[arg(long, value_name = "mm/min", default_value_t = 200.0, value_parser = positive)]
    feed: f64,
    /// Where to write the program (default: standard output)
    #[arg(short, long, value_name = "OUT.ngc")]
    output: Option<PathBuf>,
}

impl BallBarPath {
    pub fn run(&self) -> Result<Outcome, BadInput> {
        if let Some(output) = &self.output {
            output::prepare(output, &[&self.machine])?;
        }
        let machine = files::read_machine(&self.machine)?;
        let path = self.test.path()?;
        let perfect = ErrorModel::perfect(&machine);
        let bench = Bench::new(&machine, &perfect, Default::default());
        self.test.bar(&bench, &path)?;
        let said = format!("{} positions", path.len());
        output::write_or_print(self.output.as_deref(), &program(&path, self.feed), &said)?;
        Ok(Outcome::Done)
    }
}

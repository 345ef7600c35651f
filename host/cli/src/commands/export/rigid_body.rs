//! `trueaxis export isg` and `heidenhain`: errors for controls that have a model of the machine.

use super::ExportVerdict;
use crate::commands::files::MachineFiles;
use crate::commands::number::positive;
use crate::commands::random::RandomOptions;
use crate::commands::{Outcome, bad_input::BadInput, files};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis_controllers::heidenhain::{self, Angles};
use trueaxis_controllers::isg::{self, IsgError};
use trueaxis_controllers::rigid_body::RemainingErrors;
use trueaxis_model::source::FileError;

#[derive(Args)]
pub struct RigidBodyOptions {
    #[command(flatten)]
    files: MachineFiles,
    /// Points over the travel of each axis
    #[arg(long, value_name = "N", default_value_t = 61, value_parser = clap::value_parser!(u16).range(2..=1000))]
    points: u16,
    /// Largest permitted error of the tip
    #[arg(long, value_name = "µm", default_value_t = 1.0, value_parser = positive)]
    tolerance: f64,
    /// Write even if more is left than the tolerance
    #[arg(long)]
    best_effort: bool,
    #[command(flatten)]
    random: RandomOptions,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

/// Write the errors of a machine for the volumetric compensation of ISG and Beckhoff (TF5280)
///
/// A table of the error motions of each axis, with locations taken in. The control corrects the position of the tip only:
/// what the missing orientation costs is printed, and more than the tolerance at the tip is refused.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis export isg machine.toml errors.toml -o errors.csv --configuration volcomp.lis"
)]
pub struct Isg {
    #[command(flatten)]
    common: RigidBodyOptions,
    /// Where to write the table (ISG_CSV)
    #[arg(short, long, value_name = "FILE.csv")]
    output: PathBuf,
    /// Also write the lines of the configuration; CHECK marks what you must fill in
    #[arg(long, value_name = "FILE")]
    configuration: Option<PathBuf>,
}

/// Write the errors of a machine for KinematicsComp of a Heidenhain iTNC 530 (X.csv …)
///
/// A table of the error motions of each axis in the columns C1 to C6, with locations taken in, for the position of the tip.
/// No control has read them: check columns and units on yours.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis export heidenhain machine.toml errors.toml --angles deg -o ."
)]
pub struct Heidenhain {
    #[command(flatten)]
    common: RigidBodyOptions,
    /// Unit of C4 to C6, which the public manuals do not name: enter one angle on the control and measure
    #[arg(long, value_enum)]
    angles: Angles,
    /// Folder for X.csv, Y.csv …
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

#[derive(Serialize)]
struct RigidBodyAnswer<'a> {
    files: Vec<&'a Path>,
    written: bool,
    meets_tolerance: bool,
    tolerance_um: f64,
    #[serde(flatten)]
    left: &'a RemainingErrors,
}

impl RigidBodyOptions {
    /// Writes the files if what is left permits it, and says what that is.
    fn write(
        &self,
        texts: &[(PathBuf, String)],
        left: &RemainingErrors,
    ) -> Result<Outcome, BadInput> {
        let inputs: [&Path; 2] = [&self.files.machine, &self.files.errors];
        for (path, _) in texts {
            files::prepare(path, &inputs)?;
        }
        let verdict = ExportVerdict::new(left.tip_um <= self.tolerance, self.best_effort);
        for (path, text) in texts.iter().filter(|_| verdict.written) {
            files::write(path, text.as_bytes())?;
        }
        let paths = texts.iter().map(|(path, _)| path.as_path());
        if self.json {
            files::print_json(&RigidBodyAnswer {
                files: paths.collect(),
                written: verdict.written,
                meets_tolerance: verdict.meets,
                tolerance_um: self.tolerance,
                left,
            })?;
        } else {
            let names: Vec<String> = paths.map(|path| path.display().to_string()).collect();
            let random = self.random.random;
            files::print(&format!("{}\n{}", names.join(", "), screen(left, random)))?;
        }
        Ok(verdict.outcome(
            &format!("more than {} µm remains at the tip", self.tolerance),
            "the control knows no direction of travel, and straight lines between points",
        ))
    }
}

/// What the errors were, and what is left of them.
fn screen(left: &RemainingErrors, positions: u32) -> String {
    format!(
        "read again, {positions} random positions, largest\n                     without       with\n\
         error of the tip    {:>8.2}   {:>8.2} µm\nof its direction    {:>8.2}   {:>8.2} µrad, which the control \
         does not correct\n",
        left.tip_before_um, left.tip_um, left.direction_before_urad, left.direction_urad
    )
}

fn fault(error: &FileError) -> BadInput {
    BadInput::new(
        format!("the written file cannot be read back: {}", error.message),
        "this is a fault of trueaxis: please report it with the files",
    )
}

pub fn isg(arguments: &Isg) -> Result<Outcome, BadInput> {
    let common = &arguments.common;
    let (machine, errors) = common.files.read()?;
    let RandomOptions { random, seed } = common.random;
    let made = isg::export(
        &machine,
        &errors,
        common.points.into(),
        random as usize,
        seed,
    );
    let made = made.map_err(|error| match error {
        IsgError::Read(error) => fault(&error),
        IsgError::Axes(_) => BadInput::new(
            format!("{}: {error}", common.files.machine.display()),
            "name the linear axes X, Y and Z in the machine file",
        ),
    })?;
    let mut texts = vec![(arguments.output.clone(), made.csv)];
    if let Some(path) = &arguments.configuration {
        let name = arguments
            .output
            .file_name()
            .unwrap_or_default()
            .to_string_lossy();
        let lines = made.configuration.replace("errors.csv", &name);
        texts.push((path.clone(), lines));
    }
    common.write(&texts, &made.left)
}

pub fn heidenhain(arguments: &Heidenhain) -> Result<Outcome, BadInput> {
    let common = &arguments.common;
    let (machine, errors) = common.files.read()?;
    let RandomOptions { random, seed } = common.random;
    let made = heidenhain::export(
        &machine,
        &errors,
        common.points.into(),
        arguments.angles,
        random as usize,
        seed,
    );
    let (made, left) = made.map_err(|error| fault(&error))?;
    let named = made.into_iter();
    let texts: Vec<(PathBuf, String)> = named
        .map(|file| {
            (
                arguments.output.join(format!("{}.csv", file.axis)),
                file.text,
            )
        })
        .collect();
    common.write(&texts, &left)
}

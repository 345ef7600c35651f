//! `trueaxis export isg` and `heidenhain`: errors for controls that have a model of the machine.

use super::{LeftOptions, refused};
use crate::commands::files::MachineFiles;
use crate::commands::random::RandomOptions;
use crate::commands::{Outcome, bad_input::BadInput, output};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis_export::heidenhain::{self, Angles};
use trueaxis_export::isg;
use trueaxis_export::rigid_body::RemainingErrors;

#[derive(Args)]
pub struct RigidBodyOptions {
    #[command(flatten)]
    files: MachineFiles,
    /// Points over the travel of each axis
    #[arg(long, value_name = "N", default_value_t = 61, value_parser = clap::value_parser!(u16).range(2..=1000))]
    points: u16,
    #[command(flatten)]
    left: LeftOptions,
    #[command(flatten)]
    random: RandomOptions,
}

/// Write the errors of a machine for the volumetric compensation of ISG and Beckhoff (TF5280)
///
/// A table of the error motions of each axis, with locations taken in. The control corrects the position of the tip only:
/// what the missing orientation costs is printed, and more than the tolerance at the tip is refused.
#[derive(Args)]
#[command(after_help = "Example:\n  trueaxis export isg machine.toml errors.toml -o errors.csv")]
pub struct Isg {
    #[command(flatten)]
    common: RigidBodyOptions,
    /// Where to write the table (ISG_CSV)
    #[arg(short, long, value_name = "FILE.csv")]
    output: PathBuf,
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
            output::prepare(path, &inputs)?;
        }
        let tolerance_um = self.left.tolerance;
        let verdict = self.left.write(texts, left.tip_um <= tolerance_um)?;
        let answer = RigidBodyAnswer {
            files: texts.iter().map(|(path, _)| path.as_path()).collect(),
            written: verdict.written,
            meets_tolerance: verdict.meets,
            tolerance_um,
            left,
        };
        output::print_answer(self.left.json, &answer, || {
            screen(&answer, self.random.random)
        })?;
        Ok(verdict.outcome(
            &format!("more than {tolerance_um} µm remains at the tip"),
            "the control knows no direction of travel, and straight lines between points",
        ))
    }
}

/// What the errors were, and what is left of them.
fn screen(RigidBodyAnswer { files, left, .. }: &RigidBodyAnswer<'_>, positions: u32) -> String {
    let names: Vec<String> = files
        .iter()
        .map(|path| path.display().to_string())
        .collect();
    format!(
        "{}\nread again, {positions} random positions, largest\n                     without       with\n\
         error of the tip    {:>8.2}   {:>8.2} µm\nof its direction    {:>8.2}   {:>8.2} µrad, which the control \
         does not correct\n",
        names.join(", "),
        left.tip_before_um,
        left.tip_um,
        left.direction_before_urad,
        left.direction_urad
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
    let (csv, left) = made.map_err(|error| refused(&error, &common.files.machine))?;
    common.write(&[(arguments.output.clone(), csv)], &left)
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
    let (made, left) = made.map_err(|error| refused(&error, &common.files.machine))?;
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

//! Options of every export that may leave something of a compensation, and what it left.

use super::ExportVerdict;
use crate::commands::number::positive;
use crate::commands::random::RandomOptions;
use crate::commands::{Outcome, bad_input::BadInput, files};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis_controllers::difference::Difference;
use trueaxis_tables::policy::{of_blob, tolerance_urad};
use trueaxis_tables::validate::Runtime;

#[derive(Args)]
pub struct Arguments {
    /// Largest permitted difference from the compensation: µm, and as many µrad
    #[arg(long, value_name = "µm", default_value_t = 1.0, value_parser = positive)]
    pub tolerance: f64,
    /// Write even if more is left than the tolerance
    #[arg(long)]
    pub best_effort: bool,
    #[command(flatten)]
    pub random: RandomOptions,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

/// What was written, and what it leaves.
#[derive(Serialize)]
struct LeftAnswer<'a, T> {
    files: Vec<&'a Path>,
    written: bool,
    meets_tolerance: bool,
    tolerance_um: f64,
    positions: u32,
    axes: &'a [Difference],
    #[serde(flatten)]
    more: &'a T,
}

impl Arguments {
    /// Writes the files if what is left permits it, and prints `screen` and what is left, or JSON with `more`.
    /// `stays` says what such files cannot express.
    pub fn write(
        &self,
        runtime: &Runtime<'_>,
        texts: &[(PathBuf, String)],
        found: &[Difference],
        screen: &str,
        stays: &str,
        more: &impl Serialize,
    ) -> Result<Outcome, BadInput> {
        let urad = tolerance_urad(of_blob(runtime.compensation().policy()), self.tolerance);
        let tolerance = |axis: &Difference| match axis.unit {
            "µm" => self.tolerance,
            _ => urad,
        };
        let meets = found.iter().all(|axis| axis.difference <= tolerance(axis));
        let verdict = ExportVerdict::new(meets, self.best_effort);
        for (path, text) in texts.iter().filter(|_| verdict.written) {
            if let Some(folder) = path.parent() {
                files::make_folder(folder)?;
            }
            files::write(path, text.as_bytes())?;
        }
        if self.json {
            files::print_json(&LeftAnswer {
                files: texts.iter().map(|(path, _)| path.as_path()).collect(),
                written: verdict.written,
                meets_tolerance: meets,
                tolerance_um: self.tolerance,
                positions: self.random.random,
                axes: found,
                more,
            })?;
        } else {
            files::print(&format!("{screen}{}", table(found, self.random.random)))?;
        }
        let remains = format!("more than {} µm remains", self.tolerance);
        Ok(verdict.outcome(&remains, stays))
    }
}

fn table(found: &[Difference], positions: u32) -> String {
    let mut text = format!(
        "\nread again, {positions} random positions\naxis  largest correction     remaining\n"
    );
    for axis in found {
        text += &format!(
            "{}     {:>13.2} {u:<4} {:>8.2} {u}\n",
            axis.axis,
            axis.largest,
            axis.difference,
            u = axis.unit
        );
    }
    text
}

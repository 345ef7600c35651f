//! Options of every export that may leave something of a compensation, and what it left.

use super::LeftOptions;
use crate::commands::random::RandomOptions;
use crate::commands::{Outcome, bad_input::BadInput, output};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis_export::difference::Difference;
use trueaxis_model::policy::{of_blob, tolerance_urad};
use trueaxis_model::validate::Runtime;

#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    options: LeftOptions,
    #[command(flatten)]
    pub random: RandomOptions,
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
        let um = self.options.tolerance;
        let urad = tolerance_urad(of_blob(runtime.compensation().policy()), um);
        let tolerance = |axis: &Difference| if axis.unit == "µm" { um } else { urad };
        let meets = found.iter().all(|axis| axis.difference <= tolerance(axis));
        let verdict = self.options.write(texts, meets)?;
        let answer = LeftAnswer {
            files: texts.iter().map(|(path, _)| path.as_path()).collect(),
            written: verdict.written,
            meets_tolerance: meets,
            tolerance_um: um,
            positions: self.random.random,
            axes: found,
            more,
        };
        output::print_answer(self.options.json, &answer, || {
            format!("{screen}{}", table(found, self.random.random))
        })?;
        let remains = format!("more than {um} µm remains");
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

//! `trueaxis eval`

use super::bad_input::BadInput;
use super::files::{self, Text};
use super::output;
use super::{Outcome, screen};
use clap::Args;
use serde::Serialize;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use trueaxis::Policy;
use trueaxis_model::motion::{self, Outside};
use trueaxis_model::policy::PolicyName;
use trueaxis_model::positions::{self, ColumnInput};
use trueaxis_model::validate::Runtime;

/// Evaluate a compensation at positions, as the controller does
///
/// Rows are taken as a motion in their order; an axis has reversed once it comes back by its reversal threshold.
/// Prints corrections dX,dY,… in the order of the blob's axes, without the servo's limits on rate and travel. Tables hold their end values
/// outside the travel; a warning names the axis.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis eval machine.trax --positions path.csv -o corrections.csv\n\n\
Positions: a header with the axis letters in any order, further inputs by name: `tool length` or\n\
`length` (mm), temperature sensors by their name (K from their reference), with the lag if they have\n\
one (`bed 600 s`), or the sensor alone and time_s. One position per line, mm and degrees:\n  X,Y,Z,A,C\n  10.5,-20,0,30,90"
)]
pub struct Arguments {
    /// The compensation
    #[arg(value_name = "FILE.trax")]
    blob: PathBuf,
    #[command(flatten)]
    along: EvalAlong,
}

/// Input positions and output of corrections.
#[derive(Args)]
pub struct EvalAlong {
    /// Positions (CSV)
    #[arg(long, value_name = "P.csv")]
    pub positions: PathBuf,
    /// Where to write the corrections (CSV; default: standard output)
    #[arg(short, long, value_name = "OUT.csv")]
    pub output: Option<PathBuf>,
    /// Print JSON: the corrections, or with -o what was written
    #[arg(long)]
    pub json: bool,
}

#[derive(Serialize)]
struct EvalCorrections<'a, T> {
    #[serde(flatten)]
    policy: PolicyName,
    axes: &'a [char],
    outside: &'a [Outside<T>],
    corrections: &'a [Vec<T>],
}

#[derive(Serialize)]
struct EvalWritten<'a, T> {
    #[serde(flatten)]
    policy: Option<PolicyName>,
    file: &'a Path,
    rows: usize,
    outside: &'a [Outside<T>],
}

impl EvalAlong {
    /// Reads the positions, each row in the order of `inputs`. `others` are further input files.
    pub fn read(
        &self,
        inputs: &[ColumnInput],
        others: &[&Path],
    ) -> Result<Vec<Vec<f64>>, BadInput> {
        if let Some(output) = &self.output {
            output::prepare(output, others)?;
            output::prepare(output, &[&self.positions])?;
        }
        let text = Text::read(&self.positions)?;
        positions::read(&text.text, inputs).map_err(|e| text.bad(e))
    }

    /// Writes the corrections to the file or standard output, and warns about axes outside their travel.
    pub fn write<T: Display + Serialize>(
        &self,
        policy: Policy,
        letters: &[char],
        corrections: &[Vec<T>],
        outside: &[Outside<T>],
    ) -> Result<Outcome, BadInput> {
        self.warn(outside);
        let answer = EvalCorrections {
            policy: policy.into(),
            axes: letters,
            outside,
            corrections,
        };
        let csv = || positions::write(letters, corrections);
        let rows = corrections.len();
        self.finish(Some(policy), rows, "corrections", csv, &answer, outside)
    }

    /// Warns about axes outside their travel.
    pub fn warn<T: Display>(&self, outside: &[Outside<T>]) {
        for outside in outside {
            eprintln!("warning: {}: {outside}", self.positions.display());
        }
    }

    /// Writes the results for `rows` rows as CSV or JSON to the file or standard output, with the policy if they
    /// depend on one.
    pub fn finish<T: Serialize>(
        &self,
        policy: Option<Policy>,
        rows: usize,
        what: &str,
        csv: impl FnOnce() -> String,
        answer: &impl Serialize,
        outside: &[Outside<T>],
    ) -> Result<Outcome, BadInput> {
        match &self.output {
            None if self.json => output::print_json(answer)?,
            None => output::print(&csv())?,
            Some(path) => {
                output::write(path, csv().as_bytes())?;
                if self.json {
                    output::print_json(&EvalWritten {
                        policy: policy.map(PolicyName::from),
                        file: path,
                        rows,
                        outside,
                    })?;
                } else {
                    let policy = policy.map(screen::policy).unwrap_or_default();
                    let written = path.display();
                    output::print(&format!("{written}: {what} of {rows} positions\n{policy}"))?;
                }
            }
        }
        Ok(Outcome::Done)
    }
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let Arguments { blob: path, along } = arguments;
    let blob = files::read_blob(path)?;
    let runtime = Runtime::load(&blob).map_err(|e| BadInput::in_blob(e, path))?;
    let compensation = runtime.compensation();
    let inputs = ColumnInput::of_compensation(compensation.axes(), compensation.auxiliaries());
    let rows = along.read(&inputs, &[path])?;
    let corrections = motion::evaluate(compensation, &rows).map_err(|error| {
        BadInput::new(
            format!("{}: {error}", along.positions.display()),
            "reduce the positions of this axis into a few turns",
        )
    })?;
    let letters: Vec<char> = compensation
        .axes()
        .iter()
        .map(|a| char::from(a.name))
        .collect();
    let outside = motion::outside_compensation(compensation, &rows);
    for beyond in motion::beyond_range(compensation, &rows) {
        eprintln!("warning: {}: {beyond}", along.positions.display());
    }
    let turns = letters.iter().any(|letter| "ABC".contains(*letter));
    if turns && along.output.is_none() && !along.json {
        // Not among the rows, which are read by programs.
        eprint!("{}", screen::policy(compensation.policy()));
    }
    along.write(compensation.policy(), &letters, &corrections, &outside)
}

//! Output of `trueaxis compile`.

use crate::commands::bad_input::BadInput;
use crate::commands::{output, screen};
use serde::Serialize;
use std::path::Path;
use trueaxis::Policy;
use trueaxis_model::policy::PolicyName;
use trueaxis_tables::compile::{FINEST, Full, Refusal};
use trueaxis_tables::made::VerifiedFigures;
use trueaxis_tables::target::{Shortage, Target};

/// If the tables leave a tenth of the error that uncertain parameters leave, they add only half a percent to it
/// (root sum of squares).
const NOTHING_BOUGHT: f64 = 10.0;

/// All results.
#[derive(Serialize)]
pub struct CompileAnswer<'a> {
    pub file: &'a Path,
    pub machine: &'a str,
    pub scheme: String,
    /// The position whose correction is subtracted everywhere.
    pub zero_at: Option<&'a str>,
    #[serde(flatten)]
    pub policy: PolicyName,
    #[serde(skip)]
    pub stored: Policy,
    pub target: &'a Target,
    pub tolerance_um: f64,
    pub tolerance_urad: f64,
    pub meets_tolerance: bool,
    /// Whether the file now exists.
    pub written: bool,
    /// The verified compensation, if it fits into the target.
    #[serde(flatten)]
    pub verified: Option<VerifiedFigures<'a>>,
    /// Limits missed by a scheme that guarantees none.
    pub missed: &'a [Refusal],
    /// Reasons why the file is not written, or only under `--best-effort`.
    pub refusals: &'a [Refusal],
    /// What the target lacks, if it does not fit.
    pub shortages: &'a [Shortage],
    /// How to make it smaller.
    #[serde(skip)]
    pub smaller: &'static str,
    /// Why the tolerance is not met, if the target is full.
    pub full: Option<&'a Full>,
    /// A coarser tolerance (µm) that is met, if this one is missed.
    pub fits_um: Option<f64>,
    /// Whether every figure is printed.
    #[serde(skip)]
    pub is_verbose: bool,
    /// Whether the tolerance was chosen by the command rather than given.
    #[serde(skip)]
    pub is_default: bool,
}

/// Prints results to standard output and refusals to standard error. JSON is one object, or a list of several. Each
/// answer ends with its verdict.
pub fn print(
    answers: &[CompileAnswer<'_>],
    verdicts: &[String],
    json: bool,
) -> Result<(), BadInput> {
    match answers {
        [one] if json => output::print_json(one)?,
        _ if json => output::print_json(&answers)?,
        _ => {}
    }
    let all = answers.iter().zip(verdicts);
    all.into_iter()
        .try_for_each(|(answer, verdict)| answer.print(verdict, json))
}

impl CompileAnswer<'_> {
    fn text(&self, verified: &VerifiedFigures<'_>, verdict: &str) -> String {
        let mut text = format!("{}: {}\n", self.file.display(), self.machine);
        text += &screen::size(&verified.size);
        text += &screen::zero(self.zero_at);
        if self.is_verbose {
            text += &screen::policy(self.stored);
            text.push('\n');
            text += &screen::quality(verified.verification, self.tolerance_um);
            text += &screen::uncertainty(verified.uncertainty);
            text.push('\n');
            text += &screen::bounds(verified.axes, &verified.verification.travel.largest);
            text += &screen::largest(self.stored, verified.axes);
        } else {
            text.push('\n');
            text += &screen::summary(verified.verification);
        }
        text += verdict;
        text += &screen::tool_length(verified.verification);
        text + &screen::reversals(verified.reversals)
    }

    fn print(&self, verdict: &str, json: bool) -> Result<(), BadInput> {
        if !json && let Some(verified) = &self.verified {
            output::print(&self.text(verified, verdict))?;
        }
        if let Some(verified) = &self.verified {
            for note in verified.notes {
                eprintln!("note: {note}");
            }
            for warning in &verified.warnings {
                eprintln!("warning: {}", warning.message);
            }
        }
        for missed in self.missed {
            eprintln!("warning: {missed}");
        }
        for refusal in self.refusals {
            eprintln!("{refusal}");
        }
        for shortage in self.shortages {
            eprintln!("the target {} is too small: {shortage}", self.target.name);
        }
        if !self.shortages.is_empty() {
            eprintln!("  {}", self.smaller);
        }
        if let Some(full) = self.full {
            eprintln!("{full}");
        }
        self.print_tolerance();
        self.print_fate();
        Ok(())
    }

    /// Prints which tolerance was chosen, or which one would be met.
    fn print_tolerance(&self) {
        if let (None, Some(um)) = (self.full, self.fits_um) {
            eprintln!("--tolerance {um} is met");
        }
        let Some(verified) = self.verified.as_ref().filter(|_| self.meets_tolerance) else {
            return;
        };
        let leaves = verified
            .uncertainty
            .map(|band| band.travel.translation_um.max);
        let far = leaves.filter(|leaves| *leaves > NOTHING_BOUGHT * self.tolerance_um);
        let tolerance = self.tolerance_um;
        if self.is_default && tolerance > FINEST {
            let beside = leaves.map_or_else(String::new, |leaves| {
                let bought = far.map_or("", |_| ", so a finer one buys nothing");
                format!(
                    "; the uncertainty of the parameters alone causes up to {leaves:.2} µm{bought}"
                )
            });
            eprintln!(
                "note: the tolerance is {tolerance} µm, the finest of 0.05, 0.1, 0.2, 0.5 and 1 that is met{beside}"
            );
        } else if let (false, Some(leaves)) = (self.is_default, far) {
            eprintln!(
                "note: the uncertainty of the parameters alone causes up to {leaves:.2} µm: a tolerance below {:.2} µm buys nothing",
                leaves / NOTHING_BOUGHT
            );
        }
    }

    fn print_fate(&self) {
        let file = self.file.display();
        let is_right = self.refusals.is_empty() && self.shortages.is_empty();
        if is_right && self.written {
            return;
        }
        if self.written {
            eprintln!("{file} is written all the same, as --best-effort asks for");
            return;
        }
        let fate = if self.file.exists() {
            "stays as it was"
        } else {
            "is not written"
        };
        let yields = self.refusals.iter().all(Refusal::yields_to_best_effort);
        if is_right {
            eprintln!("{file} {fate}, for another of the files cannot be");
            return;
        }
        let remedy = if self.verified.is_some() && yields {
            "; --best-effort would write it"
        } else {
            ""
        };
        eprintln!("{file} {fate}{remedy}");
    }
}

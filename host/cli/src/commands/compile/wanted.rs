//! One compensation: made, written and shown.

use super::answer::CompileAnswer;
use crate::commands::bad_input::BadInput;
use crate::commands::error_source;
use crate::commands::files::MachineFiles;
use crate::commands::output;
use crate::commands::progress::ProgressBarOnScreen;
use crate::commands::verdict;
use std::path::PathBuf;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_model::policy::{stored, tolerance_urad};
use trueaxis_model::validate::Runtime;
use trueaxis_report::{self as report, ReportedCompensation};
use trueaxis_tables::compile;
use trueaxis_tables::made::{Made, VerifiedFigures, Whole};
use trueaxis_tables::target::Target;

/// A compensation to make, and the file that it is for.
pub struct WantedFile {
    pub output: PathBuf,
    pub options: compile::Options,
    /// The tolerance that was asked for (µm), if any.
    pub asked: Option<f64>,
    /// The position whose correction is subtracted, as given.
    pub zero_at: Option<String>,
    pub is_verbose: bool,
}

impl WantedFile {
    /// What `trueaxis compile` makes without options.
    pub fn usual(output: PathBuf, target: Target) -> Self {
        Self {
            output,
            options: compile::Options::of(target),
            asked: None,
            zero_at: None,
            is_verbose: false,
        }
    }

    pub fn make(
        &self,
        files: &MachineFiles,
        machine: &Machine,
        errors: &ErrorModel,
        bar: &ProgressBarOnScreen,
    ) -> Result<Made, BadInput> {
        Made::new(machine, errors, &self.options, self.asked, bar)
            .map_err(|error| error_source::compile(error, files, machine, errors))
    }

    pub fn write(&self, made: &Made) -> Result<(), BadInput> {
        match made {
            Made::Verified(made) => output::write(&self.output, &made.best.built.blob),
            Made::NoRoom(_) => Ok(()),
        }
    }

    /// The report's verdict for the screen; nothing without a compensation.
    pub fn verdict(
        &self,
        machine: &Machine,
        errors: &ErrorModel,
        made: &Made,
    ) -> Result<String, BadInput> {
        let Made::Verified(made) = made else {
            return Ok(String::new());
        };
        let runtime =
            Runtime::load(&made.best.built.blob).map_err(|e| BadInput::in_blob(e, &self.output))?;
        let compensation = self.compensation(&runtime, made);
        let found = report::verdict(machine, errors, Some(compensation), self.options.seed);
        let found = found.map_err(|error| crate::commands::report::bad(&error))?;
        Ok(verdict::lines(&found))
    }

    /// The compensation, as a report takes it.
    pub fn compensation<'a>(
        &'a self,
        runtime: &'a Runtime<'a>,
        made: &'a Whole,
    ) -> ReportedCompensation<'a> {
        ReportedCompensation {
            runtime,
            verification: &made.best.verification,
            uncertainty: made.uncertainty.as_ref(),
            zero_at: self.options.tables.zero_at.as_deref(),
            tolerance_um: made.best.tolerance,
        }
    }

    /// Collects the results for output.
    pub fn answer<'a>(
        &'a self,
        machine: &'a Machine,
        made: &'a Made,
        written: bool,
    ) -> CompileAnswer<'a> {
        let tables = &self.options.tables;
        let tolerance = made.tolerance().unwrap_or(1e3 * tables.tolerance);
        let policy = stored(tables.policy);
        let answer = CompileAnswer {
            file: &self.output,
            machine: &machine.name,
            scheme: self.options.scheme.name(),
            zero_at: self.zero_at.as_deref(),
            policy: policy.into(),
            stored: policy,
            target: &tables.target,
            tolerance_um: tolerance,
            tolerance_urad: tolerance_urad(tables.policy, tolerance),
            meets_tolerance: false,
            written,
            verified: None,
            missed: &[],
            refusals: &[],
            shortages: &[],
            smaller: self.options.scheme.smaller(),
            full: None,
            fits_um: None,
            is_verbose: self.is_verbose,
            is_default: self.asked.is_none(),
        };
        match made {
            Made::NoRoom(shortages) => CompileAnswer {
                shortages,
                ..answer
            },
            Made::Verified(made) => CompileAnswer {
                meets_tolerance: made.best.verification.meets(tolerance),
                verified: Some(VerifiedFigures::new(made)),
                missed: &made.missed,
                refusals: &made.refusals,
                full: made.best.full.as_ref(),
                fits_um: made.best.fits_um,
                ..answer
            },
        }
    }
}

/// Makes what `trueaxis compile` makes without options; writes it only if it is right.
pub fn usual(
    files: &MachineFiles,
    output: PathBuf,
    target: Target,
) -> Result<UsualCompensation, BadInput> {
    let (machine, errors) = files.read()?;
    let wanted = WantedFile::usual(output, target);
    output::prepare(&wanted.output, &[&files.machine, &files.errors])?;
    let made = wanted.make(files, &machine, &errors, &ProgressBarOnScreen::new())?;
    if made.may_be_written(false) {
        wanted.write(&made)?;
    }
    Ok(UsualCompensation {
        wanted,
        machine,
        errors,
        made,
    })
}

/// A compensation that was made, with what it was made of.
pub struct UsualCompensation {
    wanted: WantedFile,
    machine: Machine,
    errors: ErrorModel,
    pub made: Made,
}

impl UsualCompensation {
    /// Prints what people read.
    pub fn show(&self) -> Result<(), BadInput> {
        let written = self.made.may_be_written(false);
        let verdict = self
            .wanted
            .verdict(&self.machine, &self.errors, &self.made)?;
        let answer = self.wanted.answer(&self.machine, &self.made, written);
        super::answer::print(&[answer], &[verdict], false)
    }
}

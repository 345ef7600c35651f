//! One compensation: made, written and shown.

use super::answer::Answer;
use crate::commands::bad_input::BadInput;
use crate::commands::error_source;
use crate::commands::files::{self, MachineFiles};
use crate::commands::progress::Bar;
use crate::commands::verdict;
use std::path::PathBuf;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_report::{self as report, Compensation};
use trueaxis_tables::compile;
use trueaxis_tables::made::{Made, Proven, Whole};
use trueaxis_tables::policy::{stored, tolerance_urad};
use trueaxis_tables::target::Target;
use trueaxis_tables::validate::Runtime;

/// A compensation to make, and the file that it is for.
pub struct Wanted {
    pub output: PathBuf,
    pub options: compile::Options,
    /// The tolerance that was asked for (µm), if any.
    pub asked: Option<f64>,
    /// The position whose correction is subtracted, as given.
    pub zero_at: Option<String>,
    pub is_verbose: bool,
}

impl Wanted {
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
        bar: &Bar,
    ) -> Result<Made, BadInput> {
        Made::new(machine, errors, &self.options, self.asked, bar)
            .map_err(|error| error_source::compile(error, files, machine, errors))
    }

    pub fn write(&self, made: &Made) -> Result<(), BadInput> {
        match made {
            Made::Proven(made) => files::write(&self.output, &made.best.built.blob),
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
        let Made::Proven(made) = made else {
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
    ) -> Compensation<'a> {
        Compensation {
            runtime,
            proof: &made.best.proof,
            uncertainty: made.uncertainty.as_ref(),
            zero_at: self.options.tables.zero_at.as_deref(),
            tolerance_um: made.best.tolerance,
        }
    }

    /// Collects the results for output.
    pub fn answer<'a>(&'a self, machine: &'a Machine, made: &'a Made, written: bool) -> Answer<'a> {
        let tables = &self.options.tables;
        let tolerance = made.tolerance().unwrap_or(1e3 * tables.tolerance);
        let policy = stored(tables.policy);
        let answer = Answer {
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
            proven: None,
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
            Made::NoRoom(shortages) => Answer {
                shortages,
                ..answer
            },
            Made::Proven(made) => Answer {
                meets_tolerance: made.best.proof.meets(tolerance),
                proven: Some(Proven::new(made)),
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
pub fn usual(files: &MachineFiles, output: PathBuf, target: Target) -> Result<Compiled, BadInput> {
    let (machine, errors) = files.read()?;
    let wanted = Wanted::usual(output, target);
    files::prepare(&wanted.output, &[&files.machine, &files.errors])?;
    let made = wanted.make(files, &machine, &errors, &Bar::new())?;
    if made.may_be_written(false) {
        wanted.write(&made)?;
    }
    Ok(Compiled {
        wanted,
        machine,
        errors,
        made,
    })
}

/// A compensation that was made, with what it was made of.
pub struct Compiled {
    wanted: Wanted,
    machine: Machine,
    errors: ErrorModel,
    pub made: Made,
}

impl Compiled {
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
